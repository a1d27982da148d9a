#include "worker/spacetime/sheets/sheet_order.h"

#include <Eigen/Core>
#include <algorithm>
#include <memory>
#include <utility>
#include <vector>

#include "worker/spacetime/field/point_grid.h"
#include "worker/spacetime/sheets/inverted_rays.h"
#include "worker/spacetime/sheets/liquid_boxes.h"

namespace liquidblend::spacetime {
namespace {

constexpr int kNumDraws = 4;       // equal steps back into the cell
constexpr float kDrawBack = 1.0f;  // spacings; what is this near to liquid inside out is drawn back
// If more than this share of the vertices around are back in their cells, the sheet counts as torn,
// and the others follow.
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

class SheetOrder {
 public:
  SheetOrder(const parallel::Arena& arena, Layers& layers) : arena_(arena), layers_(layers) {
    for (size_t s = 0; s < layers.slabs.size(); ++s) {
      first_free_.push_back(free_.size());
      for (const Slab::VertexBeyond& beyond : layers.slabs[s].beyond) {
        free_.push_back({static_cast<int>(s), beyond.vertex,
                         layers.slabs[s].vertices[beyond.vertex].head<3>(), beyond.in_cell});
      }
    }
    std::vector<BoxFaces> boxes = FindBoxFaces(layers, arena);
    of_layer_.resize(boxes.size());
    arena.Run(static_cast<int64_t>(boxes.size()), [&](int64_t n) {
      of_layer_[n] = std::make_unique<OfLayer>(layers, std::move(boxes[n]));
      FindFree(*of_layer_[n]);
    });
  }

  int64_t Keep() {
    std::vector<char> moved(free_.size(), 1);
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
        moved[f] = 1;
      }
    }
    return std::count_if(free_.begin(), free_.end(),
                         [](const FreeVertex& free) { return free.num_draws > 0; });
  }

 private:
  // A layer with boxes, and the free vertices at their corners.
  struct OfLayer {
    OfLayer(const Layers& layers, BoxFaces boxes) : rays(layers, std::move(boxes)) {}
    InvertedRays rays;
    std::vector<std::pair<size_t, int>> corners;  // a free vertex at a corner of the boxes
    std::vector<size_t> free;                     // those at corners, ascending
    bool is_new = true;
  };

  void FindFree(OfLayer& of_layer) const {
    for (const auto* corners : {&of_layer.rays.boxes().before, &of_layer.rays.boxes().after}) {
      for (size_t c = 0; c < corners->size(); ++c) {
        const BoxCorner& corner = (*corners)[c];
        if (corner.vertex < 0) continue;
        const Slab& slab = layers_.slabs[corner.slab];
        const Slab::VertexBeyond* beyond = FindBeyond(slab, corner.vertex);
        if (beyond == nullptr) continue;
        const size_t f = first_free_[corner.slab] + (beyond - slab.beyond.data());
        of_layer.corners.emplace_back(f, static_cast<int>(c));
        of_layer.free.push_back(f);
      }
    }
    SortUnique(of_layer.free);
  }

  Eigen::Vector3f PlaceOf(const FreeVertex& free) const {
    return layers_.slabs[free.slab].vertices[free.vertex].head<3>();
  }

  void DrawBack(FreeVertex& free) {
    const float share = static_cast<float>(++free.num_draws) / kNumDraws;
    layers_.slabs[free.slab].vertices[free.vertex].head<3>() =
        free.place + share * (free.in_cell - free.place);
  }

  // The vertices that can be drawn back and are near liquid inside out, in layers where some moved.
  std::vector<size_t> FindNearInverted(const std::vector<char>& moved) {
    std::vector<std::vector<size_t>> near(of_layer_.size());
    arena_.Run(static_cast<int64_t>(of_layer_.size()), [&](int64_t n) {
      OfLayer& of_layer = *of_layer_[n];
      if (!Update(of_layer, moved)) return;
      const Eigen::Matrix3Xf inverted = of_layer.rays.Places();
      if (inverted.cols() == 0) return;
      const PointGrid grid(inverted, kDrawBack);
      for (const size_t f : of_layer.free) {
        bool is_near = false;
        grid.ForEachNear(PlaceOf(free_[f]), [&](int32_t) { is_near = true; });
        if (is_near && free_[f].num_draws < kNumDraws) near[n].push_back(f);
      }
    });
    return Join(near);
  }

  // Looks again if any of the layer's vertices have moved; whether any have.
  bool Update(OfLayer& of_layer, const std::vector<char>& moved) const {
    std::vector<char> has_moved(of_layer.rays.boxes().before.size(), of_layer.is_new ? 1 : 0);
    bool any = std::exchange(of_layer.is_new, false);
    for (const auto& [f, corner] : of_layer.corners) {
      if (moved[f] == 0) continue;
      has_moved[corner] = 1;
      any = true;
    }
    if (any) of_layer.rays.Update(layers_, has_moved);
    return any;
  }

  // Vertices outside of their cells whose neighbours are mostly back in theirs.
  std::vector<size_t> FindTorn() const {
    std::vector<std::vector<size_t>> torn(of_layer_.size());
    arena_.Run(static_cast<int64_t>(of_layer_.size()), [&](int64_t n) {
      const std::vector<size_t>& of_layer = of_layer_[n]->free;
      std::vector<Eigen::Vector3f> places;
      for (const size_t f : of_layer) places.push_back(free_[f].place);
      const PointGrid grid(Joined(places), kAround);
      for (const size_t f : of_layer) {
        if (free_[f].num_draws == kNumDraws) continue;
        int count = -1, draws = -free_[f].num_draws;  // without itself
        grid.ForEachNear(free_[f].place, [&](int32_t near) {
          ++count;
          draws += free_[of_layer[near]].num_draws;
        });
        if (static_cast<float>(draws) > kTornShare * kNumDraws * static_cast<float>(count)) {
          torn[n].push_back(f);
        }
      }
    });
    return Join(torn);
  }

  static std::vector<size_t> Join(const std::vector<std::vector<size_t>>& of_layer) {
    std::vector<size_t> all;
    for (const auto& some : of_layer) all.insert(all.end(), some.begin(), some.end());
    SortUnique(all);
    return all;
  }

  const parallel::Arena& arena_;
  Layers& layers_;
  std::vector<FreeVertex> free_;    // slab by slab
  std::vector<size_t> first_free_;  // per slab
  std::vector<std::unique_ptr<OfLayer>> of_layer_;
};

}  // namespace

int64_t KeepSheetOrder(const parallel::Arena& arena, Layers& layers) {
  return SheetOrder(arena, layers).Keep();
}

}  // namespace liquidblend::spacetime
