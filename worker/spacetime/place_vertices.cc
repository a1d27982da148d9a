#include <Eigen/Cholesky>
#include <algorithm>
#include <cassert>
#include <cmath>
#include <tuple>
#include <utility>

#include "worker/spacetime/cell_sheets.h"
#include "worker/spacetime/cut_cell.h"
#include "worker/spacetime/surface_nets.h"

namespace liquidblend::spacetime {
namespace {

constexpr float kTimeMargin = 0.05f;  // vertices stay this far from the layers, in slabs
// Steps towards the point where a cell's planes meet; each leaves directions that no plane holds
// nearly as they are.
constexpr int kMeetSteps = 3;
constexpr float kDamping = 0.05f;  // per plane

// The 16 signed distances at the corners of a 4D cell; bits of the index: x, y, z, t.
using Corners = std::array<float, 16>;

Eigen::Vector4f CornerOf(int c) {
  return Eigen::Vector4i(c & 1, c >> 1 & 1, c >> 2 & 1, c >> 3 & 1).cast<float>();
}

struct Cell {
  std::span<const Layer* const> layers;  // from its first to its last one
  int i, j, k;

  const Layer& LayerOf(int c) const { return (c & 8) != 0 ? *layers.back() : *layers.front(); }
  int x(int c) const { return i + (c & 1); }
  int y(int c) const { return j + (c >> 1 & 1); }
  int z(int c) const { return k + (c >> 2 & 1); }
};

Corners Sample(const Cell& cell) {
  Corners phi;
  for (int c = 0; c < 16; ++c) phi[c] = cell.LayerOf(c).Distance(cell.x(c), cell.y(c), cell.z(c));
  return phi;
}

// A margin in space would push walls that lie in a grid plane off it.
Eigen::Vector4f ClampToCell(const Eigen::Vector4f& p) {
  Eigen::Vector4f clamped = p.cwiseMax(0.0f).cwiseMin(1.0f);
  clamped.w() = std::clamp(clamped.w(), kTimeMargin, 1.0f - kTimeMargin);
  return clamped;
}

// Calls visit(axis, lower corner, upper corner) for each edge of a sheet.
template <typename Visit>
void ForEachEdge(uint32_t edges, Visit&& visit) {
  for (int axis = 0; axis < 4; ++axis) {
    for (int lower = 0; lower < 16; ++lower) {
      if ((lower >> axis & 1) != 0 || (edges >> CellEdge(axis, lower) & 1) == 0) continue;
      visit(axis, lower, lower | 1 << axis);
    }
  }
}

// The hyperplanes that touch the surface near a sheet, as normal equations of the point where they
// meet, and where its edges are crossed.
class Sheet {
 public:
  // Where the distance `phi` at `p`, continued along its gradient, is zero.
  void AddPlane(const Eigen::Vector4f& gradient, const Eigen::Vector4f& p, float phi) {
    const float length = gradient.norm();
    if (!(length > 1e-3f)) return;
    const Eigen::Vector4f normal = gradient / length;
    matrix_ += normal * normal.transpose();
    rhs_ += (gradient.dot(p) - phi) / length * normal;
    ++num_planes_;
  }

  // Of the edge between two points of opposite sign.
  void AddCrossing(const Eigen::Vector4f& lower, float phi_lower, const Eigen::Vector4f& upper,
                   float phi_upper) {
    crossings_ += lower + phi_lower / (phi_lower - phi_upper) * (upper - lower);
    ++num_crossings_;
  }

  // The point nearest to all planes in the least-squares sense, from the mean crossing: sharp edges
  // of the surface (walls meeting, say) keep their place, which the zero set of interpolated
  // distances rounds off.
  Eigen::Vector4f Meet() const {
    Eigen::Vector4f p = ClampToCell(crossings_ / static_cast<float>(num_crossings_));
    if (num_planes_ == 0) return p;
    const Eigen::Matrix4f damping =
        kDamping * static_cast<float>(num_planes_) * Eigen::Matrix4f::Identity();
    const Eigen::LLT<Eigen::Matrix4f> factor(matrix_ + damping);
    for (int step = 0; step < kMeetSteps; ++step) p += factor.solve(rhs_ - matrix_ * p);
    return ClampToCell(p);
  }

