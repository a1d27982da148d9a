// The fault table's disks: one that loses what was not flushed when the power goes, one that is
// full, one that fails, one that is read-only; the same of the folder that caches blobs of S3.
#include <signal.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <filesystem>

#include "absl/strings/str_cat.h"
#include "core/base/random_id.h"
#include "core/store/blobs/blob_store.h"
#include "tests/e2e/faults/fault_disk.h"
#include "tests/e2e/faults/faults_testing.h"

namespace liquidblend::e2e {
namespace {

struct Failure {
  const char* name;
  FaultyCall call;
  int error_number;
  bool of_server;
  Tier tier = Tier::kEmbedded;
};

class FaultsDiskTest : public FaultTest {
 protected:
  // Lets the work be done on a layer that does nothing, for the sake of its counts.
  void RunUndisturbed(FaultLayer& layer) {
    Process server = StartServer(0, layer.environment());
    Process worker = StartFaultWorker(layer.environment());
    EXPECT_TRUE(SubmitWork());
    EndRun(std::move(server), std::move(worker));
  }

  // Whoever is there when the power goes.
  static void AwaitEnd(Process& server, Process& worker) {
    Await([&] { return !IsAlive(server.pid()) || !IsAlive(worker.pid()); });
    EXPECT_EQ(server.Kill(), -SIGKILL);
    EXPECT_EQ(worker.Kill(), -SIGKILL);
  }

  // All of the work, with the power going off at one of its flushes: another one in each run, from
  // the first to the last.
  void LosePowerInEachRun(FaultLine& line, bool by_chance) {
    BeginRun(line, Tier::kEmbedded);
    FaultLayer& counting = MakeLayer(/*has_disk=*/true);
    RunUndisturbed(counting);
    const int64_t num_syncs = counting.control().num_syncs;
    EXPECT_GT(num_syncs, 20);
    line.Restart();
    const int num_runs = NumFaultRuns();
    for (int run = 1; run <= num_runs; ++run) {
      BeginRun(line, Tier::kEmbedded);
      FaultLayer& layer = MakeLayer(/*has_disk=*/true);
      const std::string disk = layer.disk();
      KeepTree(disk, data());
      layer.control().off_at_sync = std::max<int64_t>(1, num_syncs * run / (num_runs + 1));
      Process server = StartServer(0, layer.environment());
      Process worker = StartFaultWorker(layer.environment());
      SubmitWork();
      AwaitEnd(server, worker);
      LosePower(disk, data(), by_chance ? static_cast<uint32_t>(run) : 0);
      EndRun({}, {});
    }
  }

  // One run in which calls of a program from the first-th of this kind on fail, `count` of them.
  // Returns how many there were. If there were too few, the run does not count.
  int64_t FailCalls(const Failure& failure, int64_t first, int64_t count) {
    FaultLayer& layer = MakeLayer(/*has_disk=*/false);
    const std::vector<std::string> none, layered = layer.environment();
    Process server = StartServer(0, failure.of_server ? layered : none);
    if (failure.of_server) layer.FailCalls(failure.call, failure.error_number, first, count);
    SubmitWork();
    if (failure.of_server) layer.Heal();  // what was refused is asked for again
    if (!failure.of_server) layer.FailCalls(failure.call, failure.error_number, first, count);
    Process worker = StartFaultWorker(failure.of_server ? none : layered);
    EndRun(std::move(server), std::move(worker));
    const bool has_failed = layer.control().num_failed > 0;
    EXPECT_FALSE(has_failed && count == 0);
    // Work that is faster than it was when they were counted has fewer checkpoints.
    if (!has_failed && count > 0) line()->Miss();
    for (const std::string& error : errors()) EXPECT_THAT(error, testing::HasSubstr(data()));
    return layer.control().num_calls;
  }

