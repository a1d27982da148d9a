// Triangle surface -> Draco and back: our writer against libdraco at the same settings, and against
// meshoptimizer's codecs; vertices per frame, whether it is a slice or a torus in order, preset. Of
// a stored family the slice at half of its first target's weight and of the time.
#include <benchmark/benchmark.h>

#include <array>
#include <cmath>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "core/blend/blend.h"
#include "core/slice/slice.h"
#include "liquidblend/decode.h"
#include "server/encode/draco.h"
#include "server/encode/libdraco.h"
#include "server/encode/meshopt.h"
#include "tests/bench/stored_family.h"
#include "tests/synthetic/families.h"
#include "tests/synthetic/shapes.h"

namespace liquidblend {
namespace {

constexpr std::array<const char*, 3> kPresetNames = {"fastest", "balanced", "smallest"};

// A torus with ripples, row by row.
mesh::TriangleMesh RippledTorus(int num_vertices) {
  const int num_minor = static_cast<int>(std::sqrt(num_vertices / 2.0));
  mesh::TriangleMesh surface =
      synthetic::Torus(Eigen::Vector3f::Zero(), 0.7, 0.25, num_vertices / num_minor, num_minor);
  for (Eigen::Index v = 0; v < surface.num_vertices(); ++v) {
    const Eigen::Vector3f p = surface.vertices.col(v);
    surface.vertices.col(v) +=
        0.01F * Eigen::Vector3f(std::sin(40 * p.y()), std::sin(47 * p.z()), std::sin(53 * p.x()));
  }
  return surface;
}

mesh::TriangleMesh MiddleOf(const mesh::RegisteredFamily& family, const slice::CellIndex& index,
                            const std::vector<double>& weights) {
  slice::Workspace workspace;
  if (!slice::FindCandidates(index, weights, family.duration_s() / 2, workspace).ok()) return {};
  return slice::March(index, blend::Blender(family, weights), workspace);
}

// The slice of a torus whose events are shifted in time: triangles of all shapes, in the order of
// its clusters.
mesh::TriangleMesh WarpedSlice(int num_vertices) {
  const int num_minor = static_cast<int>(std::sqrt(num_vertices / 2.0));
  synthetic::ComplexOptions options;
  options.num_frames = 8;
  options.growth_per_frame = 0.01F;
  const mesh::RegisteredFamily family = synthetic::MakeFamily(
      synthetic::HexahedralTorus(num_vertices / num_minor, num_minor, options),
      {{synthetic::SmoothWarp(1, 0.1F, 1.5F), {}}});
  mesh::TriangleMesh surface = MiddleOf(family, slice::CellIndex(family), {1.0});
  surface.vertices *= 0.5F;
  return surface;
}

const mesh::TriangleMesh& StoredSlice() {
  static const auto& slice = *new mesh::TriangleMesh([] {
    const bench::Loaded& loaded = bench::StoredFamily();
    std::vector<double> weights(loaded.family.targets.size());
    weights[0] = 0.5;
    return MiddleOf(loaded.family, loaded.index, weights);
  }());
  return slice;
}

const mesh::TriangleMesh& SurfaceOf(const benchmark::State& state) {
  static auto& surfaces = *new std::map<std::pair<int, bool>, mesh::TriangleMesh>;
  const auto num_vertices = static_cast<int>(state.range(0));
  const bool is_slice = state.range(1) != 0;
  mesh::TriangleMesh& surface = surfaces[{num_vertices, is_slice}];
  if (surface.num_triangles() == 0) {
    surface = is_slice ? WarpedSlice(num_vertices) : RippledTorus(num_vertices);
  }
  return surface;
}

encode::DracoOptions OptionsFor(int64_t preset) {
  encode::DracoOptions options;
  options.preset = static_cast<encode::Preset>(preset);
  options.grid.origin = {-1.0F, -1.0F, -1.0F};
  options.grid.extent_m = 2.0F;
  return options;
}

// encode(surface): absl::StatusOr<std::string>.
template <typename Encode>
void Run(const mesh::TriangleMesh& surface, int64_t preset, const Encode& encode,
         benchmark::State& state) {
  size_t num_bytes = 0;
  for ([[maybe_unused]] auto _ : state) {
    const auto data = encode(surface);
    if (!data.ok()) return state.SkipWithError(std::string(data.status().message()).c_str());
    num_bytes = data->size();
  }
  const auto num_triangles = static_cast<double>(surface.num_triangles());
  state.SetLabel(kPresetNames[preset]);
  state.counters["triangles/s"] =
      benchmark::Counter(num_triangles, benchmark::Counter::kIsIterationInvariantRate);
  state.counters["triangles"] = num_triangles;
  state.counters["bytes/triangle"] = static_cast<double>(num_bytes) / num_triangles;
}

void RunOurs(const mesh::TriangleMesh& surface, const encode::DracoOptions& options,
             benchmark::State& state) {
  encode::SurfaceWriter writer;
  const auto encode = [&](const mesh::TriangleMesh& mesh) {
    return encode::EncodeDraco(mesh, options, writer);
  };
  Run(surface, static_cast<int64_t>(options.preset), encode, state);
}

void RunLibdraco(const mesh::TriangleMesh& surface, const encode::DracoOptions& options,
                 benchmark::State& state) {
  const auto encode = [&](const mesh::TriangleMesh& mesh) {
    return encode::EncodeWithLibdraco(mesh, options);
  };
  Run(surface, static_cast<int64_t>(options.preset), encode, state);
}

void EncodeDraco(benchmark::State& state) {
  RunOurs(SurfaceOf(state), OptionsFor(state.range(2)), state);
}
BENCHMARK(EncodeDraco)
    ->ArgNames({"vertices", "slice", "preset"})
    ->ArgsProduct({{2000, 50000, 200000}, {0, 1}, {0, 1}})
    ->Unit(benchmark::kMillisecond);

void EncodeWithLibdraco(benchmark::State& state) {
  RunLibdraco(SurfaceOf(state), OptionsFor(state.range(2)), state);
}
BENCHMARK(EncodeWithLibdraco)
    ->ArgNames({"vertices", "slice", "preset"})
    ->ArgsProduct({{2000, 50000, 200000}, {0, 1}, {0, 1, 2}})
    ->Unit(benchmark::kMillisecond);

[[maybe_unused]] const bool kIsStoredMeasured = [] {
  if (!bench::HasStoredFamily()) return false;
  const auto options_of = [](const benchmark::State& state) {
    encode::DracoOptions options = OptionsFor(state.range(0));
    options.grid = frames::GridOf(bench::StoredFamily().family);
    return options;
  };
  const auto ours = [=](benchmark::State& state) {
    RunOurs(StoredSlice(), options_of(state), state);
  };
  const auto libdraco = [=](benchmark::State& state) {
    RunLibdraco(StoredSlice(), options_of(state), state);
  };
  for (const int64_t preset : {0, 1}) {
    benchmark::RegisterBenchmark("EncodeDracoStored", ours)
        ->ArgName("preset")
        ->Arg(preset)
        ->Unit(benchmark::kMillisecond);
    benchmark::RegisterBenchmark("EncodeWithLibdracoStored", libdraco)
        ->ArgName("preset")
        ->Arg(preset)
        ->Unit(benchmark::kMillisecond);
  }
  return true;
}();

void EncodeMeshopt(benchmark::State& state) {
  frames::RoundingOptions options;
  options.grid = OptionsFor(0).grid;
  const auto encode = [&](const mesh::TriangleMesh& mesh) {
    return encode::EncodeMeshopt(mesh, options);
  };
  Run(SurfaceOf(state), 0, encode, state);
  state.SetLabel("meshopt");
}
BENCHMARK(EncodeMeshopt)
    ->ArgNames({"vertices", "slice"})
    ->ArgsProduct({{2000, 50000, 200000}, {0, 1}})
    ->Unit(benchmark::kMillisecond);

// What a client does with the bytes.
void RunDecode(const absl::StatusOr<std::string>& data, benchmark::State& state) {
  if (!data.ok()) return state.SkipWithError(std::string(data.status().message()).c_str());
  size_t num_triangles = 0;
  for ([[maybe_unused]] auto _ : state) {
    const auto mesh = DecodeMesh(*data);
    if (!mesh.ok()) return state.SkipWithError(std::string(mesh.status().message()).c_str());
    num_triangles = mesh->num_triangles();
  }
  state.counters["triangles/s"] = benchmark::Counter(static_cast<double>(num_triangles),
                                                     benchmark::Counter::kIsIterationInvariantRate);
  state.counters["bytes/triangle"] =
      static_cast<double>(data->size()) / static_cast<double>(num_triangles);
}

void DecodeDraco(benchmark::State& state) {
  RunDecode(encode::EncodeDraco(SurfaceOf(state), OptionsFor(state.range(2))), state);
}
BENCHMARK(DecodeDraco)
    ->ArgNames({"vertices", "slice", "preset"})
    ->ArgsProduct({{2000, 50000, 200000}, {0, 1}, {0, 1}})
    ->Unit(benchmark::kMillisecond);

void DecodeMeshopt(benchmark::State& state) {
  frames::RoundingOptions options;
  options.grid = OptionsFor(0).grid;
  RunDecode(encode::EncodeMeshopt(SurfaceOf(state), options), state);
}
BENCHMARK(DecodeMeshopt)
    ->ArgNames({"vertices", "slice"})
    ->ArgsProduct({{2000, 50000, 200000}, {0, 1}})
    ->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace liquidblend
