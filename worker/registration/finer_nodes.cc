#include "worker/registration/finer_nodes.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <span>
#include <utility>
#include <vector>

#include "core/base/status_macros.h"
#include "worker/registration/features/part_motions.h"
#include "worker/registration/fit/energy.h"
#include "worker/registration/fit/hard_pins.h"
#include "worker/registration/fit/match.h"
#include "worker/registration/surface/image_normals.h"

namespace liquidblend::registration {
namespace {

constexpr int kStride = 4;            // of the vertices whose distances are measured
constexpr int kCoarseTreeStride = 4;  // of the moved source's vertices to search from the target
constexpr float kTreeGap = 0.7f;      // edges; from the surface to the vertex next to a place on it
constexpr float kUnknown = 1.5f;      // edges; distance of vertices without a counterpart
constexpr size_t kFewest = 4;         // far vertices in a box; fewer are corners and noise
constexpr float kBox = 8.0f;          // edges and frames
// Most vertices of a cutout, as a multiple of those of coarse meshes: as many as are registered at
// once.
constexpr double kMaxVertices = 2.5;
constexpr double kFilled = 0.85;    // of that; less is not worth looking for more boxes
constexpr double kAim = 0.95;       // of that
constexpr size_t kFirstBoxes = 64;  // that are tried
constexpr int kGrowTries = 6;
constexpr int kRings = 6;          // of neighbours around the far vertices
constexpr int kHeldRings = 2;      // the outermost ones are held,
constexpr int kFadingRings = 4;    // from there on the fit counts more and more
constexpr int kNumRounds = 3;      // at most
constexpr double kEnough = 0.75;   // of the far vertices; if fewer fit there is another round
constexpr int kNumIterations = 4;  // in each of them
constexpr double kFirstSmoothness = 1.0;
constexpr double kTolerance = 1e-2;  // of the solver: the next iteration corrects it
constexpr double kSampleShare = 0.1;
constexpr int kTargetStride = 3;  // of the target's vertices that samples are drawn from
constexpr double kHold = 1.0;     // weight of a vertex of the rim

// For each source vertex, its distance from the target, or the target's distance from it if that is
// larger; 0 where not measured.
std::vector<float> Distances(const SurfacePair& pair, const Points& moved, const Points& normals,
                             const RegistrationOptions& options, const parallel::Arena& arena) {
  const auto largest = static_cast<float>(options.final_distance_edges);
  const Surface &source = pair.source, &target = pair.target;
  std::vector<float> distance(source.points.cols(), 0.0f);
  const auto is_inner = [](const Surface& surface, int64_t v) {
    return !surface.rigid[v] && !surface.InFirstSlab(v) && !surface.InLastSlab(v);
  };
  arena.For((moved.cols() + kStride - 1) / kStride, [&](int64_t n) {
    const int64_t v = n * kStride;
    if (!is_inner(source, v) || (source.InPreRoll(v) && moved(3, v) < 0)) return;
    const auto found = pair.target_search.Find(moved.col(v), normals.col(v));
    distance[v] = found ? std::min(largest, (found->position - moved.col(v)).norm()) : kUnknown;
  });
  std::vector<int32_t> inner;
  for (int32_t v = 0; v < moved.cols(); v += kCoarseTreeStride) {
    if (is_inner(source, v)) inner.push_back(v);
  }
  const PointTree tree(moved, inner, arena);
  const int64_t count = (target.points.cols() + kStride - 1) / kStride;
  std::vector<std::pair<int32_t, float>> of_target(count, {-1, 0.0f});
  arena.For(count, [&](int64_t n) {
    const Eigen::Vector4f c = target.points.col(n * kStride);
    std::array<int32_t, 1> nearest;
    if (!is_inner(target, n * kStride) || tree.Nearest(c, nearest) == 0) return;
    float shortest = (moved.col(nearest[0]) - c).norm();
    for (const int32_t w : pair.neighbors[nearest[0]]) {  // the tree holds only some vertices
      shortest = std::min(shortest, (moved.col(w) - c).norm());
    }
    of_target[n] = {nearest[0], shortest - kTreeGap};
  });
  for (const auto& [v, far] : of_target) {
    if (v >= 0) distance[v] = std::max(distance[v], std::min(largest, far));
  }
  return distance;
}

// Vertices that are far from the target, in boxes of kBox edges and frames, the worst box first.
std::vector<std::vector<int32_t>> FarBoxes(const Points& moved, const std::vector<float>& distance,
                                           double from) {
  struct Box {
    double excess = 0.0;
    std::vector<int32_t> vertices = {};
  };
  std::map<std::array<int, 4>, Box> boxes;
  for (int32_t v = 0; v < moved.cols(); ++v) {
    if (!(distance[v] > from)) continue;
    std::array<int, 4> key;
    for (int k = 0; k < 4; ++k) key[k] = static_cast<int>(std::floor(moved(k, v) / kBox));
    Box& box = boxes[key];
    box.excess += distance[v] - from;
    box.vertices.push_back(v);
  }
  std::vector<Box> sorted;
  for (auto& [key, box] : boxes) {
    if (box.vertices.size() >= kFewest) sorted.push_back(std::move(box));
  }
  std::stable_sort(sorted.begin(), sorted.end(),
                   [](const Box& a, const Box& b) { return a.excess > b.excess; });
  std::vector<std::vector<int32_t>> result;
  for (Box& box : sorted) result.push_back(std::move(box.vertices));
  return result;
}

// Region that is registered again.
struct Region {
  // Per vertex: number of rings around it within the region, itself included; 0: outside.
  std::vector<char> depth;
  int64_t num_vertices = 0;
  bool is_enough = true;  // has most of the far vertices
};

Region Grow(const SurfacePair& pair, std::span<const std::vector<int32_t>> boxes) {
  Region region{std::vector<char>(pair.source.points.cols(), 0)};
  std::vector<int32_t> front, next;
  for (const std::vector<int32_t>& box : boxes) front.insert(front.end(), box.begin(), box.end());
  for (const int32_t v : front) region.depth[v] = static_cast<char>(kRings + 1);
  region.num_vertices = static_cast<int64_t>(front.size());
  for (int ring = kRings; ring >= 1; --ring) {
    next.clear();
    for (const int32_t v : front) {
      for (const int32_t w : pair.neighbors[v]) {
        if (region.depth[w] != 0 || pair.source.rigid[w]) continue;
        region.depth[w] = static_cast<char>(ring);
        next.push_back(w);
      }
    }
    front.swap(next);
    region.num_vertices += static_cast<int64_t>(front.size());
  }
  return region;
}

size_t NumFar(std::span<const std::vector<int32_t>> boxes) {
  size_t num_far = 0;
  for (const std::vector<int32_t>& box : boxes) num_far += box.size();
  return num_far;
}

// Grows a region around the worst boxes, as many as about fit.
Region GrowWithin(const SurfacePair& pair, std::span<const std::vector<int32_t>> boxes,
                  double max_vertices) {
  Region best = Grow(pair, {});
  size_t fits = 0, too_many = boxes.size() + 1, tried = std::min(boxes.size(), kFirstBoxes);
  for (int n = 0; tried > fits && tried < too_many && (n < kGrowTries || fits == 0); ++n) {
    Region region = Grow(pair, boxes.first(tried));
    const double share = static_cast<double>(region.num_vertices) / max_vertices;
    if (share <= 1) {
      fits = tried;
      best = std::move(region);
      if (share >= kFilled) break;
    } else {
      too_many = tried;
    }
    // The share grows less than the number of boxes, as they overlap more and more: more of them
    // fit than predicted.
    const double predicted = kAim * static_cast<double>(tried) / std::max(share, 1e-3);
    tried = std::clamp(static_cast<size_t>(predicted), fits + 1, std::max(fits + 1, too_many - 1));
  }
  best.is_enough = static_cast<double>(NumFar(boxes.first(fits))) >=
                   kEnough * static_cast<double>(NumFar(boxes));
  return best;
}

template <typename Cells>
void CopyCells(const Cells& from, const std::vector<int32_t>& part_of, Cells& to) {
  for (auto cell : from) {
    if (std::any_of(cell.begin(), cell.end(), [&](int32_t v) { return part_of[v] < 0; })) continue;
    for (int32_t& v : cell) v = part_of[v];
    to.push_back(cell);
  }
}

// Cutout: the vertices of a region, as a mesh of its own.
struct Cutout {
  std::vector<int32_t> vertices;  // of the source, ascending
  std::vector<char> depth;        // as Grow() says, per vertex of the cutout
  mesh::SpaceTimeMesh mesh;       // as moved
};

Cutout CutOut(const Surface& source, const Points& moved, const Points& normals,
              const std::vector<char>& depth) {
  Cutout cutout;
  std::vector<int32_t> part_of(depth.size(), -1);
  for (int32_t v = 0; v < static_cast<int32_t>(depth.size()); ++v) {
    if (depth[v] == 0) continue;
    part_of[v] = static_cast<int32_t>(cutout.vertices.size());
    cutout.vertices.push_back(v);
    cutout.depth.push_back(depth[v]);
    cutout.mesh.num_first_vertices += source.InFirstSlab(v) ? 1 : 0;
    cutout.mesh.num_last_vertices += source.InLastSlab(v) ? 1 : 0;
    if (!source.mesh.thin.empty()) cutout.mesh.thin.push_back(source.mesh.thin[v]);
  }
  cutout.mesh.vertices = moved(Eigen::all, cutout.vertices);
  cutout.mesh.normals = normals(Eigen::all, cutout.vertices);
  CopyCells(source.mesh.hexahedra, part_of, cutout.mesh.hexahedra);
  CopyCells(source.mesh.wedges, part_of, cutout.mesh.wedges);
  CopyCells(source.mesh.pyramids, part_of, cutout.mesh.pyramids);
  CopyCells(source.mesh.tetrahedra, part_of, cutout.mesh.tetrahedra);
  cutout.mesh.num_frames = source.mesh.num_frames;
  cutout.mesh.num_pre_roll = source.mesh.num_pre_roll;
  cutout.mesh.edge_length_m = 1.0;  // the vertices are in edges
  return cutout;
}

// Finds some of the target's vertices that are nearer to the cutout than to the rest of the source.
std::vector<int32_t> TargetOf(const SurfacePair& pair, const Points& moved,
                              const std::vector<char>& depth, const parallel::Arena& arena) {
  std::vector<int32_t> all = pair.source.FreeVertices(), strided;
  for (size_t n = 0; n < all.size(); n += kCoarseTreeStride) strided.push_back(all[n]);
  const PointTree tree(moved, strided, arena);
  const std::vector<int32_t> every = pair.target.FreeVertices();
  std::vector<int32_t> candidates;
  for (size_t n = 0; n < every.size(); n += kTargetStride) candidates.push_back(every[n]);
  std::vector<char> is_near(candidates.size(), 0);
  arena.For(static_cast<int64_t>(candidates.size()), [&](int64_t n) {
    std::array<int32_t, 1> nearest;
    const Eigen::Vector4f c = pair.target.points.col(candidates[n]);
    is_near[n] = tree.Nearest(c, nearest) > 0 && depth[nearest[0]] > kHeldRings;
  });
  std::vector<int32_t> result;
  for (size_t n = 0; n < candidates.size(); ++n) {
    if (is_near[n]) result.push_back(candidates[n]);
  }
  return result;
}

void HoldRim(const Cutout& cutout, std::vector<FitTerm>& terms) {
  for (size_t v = 0; v < cutout.vertices.size(); ++v) {
    if (cutout.depth[v] > kHeldRings) continue;
    terms.push_back({static_cast<int32_t>(v), Eigen::Vector4f::Zero(),
                     Eigen::Matrix4f(kHold * Eigen::Matrix4f::Identity())});
  }
}

// Registers the cutout with nodes of its own and adds the result to the displacement. Returns the
// number of nodes.
absl::StatusOr<int> Fit(const SurfacePair& pair, const Cutout& cutout,
                        std::vector<int32_t> target_vertices, const RegistrationOptions& options,
                        const parallel::Arena& arena, Points& displacement) {
  Surface surface(cutout.mesh, 1.0, arena);
  if (!pair.source.open.empty()) {
    for (const int32_t v : cutout.vertices) surface.open.push_back(pair.source.open[v]);
  }
  const PackedLists neighbors = VertexNeighbors(cutout.mesh, surface.cells_around, arena);
  const DeformationNodes nodes(surface.points, neighbors, options.NodeSpacing(), {}, options.seed,
                               arena);
  const NodeGraph graph(nodes);
  const PartMotions none;  // vertices that are far do not follow one
  Matcher matcher(surface, neighbors, pair.target, pair.target_search, none, options.seed,
                  std::move(target_vertices));
  const MatchOptions match_options{.drawn_share = kSampleShare,
                                   .kept_share = options.kept_share,
                                   .max_distance = options.final_distance_edges,
                                   .point_weight = options.point_weight,
                                   .plane_weight = options.plane_weight};
  SolverOptions solver_options{.tolerance = kTolerance, .max_direct_rows = options.max_direct_rows};
  std::vector<NodeMap> maps(nodes.num_nodes(), NodeMap::Zero());
  for (int n = 0; n < kNumIterations; ++n) {
    Matches matches = matcher.Match(nodes, maps, match_options, arena);
    HoldRim(cutout, matches.terms);
    const double f = n / (kNumIterations - 1.0);
    solver_options.smoothness = kFirstSmoothness * options.SmoothnessFactor(kFirstSmoothness, f);
    LB_RETURN_IF_ERROR(Minimize(nodes, graph, surface.points, matches.terms, HardPins(),
                                solver_options, arena, maps)
                           .status());
  }
  const Points fitted = Deform(nodes, maps, surface.points, arena);
  for (size_t v = 0; v < cutout.vertices.size(); ++v) {
    const float inside = static_cast<float>(cutout.depth[v] - kHeldRings) / kFadingRings;
    displacement.col(cutout.vertices[v]) +=
        std::clamp(inside, 0.0f, 1.0f) * (fitted.col(v) - surface.points.col(v));
  }
  return static_cast<int>(nodes.num_nodes());
}

// The cutout of a round, and the target's vertices that belong to it.
struct FarPart {
  Cutout cutout;
  std::vector<int32_t> target_vertices;
  bool is_enough;  // has most of the far vertices
};

FarPart FindFarPart(const SurfacePair& pair, const Points& displacement,
                    const RegistrationOptions& options, const parallel::Arena& arena) {
  const Points moved = pair.source.points + displacement;
  const Points normals = ImageNormals(pair.source, pair.neighbors, displacement, 1, arena);
  const auto boxes =
      FarBoxes(moved, Distances(pair, moved, normals, options, arena), options.finer_from_edges);
  const Region region = GrowWithin(pair, boxes, kMaxVertices * options.coarse_vertices);
  FarPart part{CutOut(pair.source, moved, normals, region.depth), {}, region.is_enough};
  if (part.cutout.mesh.num_cells() > 0) {
    part.target_vertices = TargetOf(pair, moved, region.depth, arena);
  }
  return part;
}

}  // namespace

absl::Status RefineUnderfitRegions(const SurfacePair& pair, const RegistrationOptions& options,
                                   const parallel::Arena& arena, const std::function<void()>& keep,
                                   SharpenState& state) {
  while (state.num_rounds < kNumRounds) {
    FarPart part = FindFarPart(pair, state.displacement, options, arena);
    if (part.cutout.mesh.num_cells() == 0) break;
    LB_ASSIGN_OR_RETURN(const int added, Fit(pair, part.cutout, std::move(part.target_vertices),
                                             options, arena, state.displacement));
    state.num_finer_nodes += added;
    state.num_rounds = part.is_enough ? kNumRounds : state.num_rounds + 1;
    keep();
  }
  return absl::OkStatus();
}

}  // namespace liquidblend::registration