  // Fails calls that are spread over the first two thirds of those that there are.
  void FailCallsInEachRun(FaultLine& line, const Failure& failure) {
    BeginRun(line, failure.tier);
    const int64_t num_calls = FailCalls(failure, 1, 0);
    // Some depend on how long the work takes.
    const int64_t num_certain = std::max<int64_t>(1, num_calls * 2 / 3);
    line.Restart();
    const int most_missed = line.num_missed + NumFaultRuns();
    while (line.num_runs < NumFaultRuns() && line.num_missed < most_missed) {
      BeginRun(line, failure.tier);
      const int run = line.num_runs;
      FailCalls(failure, 1 + (run - 1) * num_certain / NumFaultRuns(), 1 + run % 3);
    }
    EXPECT_EQ(line.num_runs, NumFaultRuns());
  }
};

TEST_F(FaultsDiskTest, APowerCutLosesNothing) {
  FaultLine line("power cut: all that was not flushed is gone", Tier::kEmbedded);
  LosePowerInEachRun(line, /*by_chance=*/false);
}

TEST_F(FaultsDiskTest, APowerCutThatLosesSomePagesLosesNothing) {
  FaultLine line("power cut: of names and pages that were not flushed, some are gone",
                 Tier::kEmbedded);
  LosePowerInEachRun(line, /*by_chance=*/true);
}

constexpr int kNumOldCopies = 64;
constexpr size_t kCopyBytes = size_t{1} << 18;

// The cache's disk is smaller than --cache-size, and full of copies that nobody has used for hours.
class FaultsFullCacheTest : public FaultsDiskTest, public testing::WithParamInterface<bool> {
 protected:
  // Fills the disk of this run.
  void FillCache(FaultLayer& layer) {
    namespace fs = std::filesystem;
    const auto hours_ago = fs::file_time_type::clock::now() - std::chrono::hours(3);
    for (int k = 0; k < kNumOldCopies; ++k) {
      const std::string copy =
          store::LocalBlobPath(blob_folder(), absl::StrCat("sha256-", base::RandomHex(32)));
      fs::create_directories(fs::path(copy).parent_path());
      store::WriteFile(copy, std::string(kCopyBytes, 'x'));
      fs::last_write_time(copy, hours_ago);
    }
    int64_t used_bytes = 0;
    for (const auto& entry : fs::recursive_directory_iterator(data())) {
      if (entry.is_regular_file()) used_bytes += static_cast<int64_t>(entry.file_size());
    }
    layer.control().disk_bytes = used_bytes;
  }
};

TEST_P(FaultsFullCacheTest, LosesNoAttempt) {
  const bool of_server = GetParam();
  FaultLine line(absl::StrCat("the ", of_server ? "server's" : "worker's",
                              " cache of S3 is on a disk that is full of old copies"),
                 Tier::kShared);
  for (int run = 1; run <= NumFaultRuns(); ++run) {
    BeginRun(line, Tier::kShared);
    FaultLayer& layer = MakeLayer(/*has_disk=*/false);
    const std::vector<std::string> none, layered = layer.environment();
    Process server = StartServer(0, of_server ? layered : none);
    if (of_server) FillCache(layer);
    EXPECT_TRUE(SubmitWork());
    if (!of_server) FillCache(layer);
    EndRun(std::move(server), StartFaultWorker(of_server ? none : layered));
    EXPECT_GT(layer.control().num_failed, 0);
  }
  EXPECT_EQ(line.num_retried, 0);
}

INSTANTIATE_TEST_SUITE_P(Cache, FaultsFullCacheTest, testing::Bool(),
                         [](const testing::TestParamInfo<bool>& of_server) {
                           return std::string(of_server.param ? "server" : "worker");
                         });

std::vector<Failure> AllFailures() {
  std::vector<Failure> failures;
  for (const bool of_server : {false, true}) {
    for (const int error : {ENOSPC, EIO, EROFS}) {
      failures.push_back({"write", FaultyCall::kWrite, error, of_server});
      failures.push_back({"flush", FaultyCall::kSync, error, of_server});
      failures.push_back({"rename", FaultyCall::kRename, error, of_server});
      failures.push_back({"create", FaultyCall::kCreate, error, of_server});
    }
  }
  return failures;
}

// The cache of the shared tier is never flushed.
std::vector<Failure> CacheFailures() {
  std::vector<Failure> failures;
  for (const bool of_server : {false, true}) {
    failures.push_back({"write", FaultyCall::kWrite, EROFS, of_server, Tier::kShared});
    for (const int error : {EROFS, EACCES}) {
      failures.push_back({"rename", FaultyCall::kRename, error, of_server, Tier::kShared});
      failures.push_back({"create", FaultyCall::kCreate, error, of_server, Tier::kShared});
    }
  }
  return failures;
}

const char* ErrorName(int error_number) {
  if (error_number == EROFS) return "EROFS";
  if (error_number == EACCES) return "EACCES";
  return error_number == EIO ? "EIO" : "ENOSPC";
}

std::string NameOf(const testing::TestParamInfo<Failure>& failure) {
  return absl::StrCat(failure.param.of_server ? "server_" : "worker_",
                      ErrorName(failure.param.error_number), "_", failure.param.name);
}

class FaultsDiskErrorTest : public FaultsDiskTest, public testing::WithParamInterface<Failure> {};

TEST_P(FaultsDiskErrorTest, LosesNothing) {
  const Failure& failure = GetParam();
  FaultLine line(absl::StrCat(ErrorName(failure.error_number), " of the ",
                              failure.of_server ? "server's" : "worker's", " Nth ", failure.name,
                              failure.tier == Tier::kShared ? " in the cache of S3" : ""),
                 failure.tier);
  FailCallsInEachRun(line, failure);
}

INSTANTIATE_TEST_SUITE_P(Calls, FaultsDiskErrorTest, testing::ValuesIn(AllFailures()), NameOf);
INSTANTIATE_TEST_SUITE_P(Cache, FaultsDiskErrorTest, testing::ValuesIn(CacheFailures()), NameOf);

}  // namespace
}  // namespace liquidblend::e2e
