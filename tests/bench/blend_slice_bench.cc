// Blend weights and time -> surface, one thread: vertices per frame, frames of the animation,
// largest time warp in frames, weight in percent; of a stored family the weight of its first
// target. By number of targets: they share a weight of 50 percent.
#include <benchmark/benchmark.h>

#include <vector>

#include "core/blend/blend.h"
#include "core/slice/slice.h"
#include "tests/bench/stored_family.h"
#include "tests/bench/warped_family.h"

namespace liquidblend {
namespace {

// Each slice at another time, as in a stream.
void Slice(const bench::Loaded& loaded, const std::vector<double>& weights,
           benchmark::State& state) {
  slice::Workspace workspace;
  int64_t num_triangles = 0;
  int64_t num_candidates = 0;
  double share = 0.25;
  for ([[maybe_unused]] auto _ : state) {
    share = share < 0.75 ? share + 0.0137 : 0.25;
    const double time_s = share * loaded.family.duration_s();
    if (!slice::FindCandidates(loaded.index, weights, time_s, workspace).ok()) {
      return state.SkipWithError("time");
    }
    const mesh::TriangleMesh surface =
        slice::March(loaded.index, blend::Blender(loaded.family, weights), workspace);
    num_triangles += surface.num_triangles();
    benchmark::DoNotOptimize(surface.vertices.data());
  }
  for (const int32_t cluster : workspace.clusters) {  // of the last slice
    num_candidates += loaded.index.cluster(cluster).num_cells;
  }
  state.counters["triangles/s"] =
      benchmark::Counter(static_cast<double>(num_triangles), benchmark::Counter::kIsRate);
  state.counters["triangles"] =
      benchmark::Counter(static_cast<double>(num_triangles), benchmark::Counter::kAvgIterations);
  state.counters["candidate cells"] = static_cast<double>(num_candidates);
}

std::vector<double> WeightOfFirst(const bench::Loaded& loaded, int64_t percent) {
  std::vector<double> weights(loaded.family.targets.size());
  weights[0] = static_cast<double>(percent) / 100.0;
  return weights;
}

void BlendSlice(benchmark::State& state) {
  const bench::Loaded& loaded =
      bench::FamilyOf({static_cast<int>(state.range(0)), static_cast<int>(state.range(1)),
                       static_cast<int>(state.range(2))});
  Slice(loaded, WeightOfFirst(loaded, state.range(3)), state);
}
BENCHMARK(BlendSlice)
    ->ArgNames({"vertices", "frames", "warp", "percent"})
    ->ArgsProduct({{5000, 50000}, {40}, {0}, {100}})
    ->ArgsProduct({{5000, 50000}, {40}, {10}, {0, 50, 100}})
    ->ArgsProduct({{50000}, {80, 160}, {10}, {50}})       // by length
    ->ArgsProduct({{200000, 1000000}, {24}, {10}, {50}})  // by size
    ->Unit(benchmark::kMillisecond);

void BlendSliceOfTargets(benchmark::State& state) {
  const bench::Loaded& loaded = bench::FamilyOf({.num_targets = static_cast<int>(state.range(0))});
  const double count = static_cast<double>(state.range(0));
  Slice(loaded, std::vector<double>(loaded.family.targets.size(), 0.5 / count), state);
}
BENCHMARK(BlendSliceOfTargets)
    ->ArgName("targets")
    ->Arg(1)
    ->Arg(2)
    ->Arg(4)
    ->Arg(16)
    ->Unit(benchmark::kMillisecond);

[[maybe_unused]] const bool kIsStoredMeasured = [] {
  if (!bench::HasStoredFamily()) return false;
  const auto slice = [](benchmark::State& state) {
    const bench::Loaded& loaded = bench::StoredFamily();
    Slice(loaded, WeightOfFirst(loaded, state.range(0)), state);
  };
  benchmark::RegisterBenchmark("BlendSliceStored", slice)
      ->ArgName("percent")
      ->Arg(0)
      ->Arg(50)
      ->Arg(100)
      ->Unit(benchmark::kMillisecond);
  return true;
}();

void BuildCellIndex(benchmark::State& state) {
  const bench::Loaded& loaded =
      bench::FamilyOf({.vertices_per_frame = static_cast<int>(state.range(0))});
  for ([[maybe_unused]] auto _ : state) {
    const slice::CellIndex index(loaded.family);
    benchmark::DoNotOptimize(index.num_clusters());
  }
  state.counters["cells/s"] = benchmark::Counter(static_cast<double>(loaded.family.num_cells()),
                                                 benchmark::Counter::kIsIterationInvariantRate);
}
BENCHMARK(BuildCellIndex)->ArgName("vertices")->Arg(50000)->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace liquidblend
