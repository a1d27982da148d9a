#include "worker/spacetime/build.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include "absl/strings/str_cat.h"
#include "core/base/status_macros.h"
#include "worker/spacetime/normals.h"
#include "worker/spacetime/surface_nets.h"

namespace liquidblend::spacetime {
namespace {

constexpr int kWaveLayers = 8;   // layers sampled at a time: bounds the memory
constexpr double kMargin = 2.0;  // grid spacings around the liquid

// Layer l shows frame l - 1; the first and the last one continue the motion beyond both ends, so
// that the first and the last frame lie inside the mesh.
int NumLayers(const mesh::Animation& animation) { return animation.num_frames() + 2; }

struct World {
  Eigen::Matrix3Xf vertices;
  const mesh::TriangleMesh* frame;
};

World LayerInWorld(const mesh::Animation& animation, int layer) {
  const int frame = std::clamp(layer - 1, 0, animation.num_frames() - 1);
  const mesh::TriangleMesh& mesh = animation.frames[frame];
  World world{mesh.vertices, &mesh};
  if (frame != layer - 1 && mesh.velocities.cols() > 0) {
    const double step_s = (layer - 1 - frame) / animation.frames_per_second;
    world.vertices += static_cast<float>(step_s) * mesh.velocities;
  }
  return world;
}

GridSurface LayerInGrid(const mesh::Animation& animation, int layer, const Grid& grid) {
  const World world = LayerInWorld(animation, layer);
  const Eigen::Matrix3Xd points =
      (world.vertices.cast<double>().colwise() - grid.origin_m) / grid.spacing_m;
  return {points.cast<float>(), world.frame->triangles, world.frame->velocities};
}

absl::StatusOr<Grid> ChooseGrid(const mesh::Animation& animation, double spacing_m) {
  Eigen::Array3d lo = Eigen::Array3d::Constant(std::numeric_limits<double>::infinity());
  Eigen::Array3d hi = -lo;
  for (int l = 0; l < NumLayers(animation); ++l) {
    const World world = LayerInWorld(animation, l);
    if (world.vertices.cols() == 0) continue;
    lo = lo.min(world.vertices.rowwise().minCoeff().cast<double>().array());
    hi = hi.max(world.vertices.rowwise().maxCoeff().cast<double>().array());
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

struct Layers {
  std::vector<InsideBits> inside;  // one per layer
  std::vector<Slab> slabs;         // slab s lies between layers s and s + 1
};

// Samples the layers and places the vertices, a wave of layers at a time.
Layers PlaceAllVertices(const mesh::Animation& animation, const Grid& grid,
                        const BuildOptions& options, const parallel::Arena& arena,
                        const std::function<void(double)>& progress) {
  const int num_layers = NumLayers(animation);
  Layers result;
  result.inside.resize(num_layers);
  result.slabs.resize(num_layers - 1);
  std::vector<std::optional<Layer>> wave(kWaveLayers + 1);  // [0]: the last one of the wave before
  for (int begin = 0; begin < num_layers; begin += kWaveLayers) {
    const int count = std::min(kWaveLayers, num_layers - begin);
    arena.Run(count, [&](int64_t n) {
      const int l = begin + static_cast<int>(n);
      wave[n + 1].emplace(SampleLayer(grid, LayerInGrid(animation, l, grid)));
      result.inside[l] = wave[n + 1]->inside;
    });
    arena.Run(count, [&](int64_t n) {
      const int l = begin + static_cast<int>(n);
      if (l == 0) return;
      result.slabs[l - 1] = PlaceVertices(grid, *wave[n], *wave[n + 1], options.projection_steps);
    });
    wave[0] = std::move(wave[count]);
    if (progress) progress(0.8 * (begin + count) / num_layers);
  }
  return result;
}

std::vector<mesh::Hexahedron> ConnectVertices(const Grid& grid, const Layers& layers,
                                              const std::vector<int64_t>& first_vertex,
                                              const parallel::Arena& arena) {
  const int64_t num_slabs = static_cast<int64_t>(layers.slabs.size());
  std::vector<std::vector<mesh::Hexahedron>> of_slab(num_slabs);
  const auto ref = [&](int64_t s) { return SlabRef{&layers.slabs[s], first_vertex[s]}; };
  arena.Run(num_slabs, [&](int64_t s) {
    if (s > 0) AddSpatialHexahedra(grid, layers.inside[s], ref(s - 1), ref(s), of_slab[s]);
    AddTemporalHexahedra(grid, layers.inside[s], layers.inside[s + 1], ref(s), of_slab[s]);
  });
  size_t total = 0;
  for (const auto& cells : of_slab) total += cells.size();
  std::vector<mesh::Hexahedron> hexahedra;
  hexahedra.reserve(total);
  for (auto& cells : of_slab) {
    hexahedra.insert(hexahedra.end(), cells.begin(), cells.end());
    cells = {};
  }
  return hexahedra;
}

// Grid units -> metres and frames; slab s starts at frame s - 1.
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
    for (int64_t n = 0; n < slab.num_vertices(); ++n) {
      const int64_t v = first_vertex[s] + n;
      const Eigen::Vector3d position =
          grid.origin_m + grid.spacing_m * slab.vertices[n].head<3>().cast<double>();
      mesh.vertices.col(v).head<3>() = position.cast<float>();
      mesh.vertices(3, v) = static_cast<float>(s) - 1.0f + slab.vertices[n].w();
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
  if (projection_steps < 0 || projection_steps > 16) {
    return absl::InvalidArgumentError(
        absl::StrCat("projection_steps is ", projection_steps, ", not in [0, 16]"));
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
  LB_ASSIGN_OR_RETURN(const Grid grid,
                      ChooseGrid(animation, options.spacing_edges * edge_length_m));
  const Layers layers = PlaceAllVertices(animation, grid, options, arena, progress);
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
  mesh.num_frames = animation.num_frames();
  mesh.frames_per_second = animation.frames_per_second;
  mesh.edge_length_m = edge_length_m;
  mesh.num_first_vertices = layers.slabs.front().num_vertices();
  mesh.num_last_vertices = layers.slabs.back().num_vertices();
  FillVertices(grid, layers, first_vertex, mesh);
  mesh.hexahedra = ConnectVertices(grid, layers, first_vertex, arena);
  ComputeNormals(mesh, arena);
  if (progress) progress(1.0);
  return mesh;
}

}  // namespace liquidblend::spacetime
