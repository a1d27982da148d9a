#include "tests/bench/load_report.h"

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <thread>
#include <utility>

#include "absl/strings/str_format.h"

namespace liquidblend::bench {

void AddUp(const ClientReport& one, ClientReport& all) {
  all.latencies_ms.insert(all.latencies_ms.end(), one.latencies_ms.begin(), one.latencies_ms.end());
  all.num_errors += one.num_errors;
  all.late.insert(all.late.end(), one.late.begin(), one.late.end());
  all.num_dropped += one.num_dropped;
  all.num_bytes += one.num_bytes;
  all.num_vertices += one.num_vertices;
  all.num_triangles += one.num_triangles;
}

void Sort(ClientReport& report) {
  std::sort(report.latencies_ms.begin(), report.latencies_ms.end());
}

Group Repeat(std::string name, int count, const std::function<Client(int)>& make) {
  Group group{std::move(name), {}, {}};
  for (int k = 0; k < count; ++k) group.clients.push_back(make(k));
  return group;
}

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
    Sort(groups[g].report);
  }
}

double Percentile(const std::vector<double>& sorted, double share) {
  if (sorted.empty()) return 0.0;
  const auto rank = static_cast<size_t>(share * static_cast<double>(sorted.size()));
  return sorted[std::min(rank, sorted.size() - 1)];
}

void PrintHeader() {
  std::printf(
      "| load | clients | frames/s | vertices | MB/s | p50 ms | p95 ms | p99 ms | max ms | late | "
      "dropped | errors |\n"
      "| --- | --- | --- | --- | --- | --- | --- | --- | --- | --- | --- | --- |\n");
}

void PrintTitle(const std::string& title) {
  std::printf("| **%s** | | | | | | | | | | | |\n", title.c_str());
}

void Print(Group& group, double seconds) {
  const ClientReport& report = group.report;
  const std::vector<double>& ms = report.latencies_ms;
  const double num_frames = std::max<double>(1.0, static_cast<double>(ms.size()));
  std::printf("| %s | %zu | %.0f | %.0f | %.1f | %.2f | %.2f | %.2f | %.2f | %zu | %ld | %ld |\n",
              group.name.c_str(), group.clients.size(), static_cast<double>(ms.size()) / seconds,
              static_cast<double>(report.num_vertices) / num_frames,
              static_cast<double>(report.num_bytes) / seconds / 1e6, Percentile(ms, 0.5),
              Percentile(ms, 0.95), Percentile(ms, 0.99), ms.empty() ? 0.0 : ms.back(),
              report.late.size(), report.num_dropped, report.num_errors);
  std::fflush(stdout);
}

void PrintStops(const std::vector<Interval>& stops, const std::vector<Group>& groups) {
  if (stops.empty()) return;
  double longest_ms = 0.0;
  for (const Interval& stop : stops) {
    const std::chrono::duration<double, std::milli> length = stop.end - stop.begin;
    longest_ms = std::max(longest_ms, length.count());
  }
  int64_t num_late = 0, num_touched = 0;
  for (const Group& group : groups) {
    num_late += std::ssize(group.report.late);
    num_touched += CountTouched(group.report.late, stops);
  }
  PrintTitle(absl::StrFormat(
      "a core of the machine stood still %d times, for %.0f ms at most, while %d of "
      "%d late frames were due",
      stops.size(), longest_ms, num_touched, num_late));
}

}  // namespace liquidblend::bench
