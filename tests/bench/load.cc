// lb_load: a server in this process under loads of several kinds, and what its clients see of it.
#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdio>
#include <functional>
#include <string>
#include <thread>
#include <vector>

#include "absl/strings/str_cat.h"
#include "core/base/log.h"
#include "tests/bench/load_clients.h"
#include "tests/bench/load_server.h"

namespace liquidblend::bench {
namespace {

struct Flags {
  int vertices = 50'000;
  double warp = 10.0;
  int threads = 2;
  double seconds = 5.0;
  double frames_per_second = 60.0;
  std::vector<int> callers = {1, 4, 16};
  std::vector<int> streams = {1, 4};
  bool mixed = true;
};

using Client = std::function<ClientReport(const std::stop_token&)>;

// A group of clients of one kind; what its members saw, together.
struct Group {
  std::string name;
  std::vector<Client> clients;
  ClientReport report;
};

void AddUp(const ClientReport& one, ClientReport& all) {
  all.latencies_ms.insert(all.latencies_ms.end(), one.latencies_ms.begin(), one.latencies_ms.end());
  all.num_errors += one.num_errors;
  all.num_late += one.num_late;
  all.num_dropped += one.num_dropped;
  all.num_bytes += one.num_bytes;
}

// Runs all clients of all groups side by side.
void Run(std::vector<Group>& groups, double seconds) {
  std::vector<std::vector<ClientReport>> reports(groups.size());
  {
    std::vector<std::jthread> threads;
    for (size_t g = 0; g < groups.size(); ++g) {
      reports[g].resize(groups[g].clients.size());
      for (size_t k = 0; k < groups[g].clients.size(); ++k) {
        threads.emplace_back([&client = groups[g].clients[k], &report = reports[g][k]](
                                 const std::stop_token& stop) { report = client(stop); });
      }
    }
    std::this_thread::sleep_for(std::chrono::duration<double>(seconds));
  }
  for (size_t g = 0; g < groups.size(); ++g) {
    for (const ClientReport& report : reports[g]) AddUp(report, groups[g].report);
  }
}

// Nearest rank. Requires: sorted ascending.
double Percentile(const std::vector<double>& sorted, double share) {
  if (sorted.empty()) return 0.0;
  const auto rank = static_cast<size_t>(share * static_cast<double>(sorted.size()));
  return sorted[std::min(rank, sorted.size() - 1)];
}

void PrintHeader() {
  std::printf(
      "| load | clients | frames/s | MB/s | p50 ms | p95 ms | p99 ms | max ms | late | "
      "dropped | errors |\n");
  std::printf("| --- | --- | --- | --- | --- | --- | --- | --- | --- | --- | --- |\n");
}

void Print(Group& group, double seconds) {
  ClientReport& report = group.report;
  std::vector<double>& ms = report.latencies_ms;
  std::sort(ms.begin(), ms.end());
  std::printf("| %s | %zu | %.0f | %.1f | %.2f | %.2f | %.2f | %.2f | %ld | %ld | %ld |\n",
              group.name.c_str(), group.clients.size(), static_cast<double>(ms.size()) / seconds,
              static_cast<double>(report.num_bytes) / seconds / 1e6, Percentile(ms, 0.5),
              Percentile(ms, 0.95), Percentile(ms, 0.99), ms.empty() ? 0.0 : ms.back(),
              report.num_late, report.num_dropped, report.num_errors);
  std::fflush(stdout);
}

Group Repeat(std::string name, int count, const std::function<Client(int)>& make) {
  Group group{std::move(name), {}, {}};
  for (int k = 0; k < count; ++k) group.clients.push_back(make(k));
  return group;
}

Group Callers(const LoadTarget& target, Frames frames, int count) {
  const bool is_cached = frames == Frames::kRepeated;
  return Repeat(is_cached ? "calls, cached" : "calls, uncached", count, [=](int) {
    return [=](const std::stop_token& stop) { return CallFrames(target, frames, stop); };
  });
}

Group Streams(const LoadTarget& target, double fps, int count) {
  return Repeat(absl::StrCat("streams, ", fps, " frames/s, new weights each"), count, [=](int) {
    return [=](const std::stop_token& stop) { return WatchStream(target, fps, stop); };
  });
}

void RunAndPrint(std::vector<Group> groups, double seconds) {
  Run(groups, seconds);
  for (Group& group : groups) Print(group, seconds);
}

// 32 clients of all kinds; what they would see without the bad ones comes first.
void RunMixed(const LoadTarget& target, const Flags& flags) {
  const auto good = [&] {
    return std::vector<Group>{Callers(target, Frames::kDifferent, 8),
                              Callers(target, Frames::kRepeated, 8), Streams(target, 24, 2)};
  };
  std::printf("| **good clients alone** | | | | | | | | | | |\n");
  RunAndPrint(good(), flags.seconds);
  std::vector<Group> all = good();
  all.push_back(Repeat("streams that are read slowly", 6, [=](int) {
    return [=](const std::stop_token& stop) { return WatchSlowly(target, stop); };
  }));
  all.push_back(Repeat("vanishing clients", 4, [=](int k) {
    return [=](const std::stop_token& stop) { return Vanish(target, k, stop); };
  }));
  all.push_back(Repeat("garbage", 4, [=](int k) {
    return [=](const std::stop_token& stop) { return SendGarbage(target, k, stop); };
  }));
  std::printf("| **the same with bad ones** | | | | | | | | | | |\n");
  RunAndPrint(std::move(all), flags.seconds);
}

void RunAll(const Flags& flags) {
  const LoadServer server(flags.vertices, flags.warp, flags.threads);
  const LoadTarget target = {server.address(), server.duration_s()};
  std::vector<Group> warm_up = {Callers(target, Frames::kRepeated, 2)};
  Run(warm_up, 1.0);
  std::printf("%d vertices a frame, time warp of %.0f frames, %d threads, %.0f s each\n\n",
              flags.vertices, flags.warp, flags.threads, flags.seconds);
  PrintHeader();
  for (const Frames frames : {Frames::kDifferent, Frames::kRepeated}) {
    for (const int count : flags.callers) {
      RunAndPrint({Callers(target, frames, count)}, flags.seconds);
    }
  }
  for (const int count : flags.streams) {
    RunAndPrint({Streams(target, flags.frames_per_second, count)}, flags.seconds);
  }
  if (flags.mixed) RunMixed(target, flags);
}

}  // namespace
}  // namespace liquidblend::bench

int main(int argc, char** argv) {
  CLI::App app("Puts a server in this process under load");
  liquidblend::bench::Flags flags;
  app.add_option("--vertices", flags.vertices, "Of a frame")->capture_default_str();
  app.add_option("--warp", flags.warp, "Largest time warp at weight 1, frames")
      ->capture_default_str();
  app.add_option("--threads", flags.threads, "Of the server, for frames")->capture_default_str();
  app.add_option("--seconds", flags.seconds, "Of each load")->capture_default_str();
  app.add_option("--frames-per-second", flags.frames_per_second, "Of streams")
      ->capture_default_str();
  app.add_option("--callers", flags.callers, "Numbers of clients that call")->delimiter(',');
  app.add_option("--streams", flags.streams, "Numbers of streams")->delimiter(',');
  app.add_option("--mixed", flags.mixed, "Whether to run the mixed load")->capture_default_str();
  CLI11_PARSE(app, argc, argv);
  // What clients do wrong on purpose is none of the table's business.
  liquidblend::base::StartLog("lb_load", liquidblend::base::LogLevel::kError);
  liquidblend::bench::RunAll(flags);
  return 0;
}
