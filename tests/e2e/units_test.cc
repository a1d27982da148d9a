// The programs as the units of deploy/systemd start them: with the units' variables and flags, and
// with what an operator adds to server.env and worker.env.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/stat.h>
#include <unistd.h>

#include <chrono>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <map>
#include <string>
#include <thread>
#include <vector>

#include "absl/strings/ascii.h"
#include "absl/strings/match.h"
#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_split.h"
#include "core/base/cores.h"
#include "core/base/exit_status.h"
#include "core/store/data_directory.h"
#include "tests/core/store/store_testing.h"
#include "tests/e2e/process.h"
#include "tests/paths.h"

namespace liquidblend::e2e {
namespace {

using ::testing::StartsWith;

using Variables = std::map<std::string, std::string>;

std::vector<std::string> LinesOf(const std::string& file) {
  std::ifstream input(paths::Source("deploy/systemd/" + file));
  EXPECT_TRUE(input.is_open()) << file;
  std::vector<std::string> lines;
  for (std::string line; std::getline(input, line);) lines.push_back(line);
  return lines;
}

void Set(const std::string& assignment, Variables& variables) {
  const std::vector<std::string> parts = absl::StrSplit(assignment, absl::MaxSplits('=', 1));
  ASSERT_EQ(parts.size(), 2u) << assignment;
  variables[parts[0]] = parts[1];
}

// A service, as systemd would start it.
struct Unit {
  Variables variables;
  std::vector<std::string> flags;

  explicit Unit(const std::string& file) {
    constexpr char kEnvironment[] = "Environment=", kStart[] = "ExecStart=";
    for (const std::string& line : LinesOf(file)) {
      if (absl::StartsWith(line, kEnvironment)) Set(line.substr(strlen(kEnvironment)), variables);
      if (absl::StartsWith(line, kStart)) flags = absl::StrSplit(line, ' ');
    }
    EXPECT_GE(flags.size(), 2u);
    EXPECT_EQ(flags.back(), "$ARGUMENTS");
    flags.pop_back();
    flags.erase(flags.begin());
  }

  Process Start(const std::string& program) {
    std::vector<std::string> all = flags, environment;
    for (const auto& [name, value] : variables) {
      environment.push_back(absl::StrCat(name, "=", value));
    }
    for (const auto& word : absl::StrSplit(variables["ARGUMENTS"], ' ', absl::SkipEmpty())) {
      all.emplace_back(word);
    }
    return Process(program, all, environment);
  }
};

class UnitsTest : public ::testing::Test {
 protected:
  std::string path(const std::string& name) const { return folder_.path() + "/" + name; }

  // The unit's own, but for places and ports that other tests need.
  Unit ServerUnit() const {
    Unit unit("liquidblend-server.service");
    EXPECT_EQ(unit.variables["LIQUIDBLEND_DATA"], "/var/lib/liquidblend");
    unit.variables["LIQUIDBLEND_DATA"] = path("data");
    EXPECT_EQ(unit.variables["LIQUIDBLEND_HTTP"], "127.0.0.1:8080");
    unit.variables["LIQUIDBLEND_HTTP"] = "127.0.0.1:0";
    return unit;
  }

  static void AwaitWorkers(const Process& server, size_t count) {
    const auto end = std::chrono::steady_clock::now() + Patience();
    while (ChildrenOf(server.pid()).size() < count) {
      ASSERT_LT(std::chrono::steady_clock::now(), end);
      std::this_thread::sleep_for(std::chrono::milliseconds(10));
    }
  }

