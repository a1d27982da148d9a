// A player of frames, in a loop at the pace of a screen. Prints a row a phase: weights that change
// every frame, a steady course, backwards across the seam of a loop, and a server that stands still
// for a while. How long a poll takes, and what sets the course before it, is counted apart from the
// rest.
#include <signal.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <functional>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "client/player/player.h"
#include "client/player/server_source.h"
#include "core/base/status_macros.h"
#include "tests/bench/load_family.h"
#include "tests/bench/load_server.h"
#include "tests/core/store/store_testing.h"

namespace liquidblend::bench {
namespace {

using Clock = std::chrono::steady_clock;
using player::Player;

struct Flags {
  double seconds = 20.0;
  int vertices = 50'000;
  double frames_per_second = 60.0;
  double stop_s = 0.4;
  int threads = 2;
};

std::atomic<int64_t> num_allocations = 0;

player::PlayerOptions OptionsOf(const Flags& flags) {
  player::PlayerOptions options;
  options.schedule.frames_per_second = flags.frames_per_second;
  options.adapts_detail = false;
  options.allocator.allocate = [](void*, size_t num_bytes) {
    ++num_allocations;
    return std::malloc(num_bytes);
  };
  return options;
}

double SecondsOf(Clock::duration duration) {
  return std::chrono::duration<double>(duration).count();
}

struct Phase {
  std::string name;
  double seconds = 0.0;
  std::function<void(Player&, int64_t frame)> before_poll;
};

// Plays for the phase's time; returns how long each poll took, microseconds.
std::vector<double> Play(const Flags& flags, const Phase& phase, Clock::time_point start,
                         Player& player) {
  std::vector<double> polls_us;
  const auto num_frames = static_cast<int64_t>(phase.seconds * flags.frames_per_second);
  const Clock::time_point begin = Clock::now();
  for (int64_t frame = 0; frame < num_frames; ++frame) {
    std::this_thread::sleep_until(
        begin + std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(
                    static_cast<double>(frame) / flags.frames_per_second)));
    const Clock::time_point before = Clock::now();
    phase.before_poll(player, frame);
    const player::PolledFrame polled = player.Poll(SecondsOf(before - start));
    polls_us.push_back(1e6 * SecondsOf(Clock::now() - before));
  }
  std::sort(polls_us.begin(), polls_us.end());
  return polls_us;
}

void PrintPhase(const Phase& phase, const std::vector<double>& polls_us,
                const player::PlayerStatistics& before, const player::PlayerStatistics& after,
                int64_t allocations) {
  const auto percentile = [&](double share) {
    return polls_us[static_cast<size_t>(share * static_cast<double>(polls_us.size() - 1))];
  };
  const auto num_received = static_cast<double>(after.num_received - before.num_received);
  std::printf("| %s | %.0f | %ld | %ld | %ld | %.0f | %.1f | %.1f | %.1f | %.1f, %.1f | %ld |\n",
              phase.name.c_str(), phase.seconds, after.counts.num_shown - before.counts.num_shown,
              after.counts.num_missed - before.counts.num_missed,
              after.counts.num_stale - before.counts.num_stale, num_received, percentile(0.5),
              percentile(0.99), polls_us.back(),
              1e3 * (after.wait_s - before.wait_s) / num_received,
              1e3 * (after.decode_s - before.decode_s) / num_received, allocations);
}

player::BlendSpec Weight(double weight) {
  player::BlendSpec blend;
  blend.weights = {weight};
  return blend;
}

std::vector<Phase> PhasesOf(const Flags& flags, pid_t server) {
  const auto wave = [&flags](Player& player, int64_t frame) {
    const double time_s = static_cast<double>(frame) / flags.frames_per_second;
    player.SetBlend(Weight(0.5 + 0.5 * std::sin(time_s)), 0.0);
  };
  const auto steady = [](Player&, int64_t) {};
  const auto backwards = [](Player& player, int64_t frame) {
    if (frame == 0) player.SetRate(-1.0);
  };
  // Half-way, on a thread of its own: the loop goes on.
  const auto stop = [&flags, server](Player& player, int64_t frame) {
    if (frame == 0) player.SetRate(1.0);
    if (frame != static_cast<int64_t>(flags.seconds * flags.frames_per_second / 4)) return;
    std::thread([server, seconds = flags.stop_s] {
      kill(server, SIGSTOP);
      std::this_thread::sleep_for(std::chrono::duration<double>(seconds));
      kill(server, SIGCONT);
    }).detach();
  };
  return {{"warm up", flags.seconds, wave},
          {"weights change every frame", flags.seconds, wave},
          {"steady", flags.seconds, steady},
          {"backwards, in a loop", flags.seconds, backwards},
          {"the server stands still in between", flags.seconds / 2, stop}};
}

absl::Status Run(const Flags& flags) {
  const store::TemporaryFolder folder;
  LB_RETURN_IF_ERROR(MakeLoadFamily(folder.path(), flags.vertices, 4.0).status());
  LB_ASSIGN_OR_RETURN(const std::unique_ptr<LoadServer> server,
                      LoadServer::Start({.data = folder.path(), .num_threads = flags.threads}));
  LB_ASSIGN_OR_RETURN(const LoadTarget target, server->Target(kLoadFamily));
  ConnectOptions connect;
  connect.target = target.address;
  LB_ASSIGN_OR_RETURN(auto source, player::ServerSource::Open(connect, kLoadFamily, 0));
  Player player(std::move(source), OptionsOf(flags));
  player.SetLoop(true);
  player.SetPlaying(true);
  std::printf(
      "| phase | s | shown | missed | stale | got | poll p50 (us) | p99 | most | wait, decode "
      "(ms) | allocations |\n| --- | --- | --- | --- | --- | --- | --- | --- | --- | --- | "
      "--- |\n");
  const Clock::time_point start = Clock::now();
  for (const Phase& phase : PhasesOf(flags, server->pid())) {
    const player::PlayerStatistics before = player.statistics();
    const int64_t allocated = num_allocations;
    const std::vector<double> polls_us = Play(flags, phase, start, player);
    PrintPhase(phase, polls_us, before, player.statistics(), num_allocations - allocated);
  }
  return absl::OkStatus();
}

void AddFlags(CLI::App& app, Flags& flags) {
  app.add_option("--seconds", flags.seconds, "Of a phase")->capture_default_str();
  app.add_option("--vertices", flags.vertices, "Of a frame, on average")->capture_default_str();
  app.add_option("--fps", flags.frames_per_second, "Of the screen")->capture_default_str();
  app.add_option("--stop", flags.stop_s, "How long the server stands still, seconds")
      ->capture_default_str();
  app.add_option("--threads", flags.threads, "Of the server, for frames")->capture_default_str();
}

}  // namespace
}  // namespace liquidblend::bench

int main(int argc, char** argv) {
  CLI::App app("A player of a server's frames, in a loop at the pace of a screen.");
  liquidblend::bench::Flags flags;
  liquidblend::bench::AddFlags(app, flags);
  CLI11_PARSE(app, argc, argv);
  const absl::Status status = liquidblend::bench::Run(flags);
  if (status.ok()) return 0;
  std::fprintf(stderr, "lb_play: %s\n", std::string(status.message()).c_str());
  return 1;
}
