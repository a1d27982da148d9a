#include "worker/spacetime/sheet_order.h"

#include <Eigen/Core>
#include <algorithm>
#include <vector>

#include "worker/spacetime/line_crossings.h"
#include "worker/spacetime/liquid_boxes.h"
#include "worker/spacetime/point_grid.h"

namespace liquidblend::spacetime {
namespace {

constexpr int kNumDraws = 4;  // equal steps back into the cell
constexpr int kRaysPerSpacing = 3;
constexpr float kReach = 1.0f;  // spacings; what is this near to liquid inside out is drawn back
// Where more than this share of the vertices around is, a sheet is torn rather than whole, and the
// rest follows.
constexpr float kTornShare = 0.45f;
constexpr float kAround = 4.0f;  // spacings

// A vertex outside of its cell.
struct FreeVertex {
  int slab;
  int32_t vertex;
  Eigen::Vector3f place, in_cell;  // where it was, where it may go
  int num_draws = 0;
};

void SortUnique(std::vector<size_t>& indices) {
  std::sort(indices.begin(), indices.end());
  indices.erase(std::unique(indices.begin(), indices.end()), indices.end());
}

Eigen::Matrix3Xf Joined(const std::vector<Eigen::Vector3f>& points) {
  Eigen::Matrix3Xf joined(3, static_cast<int64_t>(points.size()));
  for (size_t p = 0; p < points.size(); ++p) joined.col(static_cast<int64_t>(p)) = points[p];
  return joined;
}

// Adds the places where rays along an axis, through a closed surface in ray spacings, touch a
// winding number below 0.
void AddInverted(const Grid& rays, const GridSurface& surface, int axis,
                 std::vector<Eigen::Vector3f>& places) {
  const GridLines lines(rays, axis);
  std::vector<Crossing> crossings;
  for (int64_t t = 0; t < surface.triangles.cols(); ++t) {
    CrossLines(surface, t, lines, NthLineShift(0), crossings);
  }
  std::sort(crossings.begin(), crossings.end(), [](const Crossing& a, const Crossing& b) {
    if (a.line != b.line) return a.line < b.line;
    return a.at != b.at ? a.at < b.at : a.winding > b.winding;
  });
  int winding = 0;
  for (size_t n = 0; n < crossings.size(); ++n) {
    const Crossing& crossing = crossings[n];
    if (n > 0 && crossing.line != crossings[n - 1].line) winding = 0;
    const int before = winding;
    winding += crossing.winding;
    if (std::min(before, winding) >= 0) continue;
    Eigen::Vector3f& place = places.emplace_back();
    place[axis] = static_cast<float>(crossing.at);
    place[lines.u] = static_cast<float>(crossing.line % lines.num_u);
    place[lines.v] = static_cast<float>(crossing.line / lines.num_u);
  }
}

class SheetOrder {
 public:
  SheetOrder(const parallel::Arena& arena, Layers& layers)
      : arena_(arena), layers_(layers), boxes_(FindBoxFaces(layers, arena)) {
    for (size_t s = 0; s < layers.slabs.size(); ++s) {
      first_free_.push_back(free_.size());
      for (const Slab::VertexBeyond& beyond : layers.slabs[s].beyond) {
        free_.push_back({static_cast<int>(s), beyond.vertex,
                         layers.slabs[s].vertices[beyond.vertex].head<3>(), beyond.in_cell});
      }
    }
    for (const BoxFaces& boxes : boxes_) {
      std::vector<size_t>& of_layer = free_of_.emplace_back();
      for (const auto* corners : {&boxes.before, &boxes.after}) {
        for (const BoxCorner& corner : *corners) AddIfFree(corner, of_layer);
      }
      SortUnique(of_layer);
    }
  }

  int64_t Keep() {
    std::vector<char> moved(layers_.slabs.size(), 1);
    for (;;) {
      std::vector<size_t> near = FindNearInverted(moved);
      moved.assign(moved.size(), 0);
      if (near.empty()) {
        near = FindTorn();
        if (near.empty()) break;
        for (const size_t f : near) free_[f].num_draws = kNumDraws - 1;
      }
      for (const size_t f : near) {
        DrawBack(free_[f]);
        moved[free_[f].slab] = 1;
      }
    }
    return std::count_if(free_.begin(), free_.end(),
                         [](const FreeVertex& free) { return free.num_draws > 0; });
  }

 private:
  void AddIfFree(const BoxCorner& corner, std::vector<size_t>& found) const {
    const auto& beyond = layers_.slabs[corner.slab].beyond;
    const auto at = std::lower_bound(
        beyond.begin(), beyond.end(), corner.vertex,
        [](const Slab::VertexBeyond& b, int32_t vertex) { return b.vertex < vertex; });
    if (at == beyond.end() || at->vertex != corner.vertex) return;
    found.push_back(first_free_[corner.slab] + static_cast<size_t>(at - beyond.begin()));
  }

  Eigen::Vector3f PlaceOf(const FreeVertex& free) const {
    return layers_.slabs[free.slab].vertices[free.vertex].head<3>();
  }

  void DrawBack(FreeVertex& free) {
    const float share = static_cast<float>(++free.num_draws) / kNumDraws;
    layers_.slabs[free.slab].vertices[free.vertex].head<3>() =
        free.place + share * (free.in_cell - free.place);
  }

