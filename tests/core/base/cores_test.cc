#include "core/base/cores.h"

#include <gtest/gtest.h>
#include <sched.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>

namespace liquidblend::base {
namespace {

// A root with files like those of /proc and /sys.
class NumCoresTest : public ::testing::Test {
 protected:
  void SetUp() override { std::filesystem::create_directories(root_); }
  void TearDown() override { std::filesystem::remove_all(root_); }

  void Write(const std::string& path, const std::string& text) {
    std::filesystem::create_directories(std::filesystem::path(root_ + path).parent_path());
    std::ofstream(root_ + path) << text;
  }

  const std::string root_ = ::testing::TempDir() + "/cores_" + std::to_string(getpid());
};

TEST_F(NumCoresTest, AreThoseOfTheMachineWithoutAQuota) {
  EXPECT_EQ(NumCoresUnder(root_, 8), 8);
  Write("/proc/self/cgroup", "0::/system.slice/worker.service\n");
  Write("/sys/fs/cgroup/system.slice/worker.service/cpu.max", "max 100000\n");
  EXPECT_EQ(NumCoresUnder(root_, 8), 8);
}

TEST_F(NumCoresTest, AreTheLowestQuotaOfTheGroupAndThoseAboveIt) {
  Write("/proc/self/cgroup", "1:name=systemd:/a\n0::/system.slice/worker.service\n");
  Write("/sys/fs/cgroup/system.slice/cpu.max", "600000 100000\n");
  EXPECT_EQ(NumCoresUnder(root_, 8), 6);
  Write("/sys/fs/cgroup/system.slice/worker.service/cpu.max", "400000 100000\n");
  EXPECT_EQ(NumCoresUnder(root_, 8), 4);
  EXPECT_EQ(NumCoresUnder(root_, 3), 3) << "a quota above the machine's cores";
  Write("/sys/fs/cgroup/cpu.max", "200000 100000\n");  // of a container, whose root it is
  EXPECT_EQ(NumCoresUnder(root_, 8), 2);
}

TEST_F(NumCoresTest, RoundAQuotaUpToWholeCores) {
  Write("/proc/self/cgroup", "0::/\n");
  Write("/sys/fs/cgroup/cpu.max", "150000 100000\n");
  EXPECT_EQ(NumCoresUnder(root_, 8), 2);
  Write("/sys/fs/cgroup/cpu.max", "10000 100000\n");
  EXPECT_EQ(NumCoresUnder(root_, 8), 1);
}

TEST_F(NumCoresTest, HeedQuotasOfVersion1) {
  Write("/proc/self/cgroup", "9:cpu,cpuacct:/docker/b\n7:cpuset:/c\n0::/\n");
  Write("/sys/fs/cgroup/cpu/docker/b/cpu.cfs_quota_us", "300000\n");
  Write("/sys/fs/cgroup/cpu/docker/b/cpu.cfs_period_us", "100000\n");
  Write("/sys/fs/cgroup/cpu/c/cpu.cfs_quota_us", "100000\n");  // another controller's group
  Write("/sys/fs/cgroup/cpu/c/cpu.cfs_period_us", "100000\n");
  EXPECT_EQ(NumCoresUnder(root_, 8), 3);
  Write("/sys/fs/cgroup/cpu/docker/b/cpu.cfs_quota_us", "-1\n");
  EXPECT_EQ(NumCoresUnder(root_, 8), 8);
}

TEST(NumCores, AreNoMoreThanTheAffinityAllows) {
  cpu_set_t before;
  ASSERT_EQ(sched_getaffinity(0, sizeof(before), &before), 0);
  EXPECT_GE(NumCores(), 1);
  EXPECT_LE(NumCores(), CPU_COUNT(&before));
  cpu_set_t one;
  CPU_ZERO(&one);
  for (int core = 0; core < CPU_SETSIZE && CPU_COUNT(&one) == 0; ++core) {
    if (CPU_ISSET(core, &before)) CPU_SET(core, &one);
  }
  ASSERT_EQ(sched_setaffinity(0, sizeof(one), &one), 0);
  EXPECT_EQ(NumCores(), 1);
  ASSERT_EQ(sched_setaffinity(0, sizeof(before), &before), 0);
}

TEST(ShareOfCores, DividesThemAndLeavesEachOne) {
  EXPECT_EQ(ShareOfCores(8, 2), 4);
  EXPECT_EQ(ShareOfCores(7, 2), 3);
  EXPECT_EQ(ShareOfCores(2, 4), 1);
  EXPECT_EQ(ShareOfCores(8, 0), 8);
}

}  // namespace
}  // namespace liquidblend::base
