// lb_capacity: what loads cost a server, beside what `liquidblend-admin plan` says they do.
#include <CLI/CLI.hpp>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "server/admin/plan.h"
#include "tests/bench/load_clients.h"
#include "tests/bench/load_family.h"
#include "tests/bench/load_report.h"
#include "tests/bench/load_server.h"
#include "tests/bench/process_usage.h"
#include "tests/bench/require.h"
#include "tests/core/store/store_testing.h"

namespace liquidblend::bench {
namespace {

struct Flags {
  std::string data;  // empty: one with a synthetic family for each of `vertices` is made
  std::string family = kLoadFamily;
  std::vector<int> vertices = {5000, 10'000, 20'000, 35'000, 50'000};
  std::vector<double> cached = {0.0, 0.5, 1.0};
  double frames_per_second = 60.0;  // of all clients
  int clients = 6;                  // even
  double warp = 10.0;
  double seconds = 20.0;
  double within = 0.2;
};

struct Measured {
  double busy_cores = 0.0;
  double frames_per_second = 0.0;
  double bytes_per_second = 0.0;
  double vertices = 0.0;  // of a frame, on average
  double resident_mb = 0.0;
  int64_t num_errors = 0;
};

// Clients of one kind that share a rate.
Group Callers(const LoadTarget& target, Frames frames, int count, double per_second) {
  return Repeat("", count, [=](int) {
    return [=](const std::stop_token& stop) {
      return CallFrames(target, {.frames = frames, .per_second = per_second / count}, stop);
    };
  });
}

// The load: of the frames, `cached` repeat, and the others are made.
std::vector<Group> MakeGroups(const LoadTarget& target, const Flags& flags, double cached) {
  std::vector<Group> groups;
  const double rate = flags.frames_per_second;
  const int half = std::max(1, flags.clients / 2);
  if (cached > 0) groups.push_back(Callers(target, Frames::kRepeated, half, rate * cached));
  if (cached < 1) groups.push_back(Callers(target, Frames::kDifferent, half, rate * (1 - cached)));
  return groups;
}

Measured Measure(const LoadServer& server, const LoadTarget& target, const Flags& flags,
                 double cached) {
  constexpr double kWarmUpS = 2.0;
  std::vector<Group> warm = MakeGroups(target, flags, cached);
  Run(warm, kWarmUpS);
  std::vector<Group> groups = MakeGroups(target, flags, cached);
  const ProcessUsage before = Require(UsageOf(server.pid()));
  const auto begin = std::chrono::steady_clock::now();
  Run(groups, flags.seconds);
  const double seconds =
      std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  const ProcessUsage after = Require(UsageOf(server.pid()));
  ClientReport all;
  for (const Group& group : groups) AddUp(group.report, all);
  const auto num_frames = static_cast<double>(all.latencies_ms.size());
  return {.busy_cores = (after.cpu_s - before.cpu_s) / seconds,
          .frames_per_second = num_frames / seconds,
          .bytes_per_second = static_cast<double>(all.num_bytes) / seconds,
          .vertices = static_cast<double>(all.num_vertices) / num_frames,
          .resident_mb = after.resident_mb,
          .num_errors = all.num_errors};
}

// One client that asks for as many frames as all did.
admin::Plan PlanFor(const Measured& measured, double cached) {
  return admin::MakePlan({.vertices = measured.vertices,
                          .clients = 1,
                          .frames_per_second = measured.frames_per_second,
                          .cached = cached});
}

// Prints a load's row; returns whether the plan is as near as `within`, and no call failed.
bool Print(const Measured& measured, double cached, double within) {
  const admin::Plan plan = PlanFor(measured, cached);
  const double core_ratio = plan.server_busy_cores / measured.busy_cores;
  const double network_ratio = plan.network_bytes_per_s / measured.bytes_per_second;
  std::printf("| %.0f | %.2f | %.1f | %.3f | %.3f | %.2f | %.2f | %.2f | %.2f | %.0f | %lld |\n",
              measured.vertices, cached, measured.frames_per_second, measured.busy_cores,
              plan.server_busy_cores, core_ratio, measured.bytes_per_second / 1e6,
              plan.network_bytes_per_s / 1e6, network_ratio, measured.resident_mb,
              static_cast<long long>(measured.num_errors));
  std::fflush(stdout);
  return std::abs(core_ratio - 1) <= within && std::abs(network_ratio - 1) <= within &&
         measured.num_errors == 0;
}

// Measures each share of cached frames on a server of its own; returns whether the plan is near.
bool RunOn(const std::string& data, const std::string& family, const Flags& flags) {
  const std::unique_ptr<LoadServer> server = Require(LoadServer::Start({.data = data}));
  const LoadTarget target = Require(server->Target(family));
  bool is_near = true;
  for (const double cached : flags.cached) {
    is_near &= Print(Measure(*server, target, flags, cached), cached, flags.within);
  }
  return is_near;
}

int RunAll(const Flags& flags) {
  std::printf(
      "| vertices | cached | frames/s | busy cores | planned | ratio | MB/s | planned "
      "| ratio | resident MB | errors |\n"
      "| --- | --- | --- | --- | --- | --- | --- | --- | --- | --- | --- |\n");
  std::fflush(stdout);
  if (!flags.data.empty()) return RunOn(flags.data, flags.family, flags) ? 0 : 1;
  bool is_near = true;
  for (const int vertices : flags.vertices) {
    const store::TemporaryFolder folder;
    Require(MakeLoadFamily(folder.path(), vertices, flags.warp));
    is_near &= RunOn(folder.path(), kLoadFamily, flags);
  }
  return is_near ? 0 : 1;
}

}  // namespace
}  // namespace liquidblend::bench

int main(int argc, char** argv) {
  CLI::App app("Measures what loads cost a server, and compares that with the plan");
  liquidblend::bench::Flags flags;
  app.add_option("--data", flags.data,
                 "Data directory with a registered family, in use by no server; default: synthetic "
                 "families of --vertices");
  app.add_option("--family", flags.family, "Of --data: its id")->capture_default_str();
  app.add_option("--vertices", flags.vertices, "Of a frame, a server each")->delimiter(',');
  app.add_option("--cached", flags.cached, "Shares of frames that repeat")->delimiter(',');
  app.add_option("--frames-per-second", flags.frames_per_second, "Of all clients")
      ->capture_default_str();
  app.add_option("--clients", flags.clients)->capture_default_str();
  app.add_option("--warp", flags.warp, "Shift of events between source and target, in frames")
      ->capture_default_str();
  app.add_option("--seconds", flags.seconds, "Of a load")->capture_default_str();
  app.add_option("--within", flags.within, "Exit with 1 if a ratio is further from 1")
      ->capture_default_str();
  CLI11_PARSE(app, argc, argv);
  return liquidblend::bench::RunAll(flags);
}