 private:
  Eigen::Matrix4f matrix_ = Eigen::Matrix4f::Zero();
  Eigen::Vector4f rhs_ = Eigen::Vector4f::Zero();
  Eigen::Vector4f crossings_ = Eigen::Vector4f::Zero();
  int num_planes_ = 0, num_crossings_ = 0;
};

// One plane for each end of a sheet's edges. The slope in time comes from the other layer.
Eigen::Vector4f MeetInCell(const Cell& cell, const Corners& phi, uint32_t edges) {
  Sheet sheet;
  uint32_t corners = 0;
  ForEachEdge(edges, [&](int, int lower, int upper) {
    corners |= uint32_t{1} << lower | uint32_t{1} << upper;
    sheet.AddCrossing(CornerOf(lower), phi[lower], CornerOf(upper), phi[upper]);
  });
  for (int c = 0; c < 16; ++c) {
    if ((corners >> c & 1) == 0) continue;
    Eigen::Vector4f gradient;
    gradient << cell.LayerOf(c).Gradient(cell.x(c), cell.y(c), cell.z(c)), phi[c | 8] - phi[c & 7];
    sheet.AddPlane(gradient, CornerOf(c), phi[c]);
  }
  return sheet.Meet();
}

// The same in a cell that is cut.
Eigen::Vector4f MeetInCutCell(const Cell& cell, const CutCell& cut, const Corners& phi,
                              const CutCellSheets& sheets, int wanted) {
  Sheet sheet;
  std::array<LayerMask, 8> ends = {};
  const auto distance = [&](int c, int layer) {
    return cell.layers[layer]->Distance(cell.x(c), cell.y(c), cell.z(c));
  };
  const auto point = [&](int c, int layer) {
    Eigen::Vector4f p = CornerOf(c);
    p.w() = static_cast<float>(layer) / static_cast<float>(cut.span);
    return p;
  };
  for (const CutCellEdge& edge : sheets.crossed) {
    if (sheets.sheet_of[IndexOf(edge)] != wanted) continue;
    const int c0 = edge.corner, l0 = edge.layer;
    const int c1 = edge.axis == 3 ? c0 : c0 | 1 << edge.axis;
    const int l1 = edge.axis == 3 ? NextLayer(cut.corner_layers[c0], l0) : l0;
    ends[c0] = static_cast<LayerMask>(ends[c0] | 1u << l0);
    ends[c1] = static_cast<LayerMask>(ends[c1] | 1u << l1);
    sheet.AddCrossing(point(c0, l0), distance(c0, l0), point(c1, l1), distance(c1, l1));
  }
  for (int c = 0; c < 8; ++c) {
    for (int l = 0; l <= cut.span; ++l) {
      if ((ends[c] >> l & 1) == 0) continue;
      Eigen::Vector4f gradient;
      gradient << cell.layers[l]->Gradient(cell.x(c), cell.y(c), cell.z(c)), phi[c | 8] - phi[c];
      sheet.AddPlane(gradient, point(c, l), distance(c, l));
    }
  }
  return sheet.Meet();
}

// Bits of the cells of row (j, k) that have both inside and outside corners among these layers.
void MixedCells(const Grid& grid, std::span<const InsideBits* const> layers, int j, int k,
                std::vector<uint64_t>& mixed) {
  const int num_words = grid.words_per_row();
  std::vector<uint64_t> any(num_words + 1, 0), all(num_words + 1, ~uint64_t{0});
  for (const InsideBits* layer : layers) {
    for (int r = 0; r < 4; ++r) {
      const uint64_t* row = layer->Row(j + (r & 1), k + (r >> 1));
      for (int w = 0; w < num_words; ++w) {
        any[w] |= row[w];
        all[w] &= row[w];
      }
    }
  }
  all[num_words] = 0;
  mixed.assign(num_words, 0);
  for (int w = 0; w < num_words; ++w) {
    const uint64_t any_next = any[w] >> 1 | any[w + 1] << 63;
    const uint64_t all_next = all[w] >> 1 | all[w + 1] << 63;
    mixed[w] = (any[w] | any_next) & ~(all[w] & all_next);
  }
}

// A cell of a row before its vertices are placed.
struct Found {
  int i, begin_layer, end_layer;
};

class Placer {
 public:
  Placer(const Grid& grid, std::span<const Layer* const> layers, SlabSteps steps)
      : grid_(grid), layers_(layers) {
    slab_.steps = std::move(steps);
    for (const Layer* layer : layers) inside_.push_back(&layer->inside());
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
        MixedCells(grid_, std::span(inside_).subspan(l, span + 1), j, k, mixed_);
        ForEachBit(mixed_.data(), grid_.words_per_row(), [&](int i) {
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
    const Cell cell{layers_.subspan(found.begin_layer, found.end_layer - found.begin_layer + 1),
                    found.i, j, k};
    Slab::Cell added{found.i,
                     static_cast<int32_t>(slab_.num_vertices()),
                     inside,
                     static_cast<uint8_t>(found.begin_layer),
                     static_cast<uint8_t>(found.end_layer),
                     0,
                     slab_.steps.IsBesideFiner(found.i, j, k)};
    if (added.is_cut) {
      const CutCell cut = GatherCutCell(slab_.steps, inside_, found.i, j, k, found.begin_layer);
      const CutCellSheets sheets = FindSheets(cut);
      if (sheets.count == 0) return;
      const Corners phi = Sample(cell);
      for (int n = 0; n < sheets.count; ++n) {
        AddVertex(cell, found, MeetInCutCell(cell, cut, phi, sheets, n));
      }
      added.num_sheets = static_cast<uint8_t>(sheets.count);
    } else {
      if (inside == 0 || inside == 0xffff) return;
      const Corners phi = Sample(cell);
      const CellSheets sheets = FindSheets(inside);
      for (int n = 0; n < sheets.count; ++n) {
        AddVertex(cell, found, MeetInCell(cell, phi, sheets.edges[n]));
      }
      added.num_sheets = static_cast<uint8_t>(sheets.count);
    }
    slab_.cells.push_back(added);
  }

  // `local` within the cell.
  void AddVertex(const Cell& cell, const Found& found, const Eigen::Vector4f& local) {
    Eigen::Vector4f p = local + Eigen::Vector4i(cell.i, cell.j, cell.k, 0).cast<float>();
    const auto begin = static_cast<float>(found.begin_layer);
    const auto span = static_cast<float>(found.end_layer - found.begin_layer);
    p.w() = (begin + span * local.w()) / static_cast<float>(slab_.steps.num_steps());
    slab_.vertices.push_back(p);
    if (!has_velocities_) return;
    const auto velocity = [&](const Layer& layer) {
      return layer.Velocity(cell.i, cell.j, cell.k, p.head<3>());
    };
    slab_.velocities.push_back((1.0f - local.w()) * velocity(*cell.layers.front()) +
                               local.w() * velocity(*cell.layers.back()));
  }

  const Grid& grid_;
  std::span<const Layer* const> layers_;
  std::vector<const InsideBits*> inside_;
  bool has_velocities_;
  Slab slab_;
  std::vector<Found> row_;
  std::vector<uint64_t> mixed_;
};

}  // namespace

uint16_t InsideCorners(const InsideBits& earlier, const InsideBits& later, int i, int j, int k) {
  unsigned bits = 0;
  for (int c = 0; c < 16; ++c) {
    const InsideBits& layer = (c & 8) != 0 ? later : earlier;
    if (layer.At(i + (c & 1), j + (c >> 1 & 1), k + (c >> 2 & 1))) bits |= 1u << c;
  }
  return static_cast<uint16_t>(bits);
}

Slab PlaceVertices(const Grid& grid, std::span<const Layer* const> layers, SlabSteps steps) {
  assert(static_cast<int>(layers.size()) == steps.num_steps() + 1);
  return Placer(grid, layers, std::move(steps)).Place();
}

}  // namespace liquidblend::spacetime
