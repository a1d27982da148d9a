// Blend weights and time -> surface, one thread: vertices per frame, largest time warp in frames,
// weight in percent.
#include <benchmark/benchmark.h>

#include <cmath>
#include <map>
#include <memory>
#include <numbers>
#include <utility>
#include <vector>

#include "server/blend/blend.h"
#include "server/slice/slice.h"
#include "tests/synthetic/families.h"

namespace liquidblend {
namespace {

constexpr int kNumFrames = 40;

struct Loaded {
  explicit Loaded(mesh::RegisteredFamily registered)
      : family(std::move(registered)), index(family) {}
  const mesh::RegisteredFamily family;
  const slice::CellIndex index;
};

// A growing, moving torus of quads; events are shifted by up to `warp_frames`, with a wavelength of
// half the torus, so the steepest place has about warp_frames * pi frames a metre.
synthetic::Field TimeWarp(double warp_frames) {
  return [=](int64_t, const Eigen::Vector4f& at) {
    const double phase = std::numbers::pi * (2.0 * at[0] + at[1]);
    return Eigen::Vector4f(0.05F, 0.0F, 0.0F, static_cast<float>(warp_frames * std::sin(phase)));
  };
}

const Loaded& FamilyOf(int vertices_per_frame, int warp_frames) {
  static auto& families = *new std::map<std::pair<int, int>, std::unique_ptr<Loaded>>;
  std::unique_ptr<Loaded>& loaded = families[{vertices_per_frame, warp_frames}];
  if (loaded == nullptr) {
    const int num_minor = static_cast<int>(std::sqrt(vertices_per_frame / 2.0));
    synthetic::ComplexOptions options;
    options.num_frames = kNumFrames;
    options.growth_per_frame = 0.01F;
    loaded = std::make_unique<Loaded>(synthetic::MakeFamily(
        synthetic::HexahedralTorus(vertices_per_frame / num_minor, num_minor, options),
        {{TimeWarp(warp_frames), {}}}));
  }
  return *loaded;
}

void BlendSlice(benchmark::State& state) {
  const Loaded& loaded =
      FamilyOf(static_cast<int>(state.range(0)), static_cast<int>(state.range(1)));
  const std::vector<double> weights = {static_cast<double>(state.range(2)) / 100.0};
  slice::Workspace workspace;
  std::vector<mesh::Float4> positions;
  int64_t num_triangles = 0;
  int64_t num_blended = 0;
  double share = 0.25;
  for (auto _ : state) {
    share = share < 0.75 ? share + 0.0137 : 0.25;  // another time, as in a stream
    const double time_s = share * loaded.family.duration_s();
    if (!slice::FindCandidates(loaded.index, weights, time_s, workspace).ok()) {
      return state.SkipWithError("time");
    }
    blend::BlendVertices(loaded.family, weights, workspace.vertex_ranges, positions);
    const mesh::TriangleMesh surface = slice::March(loaded.index, positions, workspace);
    num_triangles += surface.num_triangles();
    num_blended += workspace.num_vertices;
    benchmark::DoNotOptimize(surface.vertices.data());
  }
  state.counters["triangles/s"] =
      benchmark::Counter(static_cast<double>(num_triangles), benchmark::Counter::kIsRate);
  state.counters["triangles"] =
      benchmark::Counter(static_cast<double>(num_triangles), benchmark::Counter::kAvgIterations);
  state.counters["vertices blended"] =
      benchmark::Counter(static_cast<double>(num_blended), benchmark::Counter::kAvgIterations);
}
BENCHMARK(BlendSlice)
    ->ArgNames({"vertices", "warp", "percent"})
    ->ArgsProduct({{5000, 50000}, {0}, {100}})
    ->ArgsProduct({{5000, 50000}, {10}, {0, 50, 100}})
    ->Unit(benchmark::kMillisecond);

void BuildCellIndex(benchmark::State& state) {
  const Loaded& loaded = FamilyOf(static_cast<int>(state.range(0)), 10);
  for (auto _ : state) {
    const slice::CellIndex index(loaded.family);
    benchmark::DoNotOptimize(index.num_clusters());
  }
  state.counters["cells/s"] = benchmark::Counter(static_cast<double>(loaded.family.num_cells()),
                                                 benchmark::Counter::kIsIterationInvariantRate);
}
BENCHMARK(BuildCellIndex)->ArgName("vertices")->Arg(50000)->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace liquidblend
