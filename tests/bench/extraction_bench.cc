// Our extraction of a slice against the paper's (tests/reference), one thread: subdivisions of the
// sphere, largest time warp in tenths of a frame.
//   slivers  triangles whose radius ratio (twice inscribed by circumscribed circle) is below 0.1
#include <benchmark/benchmark.h>

#include <utility>
#include <vector>

#include "core/blend/blend.h"
#include "core/slice/slice.h"
#include "tests/reference/paper_extraction.h"
#include "tests/synthetic/families.h"
#include "tests/synthetic/tracked.h"
#include "worker/spacetime/tracked/build_tracked.h"

namespace liquidblend {
namespace {

// A tracked ellipsoid with flips, splits and collapses, moved by a warp.
mesh::SpaceTimeMesh WarpedMesh(const benchmark::State& state) {
  synthetic::RemeshingOptions options;
  options.sequence.subdivisions = static_cast<int>(state.range(0));
  const mesh::Animation animation = synthetic::RemeshedEllipsoid(options);
  const parallel::Arena arena(1);
  const auto links = spacetime::TrackLinks(animation, {}, arena);
  if (!links.ok()) return {};
  auto mesh = spacetime::BuildTracked(animation, *links, {}, arena);
  if (!mesh.ok()) return {};
  const auto warp = synthetic::SmoothWarp(1, 0.05F, static_cast<float>(state.range(1)) / 10);
  for (int64_t v = mesh->num_first_vertices; v < mesh->num_vertices() - mesh->num_last_vertices;
       ++v) {
    mesh->vertices.col(v) += warp(v, mesh->vertices.col(v));
  }
  return *std::move(mesh);
}

// Cuts at other times again and again, as a stream does, and reports triangles and slivers of one.
template <typename Extract>
void Run(benchmark::State& state, const Extract& extract) {
  double time_frames = 2.0;
  for ([[maybe_unused]] auto _ : state) {
    time_frames = time_frames < 5.0 ? time_frames + 0.137 : 2.0;
    benchmark::DoNotOptimize(extract(time_frames).vertices.data());
  }
  double num_triangles = 0;
  double num_slivers = 0;
  constexpr int kNumSamples = 16;
  for (int n = 0; n < kNumSamples; ++n) {
    const mesh::TriangleMesh surface = extract(2.05 + 3.0 * n / kNumSamples);
    num_triangles += static_cast<double>(surface.num_triangles()) / kNumSamples;
    num_slivers += static_cast<double>(reference::NumSlivers(surface)) / kNumSamples;
  }
  state.counters["triangles"] = num_triangles;
  state.counters["slivers"] = num_slivers;
}

// Ours, as the server does it; then with the paper's Laplacian step.
template <bool kIsSmoothed>
void ExtractOurs(benchmark::State& state) {
  const mesh::SpaceTimeMesh mesh = WarpedMesh(state);
  const mesh::RegisteredFamily family = mesh::ViewOf(mesh);
  const slice::CellIndex index(family);
  slice::Workspace workspace;
  Run(state, [&](double time_frames) {
    const double time_s = time_frames / family.frames_per_second;
    if (!slice::FindCandidates(index, {}, time_s, workspace).ok()) return mesh::TriangleMesh();
    mesh::TriangleMesh surface = slice::March(index, blend::Blender(family, {}), workspace);
    if (kIsSmoothed) reference::SmoothOnce(surface);
    return surface;
  });
}

// The paper's, without and with its Laplacian step.
template <bool kIsSmoothed>
void ExtractAsInThePaper(benchmark::State& state) {
  const mesh::SpaceTimeMesh mesh = WarpedMesh(state);
  const std::vector<mesh::Tetrahedron> tetrahedra = reference::SplitWedges(mesh.wedges);
  Run(state, [&](double time_frames) {
    mesh::TriangleMesh surface = reference::SliceTetrahedra(mesh.vertices, tetrahedra, time_frames);
    reference::FillHoles(surface);
    if (kIsSmoothed) reference::SmoothOnce(surface);
    return surface;
  });
}

void Sizes(benchmark::internal::Benchmark* benchmark) {
  benchmark->ArgNames({"subdivisions", "warp_tenths"})
      ->ArgsProduct({{3, 5}, {0, 5, 20}})
      ->Unit(benchmark::kMillisecond);
}
BENCHMARK(ExtractOurs<false>)->Apply(Sizes);
BENCHMARK(ExtractOurs<true>)->Apply(Sizes);
BENCHMARK(ExtractAsInThePaper<false>)->Apply(Sizes);
BENCHMARK(ExtractAsInThePaper<true>)->Apply(Sizes);

}  // namespace
}  // namespace liquidblend