  // The vertices that can be drawn back and are near liquid inside out, in slabs where some moved.
  std::vector<size_t> FindNearInverted(const std::vector<char>& moved) const {
    std::vector<std::vector<size_t>> of_layer(boxes_.size());
    arena_.Run(static_cast<int64_t>(boxes_.size()), [&](int64_t n) {
      const int layer = boxes_[n].layer;
      if (moved[layers_.SlabOf(layer - 1)] == 0 && moved[layers_.SlabOf(layer)] == 0) return;
      const Eigen::Matrix3Xf inverted = Joined(FindInverted(boxes_[n]));
      if (inverted.cols() == 0) return;
      const PointGrid grid(inverted, kReach);
      for (const size_t f : free_of_[n]) {
        bool is_near = false;
        grid.ForEachNear(PlaceOf(free_[f]), [&](int32_t) { is_near = true; });
        if (is_near && free_[f].num_draws < kNumDraws) of_layer[n].push_back(f);
      }
    });
    return Join(of_layer);
  }

  // Those that are not in their cells among others most of which are.
  std::vector<size_t> FindTorn() const {
    std::vector<std::vector<size_t>> of_layer(boxes_.size());
    arena_.Run(static_cast<int64_t>(boxes_.size()), [&](int64_t n) {
      std::vector<Eigen::Vector3f> places;
      for (const size_t f : free_of_[n]) places.push_back(free_[f].place);
      const PointGrid grid(Joined(places), kAround);
      for (const size_t f : free_of_[n]) {
        if (free_[f].num_draws == kNumDraws) continue;
        int count = -1, draws = -free_[f].num_draws;  // without itself
        grid.ForEachNear(free_[f].place, [&](int32_t near) {
          ++count;
          draws += free_[free_of_[n][near]].num_draws;
        });
        if (static_cast<float>(draws) > kTornShare * kNumDraws * static_cast<float>(count)) {
          of_layer[n].push_back(f);
        }
      }
    });
    return Join(of_layer);
  }

  static std::vector<size_t> Join(const std::vector<std::vector<size_t>>& of_layer) {
    std::vector<size_t> all;
    for (const auto& some : of_layer) all.insert(all.end(), some.begin(), some.end());
    SortUnique(all);
    return all;
  }

  // Grid units and frames.
  Eigen::Vector4f At(const BoxCorner& corner) const {
    if (corner.vertex < 0) return corner.place;
    Eigen::Vector4f p = layers_.slabs[corner.slab].vertices[corner.vertex];
    const double begin = layers_.begin(corner.slab), end = layers_.end(corner.slab);
    p.w() = static_cast<float>(begin + p.w() * (end - begin));
    return p;
  }

  // From half of the longest step before the layer to half of the longest one after it.
  std::vector<double> TimesAround(int layer) const {
    const double time = layers_.plan.layers[layer].time;
    std::vector<double> times = {time};
    for (const int sign : {-1, 1}) {
      const int s = layers_.SlabOf(sign < 0 ? layer - 1 : layer);
      const int num_steps = layers_.plan.num_steps(s), l = layer - layers_.plan.first_layer[s];
      const double step = (layers_.end(s) - layers_.begin(s)) / num_steps;
      times.push_back(time + sign * 0.25 * step);
      for (int span = 1; span <= num_steps && l % span == 0; span *= 2) {
        times.push_back(time + sign * 0.5 * span * step);
      }
    }
    return times;
  }

  // Places in grid units.
  std::vector<Eigen::Vector3f> FindInverted(const BoxFaces& boxes) const {
    std::vector<Eigen::Vector4f> before, after;
    for (const BoxCorner& corner : boxes.before) before.push_back(At(corner));
    for (const BoxCorner& corner : boxes.after) after.push_back(At(corner));
    GridSurface surface;
    surface.vertices.resize(3, static_cast<int64_t>(before.size()));
    surface.triangles.resize(3, 2 * static_cast<int64_t>(boxes.faces.size()));
    for (size_t f = 0; f < boxes.faces.size(); ++f) {
      const std::array<int, 4>& face = boxes.faces[f];
      surface.triangles.col(2 * f) << face[0], face[1], face[2];
      surface.triangles.col(2 * f + 1) << face[0], face[2], face[3];
    }
    Grid rays = layers_.grid;
    for (int& dim : rays.dims) dim *= kRaysPerSpacing;
    std::vector<Eigen::Vector3f> places;
    for (const double time : TimesAround(boxes.layer)) {
      for (size_t v = 0; v < before.size(); ++v) {
        const double length = after[v].w() - before[v].w();
        const double share = length > 0 ? std::clamp((time - before[v].w()) / length, 0.0, 1.0) : 0;
        const Eigen::Vector4f p = before[v] + static_cast<float>(share) * (after[v] - before[v]);
        surface.vertices.col(v) = kRaysPerSpacing * p.head<3>();
      }
      for (int axis = 0; axis < 3; ++axis) AddInverted(rays, surface, axis, places);
    }
    for (Eigen::Vector3f& place : places) place /= kRaysPerSpacing;
    return places;
  }

  const parallel::Arena& arena_;
  Layers& layers_;
  std::vector<BoxFaces> boxes_;
  std::vector<FreeVertex> free_;              // slab by slab
  std::vector<size_t> first_free_;            // per slab
  std::vector<std::vector<size_t>> free_of_;  // per layer of boxes_: those at corners
};

}  // namespace

int64_t KeepSheetOrder(const parallel::Arena& arena, Layers& layers) {
  return SheetOrder(arena, layers).Keep();
}

}  // namespace liquidblend::spacetime
