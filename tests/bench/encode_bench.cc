// Triangle surface -> Draco: vertices, position bits.
#include <benchmark/benchmark.h>

#include <cmath>

#include "server/encode/draco.h"
#include "tests/synthetic/shapes.h"

namespace liquidblend {
namespace {

void EncodeDraco(benchmark::State& state) {
  const int num_minor = static_cast<int>(std::sqrt(static_cast<double>(state.range(0)) / 2.0));
  const int num_major = static_cast<int>(state.range(0)) / num_minor;
  const mesh::TriangleMesh surface =
      synthetic::Torus(Eigen::Vector3f::Zero(), 0.7, 0.3, num_major, num_minor);
  encode::DracoOptions options;
  options.position_bits = static_cast<int>(state.range(1));
  options.grid.origin = {-1.0F, -1.0F, -1.0F};
  options.grid.extent_m = 2.0F;
  size_t num_bytes = 0;
  for (auto _ : state) {
    const auto data = encode::EncodeDraco(surface, options);
    if (!data.ok()) return state.SkipWithError(std::string(data.status().message()).c_str());
    num_bytes = data->size();
  }
  const auto num_triangles = static_cast<double>(surface.num_triangles());
  state.counters["triangles/s"] =
      benchmark::Counter(num_triangles, benchmark::Counter::kIsIterationInvariantRate);
  state.counters["bytes/triangle"] = static_cast<double>(num_bytes) / num_triangles;
}
BENCHMARK(EncodeDraco)
    ->ArgNames({"vertices", "bits"})
    ->ArgsProduct({{5000, 50000}, {12, 14}})
    ->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace liquidblend
