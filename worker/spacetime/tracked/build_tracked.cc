#include "worker/spacetime/tracked/build_tracked.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "absl/strings/str_cat.h"
#include "core/base/data_limit.h"
#include "core/base/status_macros.h"
#include "worker/spacetime/field/normals.h"
#include "worker/spacetime/tracked/fill_patch.h"
#include "worker/spacetime/tracked/track_cells.h"

namespace liquidblend::spacetime {
namespace {

constexpr int kSampledSteps = 8;  // of MatchedShare

// Layer l is frame l - 1; the first and the last one are the first and the last frame, moved by a
// frame of their velocities. Step s leads from layer s to layer s + 1.
class TrackedLayers {
 public:
  explicit TrackedLayers(const mesh::Animation& animation) : animation_(animation) {
    before_ = Moved(animation.frames.front(), -1.0 / animation.frames_per_second);
    after_ = Moved(animation.frames.back(), 1.0 / animation.frames_per_second);
  }

  int num_layers() const { return animation_.num_frames() + 2; }
  int num_steps() const { return num_layers() - 1; }
  bool IsEnd(int step) const { return step == 0 || step == num_steps() - 1; }

  const mesh::TriangleMesh& layer(int l) const {
    if (l == 0) return before_;
    return l == num_layers() - 1 ? after_ : animation_.frames[l - 1];
  }
  double time(int l) const {
    if (l == 0) return -1.0;
    if (l == num_layers() - 1) return animation_.time(animation_.num_frames() - 1) + 1.0;
    return animation_.time(l - 1);
  }
  FramePair pair(int step) const {
    return {&layer(step), &layer(step + 1),
            (time(step + 1) - time(step)) / animation_.frames_per_second};
  }

 private:
  static mesh::TriangleMesh Moved(mesh::TriangleMesh frame, double step_s) {
    if (frame.velocities.cols() > 0) {
      frame.vertices += static_cast<float>(step_s) * frame.velocities;
    }
    return frame;
  }

  const mesh::Animation& animation_;
  mesh::TriangleMesh before_;
  mesh::TriangleMesh after_;
};

absl::Status CheckAnimation(const mesh::Animation& animation, double edge_length_m) {
  if (animation.num_frames() >= 2 && edge_length_m > 0) return absl::OkStatus();
  return absl::InvalidArgumentError(
      absl::StrCat("animation '", animation.name, "' has ", animation.num_frames(),
                   " frames and a mean edge length of ", edge_length_m,
                   " m; a space-time mesh needs at least 2 frames and some liquid"));
}

FrameLinks LinkStep(const mesh::Animation& animation, int k, double edge_length_m,
                    const TrackedOptions& options) {
  const double step_s = (animation.time(k + 1) - animation.time(k)) / animation.frames_per_second;
  return LinkFrames(animation.frames[k], animation.frames[k + 1],
                    {step_s, edge_length_m, options.reach_edges});
}

double Share(int64_t part, int64_t whole) {
  return whole == 0 ? 1.0 : static_cast<double>(part) / static_cast<double>(whole);
}

double MovingShare(const std::vector<FrameLinks>& steps) {
  int64_t num_matched = 0;
  int64_t num_moving = 0;
  for (const FrameLinks& links : steps) {
    num_matched += links.num_moving_matched;
    num_moving += links.num_moving;
  }
  return Share(num_matched, num_moving);
}

void FindLowestShare(const mesh::Animation& animation, TrackedLinks& links) {
  for (int k = 0; k + 1 < animation.num_frames(); ++k) {
    const double share =
        Share(2 * links.steps[k].num_matched,
              animation.frames[k].num_triangles() + animation.frames[k + 1].num_triangles());
    if (share >= links.lowest_share) continue;
    links.lowest_share = share;
    links.lowest_step = k;
  }
}

template <typename Cell>
void SortByLowestVertex(std::vector<Cell>& cells) {
  std::stable_sort(cells.begin(), cells.end(), [](const Cell& a, const Cell& b) {
    return *std::min_element(a.begin(), a.end()) < *std::min_element(b.begin(), b.end());
  });
}

// Numbers of a pair of frames -> numbers of the mesh. The lowest vertex of each cell lies in the
// earlier frame or was added, so cells of successive steps stay in the order of those.
struct Numbering {
  int32_t num_earlier, num_given;
  int64_t first_earlier, first_later, first_added;

