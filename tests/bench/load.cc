// lb_load: the server's program under loads of several kinds, and what its clients see of it.
#include <CLI/CLI.hpp>
#include <cstdio>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/synchronization/mutex.h"
#include "core/base/status_macros.h"
#include "tests/bench/load_clients.h"
#include "tests/bench/load_family.h"
#include "tests/bench/load_report.h"
#include "tests/bench/load_server.h"
#include "tests/bench/load_stages.h"
#include "tests/bench/machine_stops.h"
#include "tests/bench/memory_slope.h"
#include "tests/core/store/store_testing.h"

namespace liquidblend::bench {
namespace {

struct Flags {
  std::string data;  // empty: one with a synthetic family is made
  std::string family = kLoadFamily;
  int vertices = 50'000;
  double warp = 10.0;
  int threads = 2;
  double frame_cache_mb = 256.0;
  double seconds = 5.0;
  double frames_per_second = 60.0;
  std::vector<int> callers = {1, 4, 16};
  std::vector<int> streams = {1, 4};
  double mixed_seconds = 60.0;
  bool stages = true;
  bool mixed = true;
};

Group Callers(const LoadTarget& target, Frames frames, int count, double per_second = 0.0) {
  const bool is_cached = frames == Frames::kRepeated;
  return Repeat(is_cached ? "calls, cached" : "calls, uncached", count, [=](int) {
    return [=](const std::stop_token& stop) {
      return CallFrames(target, {.frames = frames, .per_second = per_second}, stop);
    };
  });
}

Group Streams(const LoadTarget& target, double fps, int count) {
  return Repeat(absl::StrCat("streams, ", fps, " frames/s, new weights each"), count, [=](int) {
    return [=](const std::stop_token& stop) { return WatchStream(target, fps, stop); };
  });
}

void RunAndPrint(std::vector<Group> groups, double seconds) {
  MachineStops stops;
  Run(groups, seconds);
  const std::vector<Interval>& found = stops.Stop();
  for (Group& group : groups) Print(group, seconds);
  PrintStops(found, groups);
  static bool is_said = false;
  if (!stops.is_known() && !std::exchange(is_said, true)) {
    std::fprintf(stderr,
                 "lb_load: without the right to SCHED_FIFO, whether the machine stands "
                 "still is not known\n");
  }
}

// 32 clients of all kinds; what the good ones see without the bad ones comes first. These keep a
// pace, as players and tools do, that leaves the machine some time.
void RunMixed(const LoadServer& server, const LoadTarget& target, const Flags& flags) {
  const auto good = [&] {
    return std::vector<Group>{Callers(target, Frames::kDifferent, 8, 4.0),
                              Callers(target, Frames::kRepeated, 8, 20.0), Streams(target, 24, 2)};
  };
  const auto slow = Repeat("streams that are read slowly", 6, [=](int) {
    return [=](const std::stop_token& stop) { return WatchSlowly(target, stop); };
  });
  const auto vanishing = Repeat("vanishing clients", 4, [=](int k) {
    return [=](const std::stop_token& stop) { return Vanish(target, k, stop); };
  });
  const auto garbage = Repeat("garbage", 4, [=](int k) {
    return [=](const std::stop_token& stop) { return SendGarbage(target, k, stop); };
  });
  PrintTitle("good clients alone");
  RunAndPrint(good(), flags.mixed_seconds / 10);
  PrintTitle("the same with slow ones");
  std::vector<Group> groups = good();
  groups.push_back(slow);
  RunAndPrint(groups, flags.mixed_seconds / 10);
  PrintTitle("the same with all bad ones");
  groups = good();
  groups.insert(groups.end(), {slow, vanishing, garbage});
  MemorySlope memory(server);
  RunAndPrint(std::move(groups), flags.mixed_seconds);
  memory.Print();
}

absl::Status RunAll(const Flags& flags) {
  const store::TemporaryFolder folder;
  if (flags.data.empty()) {
    LB_ASSIGN_OR_RETURN(const int source_vertices,
                        MakeLoadFamily(folder.path(), flags.vertices, flags.warp));
    std::printf("Frames of %d vertices on average (%d in the source's), time warp of %.0f frames; ",
                flags.vertices, source_vertices, flags.warp);
  }
  LB_ASSIGN_OR_RETURN(const std::unique_ptr<LoadServer> server,
                      LoadServer::Start({.data = flags.data.empty() ? folder.path() : flags.data,
                                         .num_threads = flags.threads,
                                         .frame_cache_mb = flags.frame_cache_mb}));
  LB_ASSIGN_OR_RETURN(const LoadTarget target, server->Target(flags.family));
  std::printf("'%s', %d threads, %.0f s each\n", target.family.c_str(), flags.threads,
              flags.seconds);
  std::vector<Group> warm_up = {Callers(target, Frames::kRepeated, 2)};
  Run(warm_up, 1.0);
  if (flags.stages) LB_RETURN_IF_ERROR(PrintStages(*server, target, flags.seconds));
  PrintHeader();
  for (const Frames frames : {Frames::kDifferent, Frames::kRepeated}) {
    for (const int count : flags.callers) {
      RunAndPrint({Callers(target, frames, count)}, flags.seconds);
    }
  }
  for (const int count : flags.streams) {
    RunAndPrint({Streams(target, flags.frames_per_second, count)}, flags.seconds);
  }
  if (flags.mixed) RunMixed(*server, target, flags);
  return absl::OkStatus();
}

}  // namespace
}  // namespace liquidblend::bench

int main(int argc, char** argv) {
  CLI::App app("Puts a server under load; its log goes to standard error");
  liquidblend::bench::Flags flags;
  app.add_option("--data", flags.data,
                 "Data directory with a registered family, in use by no server; default: one with "
                 "a synthetic family, for as long as this runs");
  app.add_option("--family", flags.family, "Of --data: its id")->capture_default_str();
  app.add_option("--vertices", flags.vertices, "Of a frame, on average")->capture_default_str();
  app.add_option("--warp", flags.warp, "Largest time warp at weight 1, frames")
      ->capture_default_str();
  app.add_option("--threads", flags.threads, "Of the server, for frames")->capture_default_str();
  app.add_option("--frame-cache", flags.frame_cache_mb,
                 "Of the server, MB; memory grows until it is full")
      ->capture_default_str();
  app.add_option("--seconds", flags.seconds, "Of each load")->capture_default_str();
  app.add_option("--frames-per-second", flags.frames_per_second, "Of streams")
      ->capture_default_str();
  app.add_option("--callers", flags.callers, "Numbers of clients that call")->delimiter(',');
  app.add_option("--streams", flags.streams, "Numbers of streams")->delimiter(',');
  app.add_option("--stages", flags.stages, "Whether to print where the time of a call goes")
      ->capture_default_str();
  app.add_option("--mixed-seconds", flags.mixed_seconds,
                 "Of the mixed load with all clients; a tenth without the bad ones")
      ->capture_default_str();
  app.add_option("--mixed", flags.mixed, "Whether to run the mixed load")->capture_default_str();
  CLI11_PARSE(app, argc, argv);
  // As the server does: clients share its machine.
  absl::SetMutexDeadlockDetectionMode(absl::OnDeadlockCycle::kIgnore);
  const absl::Status status = liquidblend::bench::RunAll(flags);
  if (status.ok()) return 0;
  std::fprintf(stderr, "lb_load: %s\n", status.ToString().c_str());
  return 1;
}
