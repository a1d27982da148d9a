#include "tests/bench/load_stages.h"

#include <cstdio>
#include <numeric>
#include <vector>

#include "core/base/status_macros.h"
#include "tests/bench/load_report.h"

namespace liquidblend::bench {
namespace {

void PrintRow(v1::Encoding::Preset preset, const StageSums& before, const StageSums& after,
              const ClientReport& seen) {
  const auto num_calls = static_cast<double>(seen.latencies_ms.size());
  const double total_ms =
      std::accumulate(seen.latencies_ms.begin(), seen.latencies_ms.end(), 0.0) / num_calls;
  const auto ms_of = [&](double StageSums::*stage) {
    return 1e3 * (after.*stage - before.*stage) / (after.num_frames - before.num_frames);
  };
  const double queue_ms = ms_of(&StageSums::queue_s);
  const double slice_ms = ms_of(&StageSums::slice_s);
  const double encode_ms = ms_of(&StageSums::encode_s);
  const auto num_triangles = static_cast<double>(seen.num_triangles);
  std::printf("| %s | %.0f | %.0f | %.2f | %.2f | %.2f | %.2f | %.2f | %.3f |\n",
              v1::Encoding::Preset_Name(preset).c_str(),
              static_cast<double>(seen.num_vertices) / num_calls, num_triangles / num_calls,
              queue_ms, slice_ms, encode_ms, total_ms - queue_ms - slice_ms - encode_ms, total_ms,
              static_cast<double>(seen.num_bytes) / num_triangles);
  std::fflush(stdout);
}

}  // namespace

absl::Status PrintStages(const LoadServer& server, const LoadTarget& target, double seconds) {
  std::printf(
      "\n| preset | vertices | triangles | wait ms | blend and slice ms | encode ms | wire ms | "
      "sum ms | bytes/triangle |\n| --- | --- | --- | --- | --- | --- | --- | --- | --- |\n");
  for (const auto preset :
       {v1::Encoding::FASTEST, v1::Encoding::BALANCED, v1::Encoding::SMALLEST}) {
    LB_ASSIGN_OR_RETURN(const StageSums before, server.ReadStageSums());
    std::vector<Group> groups = {Repeat("stages", 1, [=](int) {
      return
          [=](const std::stop_token& stop) { return CallFrames(target, {.preset = preset}, stop); };
    })};
    Run(groups, seconds);
    LB_ASSIGN_OR_RETURN(const StageSums after, server.ReadStageSums());
    if (after.num_frames == before.num_frames) return absl::UnavailableError("no frame was made");
    PrintRow(preset, before, after, groups[0].report);
  }
  std::printf("\n");
  return absl::OkStatus();
}

}  // namespace liquidblend::bench
