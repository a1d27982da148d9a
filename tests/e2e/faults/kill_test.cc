// The fault table's kills: programs at every named point, PostgreSQL in the middle of a job and of
// a commit.
#include <signal.h>

#include <filesystem>
#include <fstream>
#include <regex>
#include <set>

#include "absl/strings/str_cat.h"
#include "tests/e2e/faults/faults_testing.h"
#include "tests/paths.h"

namespace liquidblend::e2e {
namespace {

struct KillPoint {
  const char* name;
  bool in_server;       // the server comes here, too
  bool in_shared_only;  // no data directory is
  int num_passes;       // at least, of a worker with SubmitWork(), or of a server in it
};

// Every place of the sources that has a name (core/base/fault_point.h).
constexpr KillPoint kPoints[] = {
    {"blob.append", true, false, 3},
    {"blob.before_sync", true, false, 3},
    {"blob.before_rename", true, false, 3},
    {"blob.after_rename", true, false, 3},
    {"blob.committed", true, false, 3},
    {"blob.before_upload", true, true, 3},
    {"blob.after_upload", true, true, 3},
    {"catalog.before_commit", true, false, 2},
    {"catalog.after_commit", true, false, 2},
    {"checkpoint.before_write", false, false, 1},
    {"checkpoint.after_write", false, false, 1},
    {"checkpoint.before_commit", false, false, 1},
    {"checkpoint.after_commit", false, false, 1},
    {"publish.before_commit", false, false, 2},
    {"publish.after_commit", false, false, 2},
};

TEST(FaultPoints, AreAllInTheTable) {
  std::set<std::string> in_sources, in_table;
  const std::regex call("FaultPoint\\(\"([^\"]+)\"\\)");
  for (const char* folder : {"core", "worker", "server"}) {
    for (const auto& file : std::filesystem::recursive_directory_iterator(paths::Source(folder))) {
      if (file.path().extension() != ".cc") continue;
      const std::string text = store::ReadFile(file.path());
      for (std::sregex_iterator match(text.begin(), text.end(), call), end; match != end; ++match) {
        in_sources.insert((*match)[1]);
      }
    }
  }
  for (const KillPoint& point : kPoints) in_table.insert(point.name);
  EXPECT_EQ(in_sources, in_table);
}

struct Kill {
  KillPoint point;
  bool of_server;
  Tier tier;
};

std::vector<Kill> AllKills() {
  std::vector<Kill> kills;
  for (const KillPoint& point : kPoints) {
    for (const Tier tier : {Tier::kEmbedded, Tier::kShared}) {
      if (point.in_shared_only && tier == Tier::kEmbedded) continue;
      kills.push_back({point, false, tier});
      if (point.in_server) kills.push_back({point, true, tier});
    }
  }
  return kills;
}

std::string NameOf(const testing::TestParamInfo<Kill>& kill) {
  std::string name = absl::StrCat(kill.param.of_server ? "server_" : "worker_",
                                  kill.param.tier == Tier::kShared ? "shared_" : "embedded_",
                                  kill.param.point.name);
  for (char& c : name) c = c == '.' ? '_' : c;
  return name;
}

class FaultsKillTest : public FaultTest, public testing::WithParamInterface<Kill> {
 protected:
  // Dies at another pass in each run.
  static std::vector<std::string> DieInRun(const KillPoint& point, int run) {
    const int pass = 1 + (run - 1) % point.num_passes;
    return {absl::StrCat("LIQUIDBLEND_FAULT_POINT=", point.name, "#", pass)};
  }

  void KillWorker(const std::vector<std::string>& environment) {
    Process server = StartServer();
    EXPECT_TRUE(SubmitWork());
    Process worker = StartFaultWorker(environment);
    // A job that is fast may be done before its first checkpoint is recorded.
    if (AwaitDeath(worker)) {
      EXPECT_EQ(worker.Wait(), -SIGKILL);
    } else {
      line()->Miss();
    }
    EndRun(std::move(server), std::move(worker));
  }

  void KillServer(const std::vector<std::string>& environment) {
    Process server = StartServer(0, environment);
    EXPECT_FALSE(SubmitWork());
    EXPECT_EQ(server.Wait(), -SIGKILL);
    EndRun({}, {});
  }
};

TEST_P(FaultsKillTest, LosesNothing) {
  const auto& [point, of_server, tier] = GetParam();
  FaultLine line(
      absl::StrCat("`kill -9` of the ", of_server ? "server" : "worker", " at `", point.name, "`"),
      tier);
  const int most_missed = 3 + NumFaultRuns();
  while (line.num_runs < NumFaultRuns() && line.num_missed < most_missed) {
    BeginRun(line, tier);
    const std::vector<std::string> environment = DieInRun(point, line.num_runs);
    of_server ? KillServer(environment) : KillWorker(environment);
  }
  EXPECT_EQ(line.num_runs, NumFaultRuns());
}

INSTANTIATE_TEST_SUITE_P(Points, FaultsKillTest, testing::ValuesIn(AllKills()), NameOf);

}  // namespace
}  // namespace liquidblend::e2e
