#include "worker/spacetime/build.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <utility>

#include "absl/strings/str_cat.h"
#include "core/base/data_limit.h"
#include "core/base/memory.h"
#include "core/base/status_macros.h"
#include "core/mesh/animation_limits.h"
#include "worker/spacetime/field/normals.h"
#include "worker/spacetime/match_volume.h"
#include "worker/spacetime/nets/droplet_cells.h"
#include "worker/spacetime/nets/layers.h"
#include "worker/spacetime/sheets/sheet_order.h"
#include "worker/spacetime/sheets/thin_sheets.h"
#include "worker/spacetime/time_extrema.h"
#include "worker/spacetime/tracked/build_tracked.h"

namespace liquidblend::spacetime {
namespace {

constexpr double kLargestEdgeScale = 32.0;
constexpr double kMinTrackedShare = 0.85;  // see MatchedShare
constexpr double kAreaPerVertex = 0.866;   // of a regular triangle mesh, in squared edge lengths

// Hexahedra of the nets. Those of the spatial edges in the first layer of slab s are [begin[s],
// end[s]).
struct Hexahedra {
  std::vector<mesh::Hexahedron> all;
  std::vector<size_t> begin, end;
};

Hexahedra ConnectVertices(const Layers& layers, const std::vector<int64_t>& first_vertex,
                          const parallel::Arena& arena) {
  const auto num_slabs = static_cast<int64_t>(layers.slabs.size());
  std::vector<std::vector<mesh::Hexahedron>> of_slab(num_slabs);
  std::vector<size_t> num_spatial(num_slabs, 0);
  std::vector<const InsideBits*> inside;
  for (const InsideBits& layer : layers.inside) inside.push_back(&layer);
  const auto ref = [&](int64_t s) {
    return SlabRef{&layers.slabs[s], first_vertex[s],
                   std::span(inside).subspan(layers.plan.first_layer[s],
                                             layers.plan.num_steps(static_cast<int>(s)) + 1)};
  };
  arena.Run(num_slabs, [&](int64_t s) {
    if (s > 0) AddSpatialHexahedra(layers.grid, ref(s - 1), ref(s), of_slab[s]);
    num_spatial[s] = of_slab[s].size();
    AddInnerHexahedra(layers.grid, ref(s), of_slab[s]);
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

// The frames at the layers between the slabs, with their hexahedra.
std::vector<FrameHexahedra> FramesOf(const mesh::Animation& animation, const Layers& layers,
                                     const Hexahedra& hexahedra,
                                     const std::vector<mesh::Hexahedron>& cells) {
  std::vector<FrameHexahedra> frames;
  for (size_t s = 1; s < layers.slabs.size(); ++s) {
    const LayerTime& layer = layers.plan.layers[layers.plan.first_layer[s]];
    frames.push_back(
        {layer.time, mesh::FindComponents(animation.frames[layer.earlier]),
         std::span(cells).subspan(hexahedra.begin[s], hexahedra.end[s] - hexahedra.begin[s])});
  }
  return frames;
}

// Sets the vertices of the nets, from grid units to metres and frames.
void FillNetVertices(const Layers& layers, const std::vector<int64_t>& first_vertex,
                     mesh::SpaceTimeMesh& mesh) {
  const Grid& grid = layers.grid;
  for (size_t s = 0; s < layers.slabs.size(); ++s) {
    const Slab& slab = layers.slabs[s];
    const double begin = layers.begin(s), length = layers.end(s) - begin;
    for (int64_t n = 0; n < slab.num_vertices(); ++n) {
      const int64_t v = first_vertex[s] + n;
      const Eigen::Vector3d position =
          grid.origin_m + grid.spacing_m * slab.vertices[n].head<3>().cast<double>();
      mesh.vertices.col(v).head<3>() = position.cast<float>();
      mesh.vertices(3, v) = static_cast<float>(begin + length * slab.vertices[n].w());
      if (mesh.velocities.cols() > 0) mesh.velocities.col(v) = slab.velocities[n];
    }
  }
}

// The slab whose vertices a droplet's piece follows. Only pieces before the first frame belong to
// the first slab, only those after the last frame to the last one.
size_t SlabOf(const Layers& layers, double time) {
  const auto& first = layers.plan.first_layer;
  const auto after =
      std::lower_bound(first.begin() + 1, first.end() - 2, time,
                       [&](int l, double t) { return layers.plan.layers[l].time < t; });
  const size_t slab = static_cast<size_t>(after - first.begin()) - 1;
  if (slab == 0) return time < layers.end(0) ? 0 : 1;
  const size_t last = layers.slabs.size() - 1;
  return time > layers.begin(last) ? last : slab;
}

// Adds a droplet's vertices, cells and pieces.
//   next_vertex  per slab: the number of its next vertex
void AddDroplet(const DropletCells& cells, const Layers& layers, int32_t droplet,
                std::vector<int64_t>& next_vertex, mesh::SpaceTimeMesh& mesh) {
  std::vector<int32_t> first;
  for (const DropletPiece& piece : cells.pieces) {
    int64_t& next = next_vertex[SlabOf(layers, piece.time)];
    const int64_t count = piece.vertices.cols();
    mesh.vertices.block(0, next, 3, count) = piece.vertices;
    mesh.vertices.block(3, next, 1, count).setConstant(static_cast<float>(piece.time));
    if (mesh.velocities.cols() > 0) {
      mesh.velocities.middleCols(next, count).colwise() = piece.velocity;
    }
    first.push_back(static_cast<int32_t>(next));
    mesh.rigid_pieces.push_back({first.back(), static_cast<int32_t>(count), droplet});
    next += count;
  }
  const auto vertex = [&](const DropletCells::Corner& corner) {
    return first[corner[0]] + corner[1];
  };
  for (const auto& wedge : cells.wedges) {
    mesh::Wedge& added = mesh.wedges.emplace_back();
    std::transform(wedge.begin(), wedge.end(), added.begin(), vertex);
  }
  for (const auto& tetrahedron : cells.tetrahedra) {
    mesh::Tetrahedron& added = mesh.tetrahedra.emplace_back();
    std::transform(tetrahedron.begin(), tetrahedron.end(), added.begin(), vertex);
  }
}

// Numbers of the first vertices of the slabs, and the total. In a slab the net's vertices come
// first, then the droplets'.
std::vector<int64_t> NumberVertices(const Layers& layers,
                                    const std::vector<DropletCells>& droplets) {
  std::vector<int64_t> first_vertex(layers.slabs.size() + 1, 0);
  for (size_t s = 0; s < layers.slabs.size(); ++s) {
    first_vertex[s + 1] = layers.slabs[s].num_vertices();
  }
  for (const DropletCells& droplet : droplets) {
    for (const DropletPiece& piece : droplet.pieces) {
      first_vertex[SlabOf(layers, piece.time) + 1] += piece.vertices.cols();
    }
  }
  std::partial_sum(first_vertex.begin(), first_vertex.end(), first_vertex.begin());
  return first_vertex;
}

mesh::SpaceTimeMesh Assemble(const mesh::Animation& animation, const Layers& layers,
                             const std::vector<DropletCells>& droplets,
                             const std::vector<int64_t>& first_vertex, double edge_length_m) {
  mesh::SpaceTimeMesh mesh;
  mesh.num_frames = 1 + static_cast<int>(std::floor(animation.time(animation.num_frames() - 1)));
  mesh.num_pre_roll = animation.num_pre_roll;
  mesh.frames_per_second = animation.frames_per_second;
  mesh.up = animation.up;
  mesh.edge_length_m = edge_length_m;
  const size_t num_slabs = layers.slabs.size();
  mesh.num_first_vertices = first_vertex[1];
  mesh.num_last_vertices = first_vertex[num_slabs] - first_vertex[num_slabs - 1];
  const bool has_velocities = std::all_of(
      animation.frames.begin(), animation.frames.end(),
      [](const auto& frame) { return frame.velocities.cols() == frame.vertices.cols(); });
  mesh.vertices.resize(4, first_vertex.back());
  mesh.velocities.resize(3, has_velocities ? first_vertex.back() : 0);
  FillNetVertices(layers, first_vertex, mesh);
  std::vector<int64_t> next_vertex(num_slabs);
  for (size_t s = 0; s < num_slabs; ++s) {
    next_vertex[s] = first_vertex[s] + layers.slabs[s].num_vertices();
  }
  for (size_t n = 0; n < droplets.size(); ++n) {
    AddDroplet(droplets[n], layers, static_cast<int32_t>(n), next_vertex, mesh);
  }
  return mesh;
}

absl::StatusOr<mesh::SpaceTimeMesh> BuildNets(const mesh::Animation& animation,
                                              const BuildOptions& options, double edge_length_m,
                                              const parallel::Arena& arena,
                                              const std::function<void(double)>& progress) {
  const double droplet_area_m2 = options.DropletArea() * edge_length_m * edge_length_m;
  const DropletSplit split = SplitDroplets(animation, droplet_area_m2);
  const mesh::Animation& rest = split.rest ? *split.rest : animation;
  std::vector<DropletCells> droplets;
  for (const DropletTrack& track : split.tracks) droplets.push_back(MakeCells(track, animation));

  const double spacing_m = options.spacing_edges * edge_length_m;
  LB_ASSIGN_OR_RETURN(Layers layers,
                      SampleLayers(rest,
                                   {.spacing_m = spacing_m,
                                    .max_motion_m = options.max_motion_spacings * spacing_m,
                                    .keep_thin_sheets = options.keep_thin_sheets},
                                   arena, progress));
  KeepSheetOrder(arena, layers);
  const std::vector<int64_t> first_vertex = NumberVertices(layers, droplets);
  if (first_vertex.back() > std::numeric_limits<int32_t>::max()) {
    return base::MemoryLimitError(
        absl::StrCat("animation '", animation.name, "' needs ", first_vertex.back(),
                     " space-time vertices, more than 2^31: use a larger spacing"));
  }
  mesh::SpaceTimeMesh mesh = Assemble(animation, layers, droplets, first_vertex, edge_length_m);
  Hexahedra hexahedra = ConnectVertices(layers, first_vertex, arena);
  mesh.hexahedra = std::move(hexahedra.all);
  FlattenTimeExtrema(layers, first_vertex, mesh);
  const std::vector<FrameHexahedra> frames = FramesOf(rest, layers, hexahedra, mesh.hexahedra);
  layers = {};
  base::ReturnFreeMemory();  // of the layers, half as large as the mesh
  ComputeNormals(mesh, arena);
  MatchVolumes(frames, arena, mesh);
  if (progress) progress(1.0);
  return mesh;
}

// Builds the mesh of a tracked or a rebuilt animation.
absl::StatusOr<mesh::SpaceTimeMesh> BuildAs(const mesh::Animation& animation,
                                            const BuildOptions& options, double edge_length_m,
                                            const parallel::Arena& arena,
                                            const std::function<void(double)>& progress) {
  const TrackedOptions tracked_options;
  LB_ASSIGN_OR_RETURN(const Connectivity chosen, ChooseConnectivity(animation, options, arena));
  if (chosen == Connectivity::kRebuilt) {
    return BuildNets(animation, options, edge_length_m, arena, progress);
  }
  LB_ASSIGN_OR_RETURN(const TrackedLinks links, TrackLinks(animation, tracked_options, arena));
  return BuildTracked(animation, links, tracked_options, arena, progress);
}

}  // namespace

absl::Status BuildOptions::Validate() const {
  LB_RETURN_IF_ERROR(mesh::CheckRange("spacing_edges", spacing_edges, mesh::kSpacingEdges));
  if (!(max_motion_spacings >= 0.5)) {
    return absl::InvalidArgumentError(
        absl::StrCat("max_motion_spacings is ", max_motion_spacings, ", below 0.5"));
  }
  LB_RETURN_IF_ERROR(
      mesh::CheckRange("droplet_vertices", droplet_vertices, mesh::kDropletVertices));
  const double largest_scale = connectivity == Connectivity::kRebuilt ? kLargestEdgeScale : 1.0;
  LB_RETURN_IF_ERROR(mesh::CheckRange("edge_scale", edge_scale, {1, largest_scale}));
  return mesh::CheckRange("sheet_thickness_edges", sheet_thickness_edges,
                          mesh::kSheetThicknessEdges);
}

double BuildOptions::DropletArea() const { return droplet_vertices * kAreaPerVertex; }

absl::StatusOr<Connectivity> ChooseConnectivity(const mesh::Animation& animation,
                                                const BuildOptions& options,
                                                const parallel::Arena& arena) {
  LB_RETURN_IF_ERROR(options.Validate());
  if (options.connectivity != Connectivity::kAuto) return options.connectivity;
  LB_ASSIGN_OR_RETURN(const double share, MatchedShare(animation, TrackedOptions(), arena));
  return share >= kMinTrackedShare ? Connectivity::kTracked : Connectivity::kRebuilt;
}

absl::StatusOr<mesh::SpaceTimeMesh> Build(const mesh::Animation& animation,
                                          const BuildOptions& options, const parallel::Arena& arena,
                                          const std::function<void(double)>& progress) {
  LB_RETURN_IF_ERROR(options.Validate());
  const double edge_length_m = options.edge_scale * mesh::MeanEdgeLength(animation);
  if (animation.num_frames() < 2 || !(edge_length_m > 0)) {
    return absl::InvalidArgumentError(
        absl::StrCat("animation '", animation.name, "' has ", animation.num_frames(),
                     " frames and a mean edge length of ", edge_length_m,
                     " m; a space-time mesh needs at least 2 frames and some liquid"));
  }
  // For animations that were imported before these limits existed.
  LB_RETURN_IF_ERROR(mesh::CheckTimes(animation));
  LB_RETURN_IF_ERROR(mesh::CheckExtent(animation));
  LB_ASSIGN_OR_RETURN(mesh::SpaceTimeMesh mesh,
                      BuildAs(animation, options, edge_length_m, arena, progress));
  if (options.sheet_thickness_edges > 0) {
    FlagThinSheets(options.sheet_thickness_edges * edge_length_m, arena, mesh);
  }
  return mesh;
}

}  // namespace liquidblend::spacetime
