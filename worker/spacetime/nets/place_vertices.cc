#include <algorithm>
#include <cassert>
#include <tuple>
#include <utility>

#include "worker/spacetime/nets/cell_vertices.h"
#include "worker/spacetime/nets/mixed_cells.h"
#include "worker/spacetime/nets/surface_nets.h"

namespace liquidblend::spacetime {
namespace {

// Distance from the cell's sides of the place to which a vertex outside of the cell may be drawn
// back, so that the sides of a thin sheet do not coincide.
constexpr float kInset = 0.15f;

// A cell of a row before its vertices are placed.
struct Found {
  int i, begin_layer, end_layer;
};

class Placer {
 public:
  Placer(const Grid& grid, std::span<const Layer* const> layers, SlabSteps steps, float motion)
      : grid_(grid), layers_(layers), motion_(motion) {
    slab_.steps = std::move(steps);
    for (const Layer* layer : layers) inside_.push_back(&layer->inside());
    for (int num_steps = 1; num_steps <= slab_.steps.num_steps(); num_steps *= 2) {
      const int span = slab_.steps.num_steps() / num_steps;
      for (int l = 0; l < slab_.steps.num_steps(); l += span) {
        mixed_.emplace_back(grid, std::span(inside_).subspan(l, span + 1));
      }
    }
    has_velocities_ = layers.front()->has_velocities() && layers.back()->has_velocities();
  }

  Slab Place() {
    slab_.row_begin.reserve(grid_.num_rows() + 1);
    for (int k = 0; k < grid_.dims[2]; ++k) {
      for (int j = 0; j < grid_.dims[1]; ++j) {
        slab_.row_begin.push_back(slab_.num_cells());
        if (j + 1 == grid_.dims[1] || k + 1 == grid_.dims[2]) continue;
        for (const Found& found : FindInRow(j, k)) Add(found, j, k);
      }
    }
    slab_.row_begin.push_back(slab_.num_cells());
    return std::move(slab_);
  }

 private:
  // Those that may have vertices, in order.
  const std::vector<Found>& FindInRow(int j, int k) {
    const SlabSteps& steps = slab_.steps;
    row_.clear();
    for (int num_steps = 1; num_steps <= steps.num_steps(); num_steps *= 2) {
      const int span = steps.num_steps() / num_steps;
      for (int l = 0; l < steps.num_steps(); l += span) {
        const std::vector<uint64_t>& mixed = mixed_[num_steps - 1 + l / span].Row(j, k);
        ForEachBit(mixed.data(), grid_.words_per_row(), [&](int i) {
          if (steps.OfVoxel(i, j, k) == num_steps) row_.push_back({i, l, l + span});
        });
      }
    }
    if (steps.num_steps() > 1) {
      std::sort(row_.begin(), row_.end(), [](const Found& a, const Found& b) {
        return std::tie(a.i, a.begin_layer) < std::tie(b.i, b.begin_layer);
      });
    }
    return row_;
  }

  void Add(const Found& found, int j, int k) {
    const uint16_t inside =
        InsideCorners(*inside_[found.begin_layer], *inside_[found.end_layer], found.i, j, k);
    const auto span = static_cast<float>(found.end_layer - found.begin_layer);
    const Cell cell(layers_.subspan(found.begin_layer, found.end_layer - found.begin_layer + 1),
                    found.i, j, k, span * motion_ / static_cast<float>(slab_.steps.num_steps()));
    Slab::Cell added{found.i,
                     static_cast<int32_t>(slab_.num_vertices()),
                     inside,
                     static_cast<uint8_t>(found.begin_layer),
                     static_cast<uint8_t>(found.end_layer),
                     0,
                     slab_.steps.IsBesideFiner(found.i, j, k)};
    if (added.is_cut) {
      PlaceInCutCell(cell,
                     GatherCutCell(slab_.steps, inside_, cell.i, cell.j, cell.k, found.begin_layer),
                     placed_);
    } else {
      PlaceInCell(cell, inside, placed_);
    }
    if (placed_.empty()) return;
    added.num_sheets = static_cast<uint8_t>(placed_.size());
    for (const Eigen::Vector4f& local : placed_) AddVertex(cell, found, local);
    slab_.cells.push_back(added);
  }

  // `local` within the cell.
  void AddVertex(const Cell& cell, const Found& found, const Eigen::Vector4f& local) {
    Eigen::Vector4f p = local + Eigen::Vector4i(cell.i, cell.j, cell.k, 0).cast<float>();
    const auto begin = static_cast<float>(found.begin_layer);
    const auto span = static_cast<float>(found.end_layer - found.begin_layer);
    p.w() = (begin + span * local.w()) / static_cast<float>(slab_.steps.num_steps());
    const auto in_space = local.head<3>().array();
    if ((in_space < 0.0f).any() || (in_space > 1.0f).any()) {
      const Eigen::Vector3f in_cell = in_space.max(kInset).min(1.0f - kInset);
      slab_.beyond.push_back({slab_.num_cells(), static_cast<int32_t>(slab_.num_vertices()),
                              in_cell + p.head<3>() - local.head<3>()});
    }
    slab_.vertices.push_back(p);
    if (!has_velocities_) return;
    const Eigen::Vector3f at = p.head<3>();
    slab_.velocities.push_back((1.0f - local.w()) * cell.first.Velocity(at) +
                               local.w() * cell.last.Velocity(at));
  }

  const Grid& grid_;
  std::span<const Layer* const> layers_;
  std::vector<const InsideBits*> inside_;
  float motion_;
  bool has_velocities_;
  Slab slab_;
  std::vector<Found> row_;
  std::vector<MixedCells> mixed_;        // of the whole slab, of its halves, ...
  std::vector<Eigen::Vector4f> placed_;  // of one cell
};

}  // namespace

const Slab::Cell* FindCell(const Grid& grid, const Slab& slab, int step, int i, int j, int k) {
  const int64_t row = grid.Row(j, k);
  const Slab::Cell* end = slab.cells.data() + slab.row_begin[row + 1];
  const Slab::Cell* found =
      std::lower_bound(slab.cells.data() + slab.row_begin[row], end, i,
                       [](const Slab::Cell& cell, int at) { return cell.i < at; });
  while (found != end && found->i == i && found->end_layer <= step) ++found;
  return found != end && found->i == i && found->begin_layer <= step ? found : nullptr;
}

const Slab::VertexBeyond* FindBeyond(const Slab& slab, int32_t vertex) {
  const auto at = std::lower_bound(
      slab.beyond.begin(), slab.beyond.end(), vertex,
      [](const Slab::VertexBeyond& beyond, int32_t v) { return beyond.vertex < v; });
  return at == slab.beyond.end() || at->vertex != vertex ? nullptr : &*at;
}

uint16_t InsideCorners(const InsideBits& earlier, const InsideBits& later, int i, int j, int k) {
  return static_cast<uint16_t>(earlier.AtCorners(i, j, k) | later.AtCorners(i, j, k) << 8);
}

Slab PlaceVertices(const Grid& grid, std::span<const Layer* const> layers, SlabSteps steps,
                   float motion) {
  assert(static_cast<int>(layers.size()) == steps.num_steps() + 1);
  return Placer(grid, layers, std::move(steps), motion).Place();
}

}  // namespace liquidblend::spacetime