  int32_t operator()(int32_t v) const {
    if (v < num_earlier) return static_cast<int32_t>(first_earlier + v);
    if (v < num_given) return static_cast<int32_t>(first_later + v - num_earlier);
    return static_cast<int32_t>(first_added + v - num_given);
  }

  template <typename Cell>
  void Apply(std::vector<Cell>& cells) const {
    for (Cell& cell : cells) {
      for (int32_t& v : cell) v = (*this)(v);
    }
    SortByLowestVertex(cells);
  }
};

// Vertices by layer: those of layer l, then those added in step l.
std::vector<int64_t> FirstVertices(const TrackedLayers& layers,
                                   const std::vector<PairCells>& cells) {
  std::vector<int64_t> first = {0};
  for (int l = 0; l < layers.num_layers(); ++l) {
    const auto num_added = l < layers.num_steps() ? static_cast<int64_t>(cells[l].added.size()) : 0;
    first.push_back(first.back() + layers.layer(l).num_vertices() + num_added);
  }
  return first;
}

template <typename Cell>
void Append(std::vector<Cell>& of_step, std::vector<Cell>& all) {
  all.insert(all.end(), of_step.begin(), of_step.end());
  of_step = {};
}

void FillVertices(const TrackedLayers& layers, const std::vector<PairCells>& cells,
                  const std::vector<int64_t>& first, mesh::SpaceTimeMesh& mesh) {
  bool has_velocities = true;
  for (int l = 0; l < layers.num_layers(); ++l) {
    const mesh::TriangleMesh& layer = layers.layer(l);
    has_velocities = has_velocities && layer.velocities.cols() == layer.num_vertices();
  }
  mesh.vertices.resize(4, first.back());
  mesh.velocities.resize(3, has_velocities ? first.back() : 0);
  for (int l = 0; l < layers.num_layers(); ++l) {
    const mesh::TriangleMesh& layer = layers.layer(l);
    const int64_t count = layer.num_vertices();
    auto block = mesh.vertices.middleCols(first[l], count);
    block.topRows<3>() = layer.vertices;
    block.row(3).setConstant(static_cast<float>(layers.time(l)));
    if (has_velocities) mesh.velocities.middleCols(first[l], count) = layer.velocities;
    if (l == layers.num_steps()) break;
    const auto half_way = static_cast<float>(0.5 * (layers.time(l) + layers.time(l + 1)));
    int64_t v = first[l] + count;
    for (const AddedVertex& added : cells[l].added) {
      mesh.vertices.col(v) << added.position_m, half_way;
      if (has_velocities) mesh.velocities.col(v) = added.velocity;
      ++v;
    }
  }
}

// One step's cells, in numbers of the pair.
PairCells ConnectPair(const FramePair& pair, const FrameLinks& links, const FillOptions& options) {
  PairCells cells;
  AddWedges(pair, links, cells);
  for (const std::vector<Facet>& patch : FindPatches(pair, links)) {
    FillPatch(pair, patch, options, cells);
  }
  return cells;
}

void FillCells(const TrackedLayers& layers, const std::vector<int64_t>& first,
               std::vector<PairCells>& cells, const parallel::Arena& arena,
               mesh::SpaceTimeMesh& mesh) {
  arena.Run(layers.num_steps(), [&](int64_t s) {
    const FramePair pair = layers.pair(static_cast<int>(s));
    const Numbering number = {pair.num_earlier(), pair.num_given(), first[s], first[s + 1],
                              first[s] + pair.num_earlier()};
    number.Apply(cells[s].wedges);
    number.Apply(cells[s].pyramids);
    number.Apply(cells[s].tetrahedra);
  });
  for (PairCells& of_step : cells) {
    Append(of_step.wedges, mesh.wedges);
    Append(of_step.pyramids, mesh.pyramids);
    Append(of_step.tetrahedra, mesh.tetrahedra);
  }
}

// Links of a frame to itself.
FrameLinks LinksToItself(const mesh::TriangleMesh& frame) {
  return LinkFrames(frame, frame, LinkOptions());
}

}  // namespace

absl::Status TrackedOptions::Validate() const {
  const auto check = [](const char* field, double value, double low, double high) {
    if (value >= low && value <= high) return absl::OkStatus();
    return absl::InvalidArgumentError(
        absl::StrCat(field, " is ", value, ", not in [", low, ", ", high, "]"));
  };
  LB_RETURN_IF_ERROR(check("reach_edges", reach_edges, 0.1, 8));
  LB_RETURN_IF_ERROR(check("cone_radius_edges", cone_radius_edges, 0, 64));
  return check("anchor_edges", anchor_edges, 0.5, 16);
}

absl::StatusOr<double> MatchedShare(const mesh::Animation& animation, const TrackedOptions& options,
                                    const parallel::Arena& arena) {
  LB_RETURN_IF_ERROR(options.Validate());
  const double edge_length_m = mesh::MeanEdgeLength(animation);
  LB_RETURN_IF_ERROR(CheckAnimation(animation, edge_length_m));
  const int num_steps = animation.num_frames() - 1;
  const int num_samples = std::min(num_steps, kSampledSteps);
  std::vector<FrameLinks> samples(num_samples);
  arena.Run(num_samples, [&](int64_t n) {
    const int k = static_cast<int>(n) * num_steps / num_samples;
    samples[n] = LinkStep(animation, k, edge_length_m, options);
  });
  return MovingShare(samples);
}

absl::StatusOr<TrackedLinks> TrackLinks(const mesh::Animation& animation,
                                        const TrackedOptions& options,
                                        const parallel::Arena& arena) {
  LB_RETURN_IF_ERROR(options.Validate());
  const double edge_length_m = mesh::MeanEdgeLength(animation);
  LB_RETURN_IF_ERROR(CheckAnimation(animation, edge_length_m));
  TrackedLinks links;
  links.steps.resize(animation.num_frames() - 1);
  arena.Run(animation.num_frames() - 1, [&](int64_t k) {
    links.steps[k] = LinkStep(animation, static_cast<int>(k), edge_length_m, options);
  });
  links.matched_share = MovingShare(links.steps);
  FindLowestShare(animation, links);
  return links;
}

absl::StatusOr<mesh::SpaceTimeMesh> BuildTracked(const mesh::Animation& animation,
                                                 const TrackedLinks& links,
                                                 const TrackedOptions& options,
                                                 const parallel::Arena& arena,
                                                 const std::function<void(double)>& progress) {
  LB_RETURN_IF_ERROR(options.Validate());
  const double edge_length_m = mesh::MeanEdgeLength(animation);
  LB_RETURN_IF_ERROR(CheckAnimation(animation, edge_length_m));
  const TrackedLayers layers(animation);
  const FillOptions fill = {options.cone_radius_edges * edge_length_m,
                            options.anchor_edges * edge_length_m};
  std::vector<PairCells> cells(layers.num_steps());
  arena.Run(layers.num_steps(), [&](int64_t s) {
    const int step = static_cast<int>(s);
    cells[s] = layers.IsEnd(step)
                   ? ConnectPair(layers.pair(step), LinksToItself(layers.layer(step)), fill)
                   : ConnectPair(layers.pair(step), links.steps[s - 1], fill);
  });
  if (progress) progress(0.5);
  const std::vector<int64_t> first = FirstVertices(layers, cells);
  if (first.back() > std::numeric_limits<int32_t>::max()) {
    return base::MemoryLimitError(absl::StrCat("animation '", animation.name, "' needs ",
                                               first.back(),
                                               " space-time vertices, more than 2^31"));
  }
  mesh::SpaceTimeMesh mesh;
  // Slices reach to the last whole frame.
  mesh.num_frames =
      static_cast<int>(std::floor(animation.time(animation.num_frames() - 1) + 1e-6)) + 1;
  mesh.frames_per_second = animation.frames_per_second;
  mesh.up = animation.up;
  mesh.edge_length_m = edge_length_m;
  mesh.num_first_vertices = layers.layer(0).num_vertices();
  mesh.num_last_vertices = layers.layer(layers.num_layers() - 1).num_vertices();
  FillVertices(layers, cells, first, mesh);
  FillCells(layers, first, cells, arena, mesh);
  ComputeNormals(mesh, arena);
  if (progress) progress(1.0);
  return mesh;
}

}  // namespace liquidblend::spacetime
