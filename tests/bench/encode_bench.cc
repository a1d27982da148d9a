// Triangle surface -> Draco: our writer against libdraco at the same settings; vertices, preset.
#include <benchmark/benchmark.h>

#include <array>
#include <cmath>

#include "server/encode/draco.h"
#include "server/encode/libdraco.h"
#include "tests/synthetic/shapes.h"

namespace liquidblend {
namespace {

constexpr std::array<const char*, 3> kPresetNames = {"fastest", "balanced", "smallest"};

// A torus with ripples: as wavy as a liquid, so that residuals are of a frame's size.
mesh::TriangleMesh Surface(int64_t num_vertices) {
  const int num_minor = static_cast<int>(std::sqrt(static_cast<double>(num_vertices) / 2.0));
  const int num_major = static_cast<int>(num_vertices) / num_minor;
  mesh::TriangleMesh surface =
      synthetic::Torus(Eigen::Vector3f::Zero(), 0.7, 0.25, num_major, num_minor);
  for (Eigen::Index v = 0; v < surface.num_vertices(); ++v) {
    const Eigen::Vector3f p = surface.vertices.col(v);
    surface.vertices.col(v) +=
        0.01F * Eigen::Vector3f(std::sin(40 * p.y()), std::sin(47 * p.z()), std::sin(53 * p.x()));
  }
  return surface;
}

encode::DracoOptions OptionsOf(const benchmark::State& state) {
  encode::DracoOptions options;
  options.preset = static_cast<encode::Preset>(state.range(1));
  options.grid.origin = {-1.0F, -1.0F, -1.0F};
  options.grid.extent_m = 2.0F;
  return options;
}

// encode(surface): absl::StatusOr<std::string>.
template <typename Encode>
void Run(benchmark::State& state, const Encode& encode) {
  const mesh::TriangleMesh surface = Surface(state.range(0));
  size_t num_bytes = 0;
  for (auto _ : state) {
    const auto data = encode(surface);
    if (!data.ok()) return state.SkipWithError(std::string(data.status().message()).c_str());
    num_bytes = data->size();
  }
  const auto num_triangles = static_cast<double>(surface.num_triangles());
  state.SetLabel(kPresetNames[state.range(1)]);
  state.counters["triangles/s"] =
      benchmark::Counter(num_triangles, benchmark::Counter::kIsIterationInvariantRate);
  state.counters["bytes/triangle"] = static_cast<double>(num_bytes) / num_triangles;
}

void EncodeDraco(benchmark::State& state) {
  const encode::DracoOptions options = OptionsOf(state);
  encode::SurfaceWriter writer;
  Run(state, [&](const mesh::TriangleMesh& surface) {
    return encode::EncodeDraco(surface, options, writer);
  });
}
BENCHMARK(EncodeDraco)
    ->ArgNames({"vertices", "preset"})
    ->ArgsProduct({{2000, 50000}, {0, 1}})
    ->Unit(benchmark::kMillisecond);

void EncodeWithLibdraco(benchmark::State& state) {
  const encode::DracoOptions options = OptionsOf(state);
  Run(state, [&](const mesh::TriangleMesh& surface) {
    return encode::EncodeWithLibdraco(surface, options);
  });
}
BENCHMARK(EncodeWithLibdraco)
    ->ArgNames({"vertices", "preset"})
    ->ArgsProduct({{2000, 50000}, {0, 1, 2}})
    ->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace liquidblend
