#include "worker/spacetime/build.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <utility>

#include "absl/strings/str_cat.h"
#include "core/base/status_macros.h"
#include "worker/spacetime/match_volume.h"
#include "worker/spacetime/normals.h"
#include "worker/spacetime/plan_layers.h"
#include "worker/spacetime/surface_nets.h"

namespace liquidblend::spacetime {
namespace {

constexpr int kWaveLayers = 8;   // layers sampled at a time: bounds the memory
constexpr double kMargin = 2.0;  // grid spacings around the liquid

absl::StatusOr<Grid> ChooseGrid(const mesh::Animation& animation,
                                const std::vector<LayerTime>& times, double spacing_m) {
  Eigen::Array3d lo = Eigen::Array3d::Constant(std::numeric_limits<double>::infinity());
  Eigen::Array3d hi = -lo;
  const auto include = [&](int frame, double frames) {
    if (animation.frames[frame].num_vertices() == 0) return;
    const Eigen::Matrix3Xf vertices = Advected(animation, frame, frames);
    lo = lo.min(vertices.rowwise().minCoeff().cast<double>().array());
    hi = hi.max(vertices.rowwise().maxCoeff().cast<double>().array());
  };
  for (const LayerTime& layer : times) {
    include(layer.earlier, layer.time - animation.time(layer.earlier));
    include(layer.later, layer.time - animation.time(layer.later));
  }
  Grid grid;
  grid.spacing_m = spacing_m;
  grid.origin_m = lo - kMargin * spacing_m;
  const Eigen::Array3d dims = ((hi - lo) / spacing_m).ceil() + 2 * kMargin + 1;
  if (!(dims.prod() < static_cast<double>(std::numeric_limits<int32_t>::max()))) {
    return absl::ResourceExhaustedError(
        absl::StrCat("animation '", animation.name, "' needs a grid of ", dims[0], " x ", dims[1],
                     " x ", dims[2], " points at a spacing of ", spacing_m,
                     " m, more than 2^31: use a larger spacing"));
  }
  for (int axis = 0; axis < 3; ++axis) grid.dims[axis] = static_cast<int>(dims[axis]);
  return grid;
}

GridSurface SurfaceAt(const mesh::Animation& animation, int frame, double time, const Grid& grid) {
  const Eigen::Matrix3Xf vertices = Advected(animation, frame, time - animation.time(frame));
  const Eigen::Matrix3Xd points =
      (vertices.cast<double>().colwise() - grid.origin_m) / grid.spacing_m;
  return {points.cast<float>(), animation.frames[frame].triangles,
          animation.frames[frame].velocities};
}

Layer SampleLayer(const mesh::Animation& animation, const LayerTime& layer, const Grid& grid) {
  GridSurface earlier = SurfaceAt(animation, layer.earlier, layer.time, grid);
  if (layer.earlier == layer.later) return Layer(grid, std::move(earlier));
  return Layer(grid, std::move(earlier), SurfaceAt(animation, layer.later, layer.time, grid),
               static_cast<float>(layer.share));
}

struct Layers {
  std::vector<LayerTime> times;
  std::vector<InsideBits> inside;  // one per layer
  std::vector<Slab> slabs;         // slab s lies between layers s and s + 1
};

// Samples the layers and places the vertices, a wave of layers at a time.
Layers PlaceAllVertices(const mesh::Animation& animation, std::vector<LayerTime> times,
                        const Grid& grid, const parallel::Arena& arena,
                        const std::function<void(double)>& progress) {
  const int num_layers = static_cast<int>(times.size());
  Layers result;
  result.times = std::move(times);
  result.inside.resize(num_layers);
  result.slabs.resize(num_layers - 1);
  std::vector<std::optional<Layer>> wave(kWaveLayers + 1);  // [0]: the last one of the wave before
  for (int begin = 0; begin < num_layers; begin += kWaveLayers) {
    const int count = std::min(kWaveLayers, num_layers - begin);
    arena.Run(count, [&](int64_t n) {
      const int l = begin + static_cast<int>(n);
      wave[n + 1].emplace(SampleLayer(animation, result.times[l], grid));
      result.inside[l] = wave[n + 1]->inside();
    });
    arena.Run(count, [&](int64_t n) {
      const int l = begin + static_cast<int>(n);
      if (l > 0) result.slabs[l - 1] = PlaceVertices(grid, *wave[n], *wave[n + 1]);
    });
    wave[0] = std::move(wave[count]);
    if (progress) progress(0.8 * (begin + count) / num_layers);
  }
  return result;
}

// All hexahedra; of layer l, those of its spatial edges are [begin[l], end[l]).
struct Hexahedra {
  std::vector<mesh::Hexahedron> all;
  std::vector<size_t> begin, end;
};

Hexahedra ConnectVertices(const Grid& grid, const Layers& layers,
                          const std::vector<int64_t>& first_vertex, const parallel::Arena& arena) {
  const int64_t num_slabs = static_cast<int64_t>(layers.slabs.size());
  std::vector<std::vector<mesh::Hexahedron>> of_slab(num_slabs);
  std::vector<size_t> num_spatial(num_slabs, 0);
  const auto ref = [&](int64_t s) { return SlabRef{&layers.slabs[s], first_vertex[s]}; };
  arena.Run(num_slabs, [&](int64_t s) {
    if (s > 0) AddSpatialHexahedra(grid, layers.inside[s], ref(s - 1), ref(s), of_slab[s]);
    num_spatial[s] = of_slab[s].size();
    AddTemporalHexahedra(grid, layers.inside[s], layers.inside[s + 1], ref(s), of_slab[s]);
  });
  size_t total = 0;
  for (const auto& cells : of_slab) total += cells.size();
  Hexahedra hexahedra;
  hexahedra.all.reserve(total);
  for (int64_t s = 0; s < num_slabs; ++s) {
    hexahedra.begin.push_back(hexahedra.all.size());
    hexahedra.end.push_back(hexahedra.all.size() + num_spatial[s]);
    hexahedra.all.insert(hexahedra.all.end(), of_slab[s].begin(), of_slab[s].end());
    of_slab[s] = {};
  }
  return hexahedra;
}

// The layers that show a frame as it is.
std::vector<FrameHexahedra> FramesOf(const mesh::Animation& animation,
                                     const std::vector<LayerTime>& times,
                                     const Hexahedra& hexahedra,
                                     const std::vector<mesh::Hexahedron>& cells) {
  std::vector<FrameHexahedra> frames;
  for (size_t l = 1; l + 1 < times.size(); ++l) {
    if (times[l].earlier != times[l].later) continue;
    frames.push_back(
        {times[l].time, mesh::Volume(animation.frames[times[l].earlier]),
         std::span(cells).subspan(hexahedra.begin[l], hexahedra.end[l] - hexahedra.begin[l])});
  }
  return frames;
}

// Grid units -> metres and frames.
void FillVertices(const Grid& grid, const Layers& layers, const std::vector<int64_t>& first_vertex,
                  mesh::SpaceTimeMesh& mesh) {
  const bool has_velocities =
      std::all_of(layers.slabs.begin(), layers.slabs.end(), [](const Slab& slab) {
        return static_cast<int64_t>(slab.velocities.size()) == slab.num_vertices();
      });
  mesh.vertices.resize(4, first_vertex.back());
  mesh.velocities.resize(3, has_velocities ? first_vertex.back() : 0);
  for (size_t s = 0; s < layers.slabs.size(); ++s) {
    const Slab& slab = layers.slabs[s];
    const double begin = layers.times[s].time, length = layers.times[s + 1].time - begin;
    for (int64_t n = 0; n < slab.num_vertices(); ++n) {
      const int64_t v = first_vertex[s] + n;
      const Eigen::Vector3d position =
          grid.origin_m + grid.spacing_m * slab.vertices[n].head<3>().cast<double>();
      mesh.vertices.col(v).head<3>() = position.cast<float>();
      mesh.vertices(3, v) = static_cast<float>(begin + length * slab.vertices[n].w());
      if (has_velocities) mesh.velocities.col(v) = slab.velocities[n];
    }
  }
}

}  // namespace

absl::Status BuildOptions::Validate() const {
  if (!(spacing_edges >= 0.25 && spacing_edges <= 4)) {
    return absl::InvalidArgumentError(
        absl::StrCat("spacing_edges is ", spacing_edges, ", not in [0.25, 4]"));
  }
  if (!(max_motion_spacings >= 0.5)) {
    return absl::InvalidArgumentError(
        absl::StrCat("max_motion_spacings is ", max_motion_spacings, ", below 0.5"));
  }
  return absl::OkStatus();
}

absl::StatusOr<mesh::SpaceTimeMesh> Build(const mesh::Animation& animation,
                                          const BuildOptions& options, const parallel::Arena& arena,
                                          const std::function<void(double)>& progress) {
  LB_RETURN_IF_ERROR(options.Validate());
  const double edge_length_m = mesh::MeanEdgeLength(animation);
  if (animation.num_frames() < 2 || !(edge_length_m > 0)) {
    return absl::InvalidArgumentError(
        absl::StrCat("animation '", animation.name, "' has ", animation.num_frames(),
                     " frames and a mean edge length of ", edge_length_m,
                     " m; a space-time mesh needs at least 2 frames and some liquid"));
  }
  const double spacing_m = options.spacing_edges * edge_length_m;
  std::vector<LayerTime> times = PlanLayers(animation, options.max_motion_spacings * spacing_m);
  LB_ASSIGN_OR_RETURN(const Grid grid, ChooseGrid(animation, times, spacing_m));
  const Layers layers = PlaceAllVertices(animation, std::move(times), grid, arena, progress);
  std::vector<int64_t> first_vertex = {0};
  for (const Slab& slab : layers.slabs) {
    first_vertex.push_back(first_vertex.back() + slab.num_vertices());
  }
  if (first_vertex.back() > std::numeric_limits<int32_t>::max()) {
    return absl::ResourceExhaustedError(
        absl::StrCat("animation '", animation.name, "' needs ", first_vertex.back(),
                     " space-time vertices, more than 2^31: use a larger spacing"));
  }
  mesh::SpaceTimeMesh mesh;
  mesh.num_frames = 1 + static_cast<int>(std::floor(animation.time(animation.num_frames() - 1)));
  mesh.frames_per_second = animation.frames_per_second;
  mesh.edge_length_m = edge_length_m;
  mesh.num_first_vertices = layers.slabs.front().num_vertices();
  mesh.num_last_vertices = layers.slabs.back().num_vertices();
  FillVertices(grid, layers, first_vertex, mesh);
  Hexahedra hexahedra = ConnectVertices(grid, layers, first_vertex, arena);
  mesh.hexahedra = std::move(hexahedra.all);
  ComputeNormals(mesh, arena);
  MatchVolumes(FramesOf(animation, layers.times, hexahedra, mesh.hexahedra), arena, mesh);
  if (progress) progress(1.0);
  return mesh;
}

}  // namespace liquidblend::spacetime