  const store::TemporaryFolder folder_;
};

TEST_F(UnitsTest, AFlagOfServerEnvLeavesTheOtherOnesAsTheyAre) {
  Unit unit = ServerUnit();
  unit.variables["ARGUMENTS"] = "--listen 127.0.0.1:0 --max-upload 1GiB";
  Process server = unit.Start("liquidblend-server");
  EXPECT_THAT(server.ReadLine(), StartsWith("listening on 127.0.0.1:"));
  EXPECT_THAT(server.ReadLine(), StartsWith("http on 127.0.0.1:"));
  EXPECT_TRUE(std::filesystem::exists(store::CatalogPath(path("data"))));
  AwaitWorkers(server, 2);
  server.Signal(SIGTERM);
  EXPECT_EQ(server.Wait(), 0);

  unit.variables["ARGUMENTS"] = "--listen 127.0.0.1:0 --workers 0";
  unit.variables["LIQUIDBLEND_HTTP"] = "";
  Process other = unit.Start("liquidblend-server");
  EXPECT_THAT(other.ReadLine(), StartsWith("listening on 127.0.0.1:"));
  EXPECT_THAT(ChildrenOf(other.pid()), ::testing::IsEmpty());
  other.Signal(SIGTERM);
  EXPECT_EQ(other.ReadLine(), "") << "no HTTP port";
  EXPECT_EQ(other.Wait(), 0);
}

// What follows --threads in the arguments of a process; -1 if it is not there, as before it has
// become another program.
int ThreadsOf(pid_t pid) {
  std::ifstream file(absl::StrCat("/proc/", pid, "/cmdline"), std::ios::binary);
  const std::string text((std::istreambuf_iterator<char>(file)), {});
  const std::vector<std::string> words = absl::StrSplit(text, '\0');
  for (size_t i = 0; i + 1 < words.size(); ++i) {
    int threads = 0;
    if (words[i] == "--threads" && absl::SimpleAtoi(words[i + 1], &threads)) return threads;
  }
  return -1;
}

TEST_F(UnitsTest, WorkersOfAServerShareTheCoresWithThoseBesideIt) {
  struct Case {
    std::string workers, shared_by, arguments;
    int threads;
  };
  const Case cases[] = {{"1", "0", "", base::ShareOfCores(base::NumCores(), 1)},
                        {"2", "0", "", base::ShareOfCores(base::NumCores(), 2)},
                        {"1", "2", "", base::ShareOfCores(base::NumCores(), 2)},
                        {"2", "1024", "", 1},
                        {"1", "1024", " --worker-threads 3", 3}};
  for (const Case& one : cases) {
    Unit unit = ServerUnit();
    unit.variables["LIQUIDBLEND_WORKERS"] = one.workers;
    unit.variables["LIQUIDBLEND_CORES_SHARED_BY"] = one.shared_by;
    unit.variables["ARGUMENTS"] = "--listen 127.0.0.1:0" + one.arguments;
    Process server = unit.Start("liquidblend-server");
    EXPECT_THAT(server.ReadLine(), StartsWith("listening on "));
    AwaitWorkers(server, one.workers == "1" ? 1 : 2);
    for (const pid_t worker : ChildrenOf(server.pid())) {
      const auto end = std::chrono::steady_clock::now() + Patience();
      while (ThreadsOf(worker) < 0 && std::chrono::steady_clock::now() < end) {
        std::this_thread::yield();
      }
      EXPECT_EQ(ThreadsOf(worker), one.threads) << one.workers << " " << one.shared_by;
    }
    server.Signal(SIGTERM);
    EXPECT_EQ(server.Wait(), 0);
  }
}

// Its log says how many threads it has.
TEST_F(UnitsTest, AWorkerTakesItsShareOfTheCores) {
  const auto threads = [&](const std::string& flags) {
    const std::string log = path("log");
    const std::string command =
        absl::StrCat("'", paths::Program("liquidblend-worker"), "' --once --data '", path("data"),
                     "' ", flags, " 2>'", log, "'");
    EXPECT_EQ(std::system(command.c_str()), 0) << flags;
    std::ifstream file(log);
    const std::string text((std::istreambuf_iterator<char>(file)), {});
    const size_t begin = text.find(" with ") + 6;
    return text.substr(begin, text.find(" threads", begin) - begin);
  };
  EXPECT_EQ(threads(""), absl::StrCat(base::NumCores()));
  EXPECT_EQ(threads("--cores-shared-by 2"), absl::StrCat(base::ShareOfCores(base::NumCores(), 2)));
  EXPECT_EQ(threads("--cores-shared-by 1024"), "1");
  EXPECT_EQ(threads("--cores-shared-by 1024 --threads 3"), "3");
}

TEST_F(UnitsTest, AWorkerOnTheServersMachineFindsItsDirectory) {
  Unit server_unit = ServerUnit();
  server_unit.variables["ARGUMENTS"] = "--listen 127.0.0.1:0 --workers 0";
  Process server = server_unit.Start("liquidblend-server");
  EXPECT_THAT(server.ReadLine(), StartsWith("listening on "));
  Unit unit("liquidblend-worker@.service");
  EXPECT_EQ(unit.variables["LIQUIDBLEND_DATA"], "/var/lib/liquidblend");
  unit.variables["LIQUIDBLEND_DATA"] = path("data");
  EXPECT_GT(unit.variables.count("LIQUIDBLEND_CACHE"), 0u);
  EXPECT_EQ(unit.variables["LIQUIDBLEND_CORES_SHARED_BY"], "2");
  for (const char* arguments : {"--check", "--once --memory 1GiB"}) {
    unit.variables["ARGUMENTS"] = arguments;
    EXPECT_EQ(unit.Start("liquidblend-worker").Wait(), 0) << arguments;
  }
}

// A value that is no size is refused.
TEST_F(UnitsTest, TheSizeOfTheCacheMayBeAVariable) {
  const auto status = [&](Unit unit, const std::string& program, const std::string& size) {
    unit.variables["LIQUIDBLEND_DATA"] = path("data");
    unit.variables["LIQUIDBLEND_CACHE_SIZE"] = size;
    unit.variables["ARGUMENTS"] = "--check";
    return unit.Start(program).Wait();
  };
  for (const std::string program : {"liquidblend-server", "liquidblend-worker"}) {
    const Unit unit(program + (program == "liquidblend-server" ? ".service" : "@.service"));
    EXPECT_EQ(status(unit, program, "large"), base::kExitUsage) << program;
    EXPECT_NE(status(unit, program, "1GiB"), base::kExitUsage) << program;
  }
}

// What install.sh puts below DESTDIR: the group of the services may enter /etc/liquidblend, so that
// they reach the files that flags name there; the samples, which may hold passwords, stay root's.
TEST_F(UnitsTest, TheServicesMayReadWhatTheirFlagsName) {
  if (geteuid() != 0) GTEST_SKIP() << "only root gives files to a group";
  constexpr gid_t kGroup = 4711;
  const std::string root = path("root");
  std::filesystem::create_directories(root + "/etc");
  std::ofstream(root + "/etc/group") << "root:x:0:\nliquidblend:x:" << kGroup << ":\n";
  const std::string programs =
      std::filesystem::path(paths::Program("liquidblend-server")).parent_path();
  const std::string install = absl::StrCat(
      "DESTDIR='", root, "' '", paths::Source("deploy/systemd/install.sh"), "' '", programs, "'");
  ASSERT_EQ(std::system(install.c_str()), 0);
  struct stat info = {};
  ASSERT_EQ(stat((root + "/etc/liquidblend").c_str(), &info), 0);
  EXPECT_EQ(info.st_mode & 07777, 0750u);
  EXPECT_EQ(info.st_uid, 0u);
  EXPECT_EQ(info.st_gid, kGroup);
  for (const char* sample : {"server.env", "worker.env"}) {
    ASSERT_EQ(stat((root + "/etc/liquidblend/" + sample).c_str(), &info), 0) << sample;
    EXPECT_EQ(info.st_mode & 07777, 0640u) << sample;
    EXPECT_EQ(info.st_gid, 0u) << sample;
  }
}

// Every line of a sample is a comment or a variable that is commented out.
TEST_F(UnitsTest, SamplesChangeNothingUntilTheyAreEdited) {
  for (const char* sample : {"server.env", "worker.env"}) {
    int num_variables = 0;
    for (const std::string& line : LinesOf(sample)) {
      EXPECT_TRUE(line.empty() || line[0] == '#') << sample << ": " << line;
      num_variables += line.size() > 1 && absl::ascii_isupper(static_cast<unsigned char>(line[1]));
    }
    EXPECT_GT(num_variables, 5) << sample;
  }
}

}  // namespace
}  // namespace liquidblend::e2e
