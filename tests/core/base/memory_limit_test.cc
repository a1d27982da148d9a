#include "core/base/memory_limit.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>

namespace liquidblend::base {
namespace {

// A root with files like those of /proc and /sys.
class MemoryLimitTest : public ::testing::Test {
 protected:
  void SetUp() override { std::filesystem::create_directories(root_); }
  void TearDown() override { std::filesystem::remove_all(root_); }

  void Write(const std::string& path, const std::string& text) {
    std::filesystem::create_directories(std::filesystem::path(root_ + path).parent_path());
    std::ofstream(root_ + path) << text;
  }

  const std::string root_ = ::testing::TempDir() + "/memory_limit_" + std::to_string(getpid());
};

constexpr char kMachine[] = "MemTotal:       16777216 kB\nMemFree:         1 kB\n";  // 16 GiB

TEST_F(MemoryLimitTest, IsTheMachinesWithoutGroups) {
  Write("/proc/meminfo", kMachine);
  EXPECT_EQ(MemoryLimitUnder(root_), int64_t{16} << 30);
}

TEST_F(MemoryLimitTest, IsTheLowestOfTheGroupAndThoseAboveIt) {
  Write("/proc/meminfo", kMachine);
  Write("/proc/self/cgroup", "0::/system.slice/worker.service\n");
  Write("/sys/fs/cgroup/system.slice/worker.service/memory.max", "max\n");
  EXPECT_EQ(MemoryLimitUnder(root_), int64_t{16} << 30);
  Write("/sys/fs/cgroup/system.slice/memory.max", "8589934592\n");
  EXPECT_EQ(MemoryLimitUnder(root_), int64_t{8} << 30);
  Write("/sys/fs/cgroup/system.slice/worker.service/memory.max", "4294967296\n");
  EXPECT_EQ(MemoryLimitUnder(root_), int64_t{4} << 30);
  Write("/sys/fs/cgroup/memory.max", "1024\n");  // of a container, which sees itself as the root
  EXPECT_EQ(MemoryLimitUnder(root_), 1024);
}

TEST_F(MemoryLimitTest, KnowsGroupsOfVersion1) {
  Write("/proc/meminfo", kMachine);
  Write("/proc/self/cgroup", "9:cpu,cpuacct:/a\n7:memory:/docker/b\n0::/\n");
  Write("/sys/fs/cgroup/memory/docker/b/memory.limit_in_bytes", "2147483648\n");
  EXPECT_EQ(MemoryLimitUnder(root_), int64_t{2} << 30);
  Write("/sys/fs/cgroup/memory/docker/b/memory.limit_in_bytes", "9223372036854771712\n");
  EXPECT_EQ(MemoryLimitUnder(root_), int64_t{16} << 30);
}

TEST_F(MemoryLimitTest, IsZeroIfNothingIsKnown) { EXPECT_EQ(MemoryLimitUnder(root_), 0); }

TEST(MemoryForJobs, IsFourFifthsOfWhatThereIs) {
  EXPECT_GT(MemoryLimit(), 0);
  EXPECT_EQ(MemoryForJobs(), MemoryLimit() / 5 * 4);
}

TEST(FormatGibibytes, IsForPeople) {
  EXPECT_EQ(FormatGibibytes(int64_t{12} << 30), "12.0 GiB");
  EXPECT_EQ(FormatGibibytes(300 << 20), "300 MiB");
  EXPECT_EQ(FormatGibibytes(17), "17 bytes");
}

TEST(FormatSize, IsExactAndAsFlagsTakeIt) {
  EXPECT_EQ(FormatSize(int64_t{64} << 30), "64GiB");
  EXPECT_EQ(FormatSize((4 << 20) + 1024), "4097KiB");
  EXPECT_EQ(FormatSize(1025), "1025");
  EXPECT_EQ(FormatSize(0), "0");
}

}  // namespace
}  // namespace liquidblend::base
