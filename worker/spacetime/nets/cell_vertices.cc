#include "worker/spacetime/nets/cell_vertices.h"

#include <algorithm>
#include <array>
#include <bit>

#include "worker/spacetime/nets/cell_sheets.h"

namespace liquidblend::spacetime {
namespace {

constexpr float kTimeMargin = 0.05f;  // vertices stay this far from the layers, in slabs
// Steps towards the point where a cell's planes meet; each leaves directions that no plane holds
// nearly as they are.
constexpr int kMeetSteps = 3;
constexpr float kDamping = 0.05f;  // per plane
// The sides of a thin sheet may be further from its points than the points are from one another.
constexpr float kBeyondCell = 1.5f;
constexpr float kLeastGradient = 1e-3f;
constexpr float kMinSlope = 0.1f;  // of a plane in space

// Bits of the index: x, y, z, t.
const std::array<Eigen::Vector4f, 16> kCorners = [] {
  std::array<Eigen::Vector4f, 16> corners;
  for (int c = 0; c < 16; ++c) {
    corners[c] = Eigen::Vector4i(c & 1, c >> 1 & 1, c >> 2 & 1, c >> 3).cast<float>();
  }
  return corners;
}();

// A margin in space would push walls that lie in a grid plane off it.
//   beyond  how far outside of the cell it may be in space
Eigen::Vector4f ClampToCell(const Eigen::Vector4f& p, float beyond = 0.0f) {
  Eigen::Vector4f clamped = p.cwiseMax(-beyond).cwiseMin(1.0f + beyond);
  clamped.w() = std::clamp(clamped.w(), kTimeMargin, 1.0f - kTimeMargin);
  return clamped;
}

// Calls visit(axis, lower corner, upper corner) for each edge of a sheet.
template <typename Visit>
void ForEachEdge(uint32_t edges, Visit&& visit) {
  for (; edges != 0; edges &= edges - 1) {
    const int edge = std::countr_zero(edges), axis = AxisOf(edge), lower = LowerEnd(edge);
    visit(axis, lower, lower | 1 << axis);
  }
}

// Solves matrix * x = rhs for a symmetric, positive definite matrix.
class SolverOf4 {
 public:
  explicit SolverOf4(const Eigen::Matrix4f& matrix) {
    std::array<std::array<float, 4>, 4> scaled;  // the factor times the diagonal
    for (int c = 0; c < 4; ++c) {
      float pivot = matrix(c, c);
      for (int m = 0; m < c; ++m) pivot -= factor_[c][m] * scaled[c][m];
      inverse_[c] = 1.0f / pivot;
      for (int r = c + 1; r < 4; ++r) {
        scaled[r][c] = matrix(r, c);
        for (int m = 0; m < c; ++m) scaled[r][c] -= factor_[r][m] * scaled[c][m];
        factor_[r][c] = scaled[r][c] * inverse_[c];
      }
    }
  }
  Eigen::Vector4f Solve(Eigen::Vector4f x) const {
    for (int r = 1; r < 4; ++r) {
      for (int c = 0; c < r; ++c) x[r] -= factor_[r][c] * x[c];
    }
    for (int r = 3; r >= 0; --r) {
      x[r] *= inverse_[r];
      for (int c = r + 1; c < 4; ++c) x[r] -= factor_[c][r] * x[c];
    }
    return x;
  }

 private:
  // matrix = factor * diagonal * factor^T with ones on the factor's diagonal.
  std::array<std::array<float, 4>, 4> factor_;
  std::array<float, 4> inverse_;  // of the diagonal
};

// The hyperplanes that touch the surface near a sheet, as normal equations of the point where they
// meet.
class Planes {
 public:
  // Where the distance `phi` at `p`, continued along its gradient, is zero.
  void Add(const Eigen::Vector4f& gradient, const Eigen::Vector4f& p, float phi) {
    const float length_sq = gradient.squaredNorm();
    if (!(length_sq > kLeastGradient * kLeastGradient)) return;
    AddPlane(gradient, gradient.dot(p) - phi, 1.0f / length_sq);
  }
  // One that stands still, through p.
  void AddStill(const Eigen::Vector3f& normal, const Eigen::Vector3f& p) {
    const float length = normal.norm();
    if (!(length > kMinSlope)) return;
    Eigen::Vector4f unit = Eigen::Vector4f::Zero();
    unit.head<3>() = normal / length;
    AddPlane(unit, unit.head<3>().dot(p), 1.0f);
  }
  bool empty() const { return count_ == 0; }

  // The point nearest to all planes in the least-squares sense, from p: sharp edges of the surface
  // (walls meeting, say) keep their place, which the zero set of interpolated distances rounds off.
  Eigen::Vector4f Meet(Eigen::Vector4f p, float beyond = 0.0f) const {
    if (count_ == 0) return p;
    const Eigen::Matrix4f damping =
        kDamping * static_cast<float>(count_) * Eigen::Matrix4f::Identity();
    const SolverOf4 solver(matrix_ + damping);
    for (int step = 0; step < kMeetSteps; ++step) p += solver.Solve(rhs_ - matrix_ * p);
    return ClampToCell(p, beyond);
  }

 private:
  // Where normal * x = offset.
  void AddPlane(const Eigen::Vector4f& normal, float offset, float inverse_sq_of_normal) {
    const Eigen::Vector4f scaled = inverse_sq_of_normal * normal;
    matrix_ += scaled * normal.transpose();
    rhs_ += offset * scaled;
    ++count_;
  }

  Eigen::Matrix4f matrix_ = Eigen::Matrix4f::Zero();
  Eigen::Vector4f rhs_ = Eigen::Vector4f::Zero();
  int count_ = 0;
};

// The mean of points.
class Mean {
 public:
  void Add(const Eigen::Vector4f& p) {
    sum_ += p;
    ++count_;
  }
  // Of the zero crossing between two points of opposite sign.
  void AddCrossing(const Eigen::Vector4f& lower, float phi_lower, const Eigen::Vector4f& upper,
                   float phi_upper) {
    Add(lower + phi_lower / (phi_lower - phi_upper) * (upper - lower));
  }
  Eigen::Vector4f Get() const { return sum_ / static_cast<float>(count_); }

 private:
  Eigen::Vector4f sum_ = Eigen::Vector4f::Zero();
  int count_ = 0;
};

// One plane for each end of a sheet's edges. The slope in time comes from the other layer.
Eigen::Vector4f MeetInCell(const Cell& cell, uint32_t edges) {
  Mean crossing;
  uint32_t corners = 0;
  ForEachEdge(edges, [&](int, int lower, int upper) {
    corners |= uint32_t{1} << lower | uint32_t{1} << upper;
    crossing.AddCrossing(kCorners[lower], cell.Distance(lower), kCorners[upper],
                         cell.Distance(upper));
  });
  Planes planes;
  for (; corners != 0; corners &= corners - 1) {
    const int c = std::countr_zero(corners);
    Eigen::Vector4f gradient;
    gradient << cell.Gradient(c), cell.Distance(c | 8) - cell.Distance(c & 7);
    planes.Add(gradient, kCorners[c], cell.Distance(c));
  }
  return planes.Meet(ClampToCell(crossing.Get()));
}

// A crossed edge from (corner, layer) up to another corner or a later layer of the cell.
struct Edge {
  int axis;
  int lower_corner, upper_corner;  // bits x, y, z
  int lower_layer, upper_layer;
  bool lower_is_inside;
};

// A corner of the cell at one of its layers.
class CellPoints {
 public:
  explicit CellPoints(const Cell& cell) : cell_(cell) {}
  int span() const { return static_cast<int>(cell_.layers.size()) - 1; }
  Eigen::Vector4f At(int corner, int layer) const {
    Eigen::Vector4f p = kCorners[corner];
    p.w() = static_cast<float>(layer) / static_cast<float>(span());
    return p;
  }
  float Distance(int corner, int layer) const {
    if (layer == 0) return cell_.first.Distance(corner);
    if (layer == span()) return cell_.last.Distance(corner);
    return cell_.layers[layer]->Distance(cell_.x(corner), cell_.y(corner), cell_.z(corner));
  }
  Eigen::Vector3f Gradient(int corner, int layer) const {
    if (layer == 0) return cell_.first.Gradient(corner);
    if (layer == span()) return cell_.last.Gradient(corner);
    return cell_.layers[layer]->Gradient(cell_.x(corner), cell_.y(corner), cell_.z(corner));
  }
  bool has_velocities() const {
    return cell_.layers.front()->has_velocities() && cell_.layers.back()->has_velocities();
  }
  // Of the surface nearest to the point, from the cell's first to its last layer.
  Eigen::Vector3f Motion(int corner, int layer) const {
    return cell_.motion *
           cell_.layers[layer]->SurfaceVelocity(cell_.x(corner), cell_.y(corner), cell_.z(corner));
  }
  float SheetThickness(int corner, int layer) const {
    return cell_.layers[layer]->SheetThickness(cell_.x(corner), cell_.y(corner), cell_.z(corner));
  }

 private:
  const Cell& cell_;
};

// Calls visit(corner, layer) once for each end of the edges, in their order.
template <typename Visit>
void ForEachEnd(std::span<const Edge> edges, Visit&& visit) {
  std::array<LayerMask, 8> ends = {};
  for (const Edge& edge : edges) {
    ends[edge.lower_corner] |= static_cast<LayerMask>(1u << edge.lower_layer);
    ends[edge.upper_corner] |= static_cast<LayerMask>(1u << edge.upper_layer);
  }
  for (int c = 0; c < 8; ++c) {
    for (unsigned rest = ends[c]; rest != 0; rest &= rest - 1) visit(c, std::countr_zero(rest));
  }
}

// As MeetInCell, in a cell that is cut.
Eigen::Vector4f MeetInCutCell(const CellPoints& points, std::span<const Edge> edges) {
  Mean crossing;
  for (const Edge& edge : edges) {
    crossing.AddCrossing(points.At(edge.lower_corner, edge.lower_layer),
                         points.Distance(edge.lower_corner, edge.lower_layer),
                         points.At(edge.upper_corner, edge.upper_layer),
                         points.Distance(edge.upper_corner, edge.upper_layer));
  }
  Planes planes;
  ForEachEnd(edges, [&](int c, int l) {
    Eigen::Vector4f gradient;
    gradient << points.Gradient(c, l), points.Distance(c, points.span()) - points.Distance(c, 0);
    planes.Add(gradient, points.At(c, l), points.Distance(c, l));
  });
  return planes.Meet(ClampToCell(crossing.Get()));
}

// For a thin sheet, whose sides must not be mistaken for one another: on the side that the edges
// lead to, and half-way in time, so that slices have no other parts and holes than the layers.
Eigen::Vector4f PlaceOnSide(const CellPoints& points, std::span<const Edge> edges,
                            float thickness) {
  Eigen::Vector3f outward = Eigen::Vector3f::Zero();
  Mean middle;
  for (const Edge& edge : edges) {
    const Eigen::Vector4f lower = points.At(edge.lower_corner, edge.lower_layer),
                          upper = points.At(edge.upper_corner, edge.upper_layer);
    middle.Add(0.5f * (lower + upper));
    if (edge.axis < 3) {
      outward[edge.axis] += edge.lower_is_inside ? 1.0f : -1.0f;
    } else {
      outward += edge.lower_is_inside ? points.Gradient(edge.upper_corner, edge.upper_layer)
                                      : points.Gradient(edge.lower_corner, edge.lower_layer);
    }
  }
  Planes planes;
  for (const bool nearest : {true, false}) {
    if (!planes.empty()) break;
    ForEachEnd(edges, [&](int c, int l) {
      const float sign = points.Gradient(c, l).dot(outward) > 0 ? 1.0f : -1.0f;
      if (nearest != (sign > 0)) return;
      const Eigen::Vector3f normal = sign * points.Gradient(c, l);
      const auto to_side = [&](int layer) {
        const float phi = points.Distance(c, layer);
        return points.Gradient(c, layer).dot(outward) > 0 ? phi : -phi - thickness;
      };
      const Eigen::Vector4f p = points.At(c, l);
      Eigen::Vector3f foot = p.head<3>() - to_side(l) * normal;
      if (points.has_velocities()) {
        foot += (0.5f - p.w()) * points.Motion(c, l);
      } else {
        foot -= (0.5f - p.w()) * (to_side(points.span()) - to_side(0)) * normal;
      }
      planes.AddStill(normal, foot);
    });
  }
  Eigen::Vector4f from = middle.Get();
  from.w() = 0.5f;
  return planes.Meet(from, kBeyondCell);
}

std::vector<Edge> EdgesOf(uint32_t edges, uint16_t inside, int span) {
  std::vector<Edge> list;
  ForEachEdge(edges, [&](int axis, int lower, int upper) {
    list.push_back({axis, lower & 7, upper & 7, (lower & 8) != 0 ? span : 0,
                    (upper & 8) != 0 ? span : 0, (inside >> lower & 1) != 0});
  });
  return list;
}

std::vector<Edge> EdgesOf(const CutCell& cut, const CutCellSheets& sheets, int sheet) {
  std::vector<Edge> list;
  for (const CutCellEdge& edge : sheets.crossed) {
    if (sheets.sheet_of[IndexOf(edge)] != sheet) continue;
    const bool in_time = edge.axis == 3;
    list.push_back({edge.axis, edge.corner, in_time ? edge.corner : edge.corner | 1 << edge.axis,
                    edge.layer,
                    in_time ? NextLayer(cut.corner_layers[edge.corner], edge.layer) : edge.layer,
                    (cut.corner_inside[edge.corner] >> edge.layer & 1) != 0});
  }
  return list;
}

// The mean thickness of thin sheets at the cell's corners; 0: there are none.
//   inside  of a corner: the layers at which it is
template <typename Inside>
float SheetThickness(const Cell& cell, Inside&& inside) {
  if (std::none_of(cell.layers.begin(), cell.layers.end(),
                   [&](const Layer* layer) { return layer->HasSheetPoints(cell.j, cell.k); })) {
    return 0;
  }
  const CellPoints points(cell);
  float sum = 0;
  int count = 0;
  for (int c = 0; c < 8; ++c) {
    for (unsigned rest = inside(c); rest != 0; rest &= rest - 1) {
      const float thickness = points.SheetThickness(c, std::countr_zero(rest));
      sum += thickness;
      count += thickness > 0 ? 1 : 0;
    }
  }
  return count > 0 ? sum / static_cast<float>(count) : 0;
}

}  // namespace

void PlaceInCell(const Cell& cell, uint16_t inside, std::vector<Eigen::Vector4f>& placed) {
  placed.clear();
  if (inside == 0 || inside == 0xffff) return;
  const CellPoints points(cell);
  const float thickness = SheetThickness(cell, [&](int c) {
    return static_cast<LayerMask>((inside >> c & 1) | (inside >> (c + 8) & 1) << points.span());
  });
  const auto place = [&](uint32_t edges) {
    placed.push_back(thickness > 0
                         ? PlaceOnSide(points, EdgesOf(edges, inside, points.span()), thickness)
                         : MeetInCell(cell, edges));
  };
  if (NumSheets(inside) == 1) {
    place(CrossedEdges(inside));
    return;
  }
  const CellSheets sheets = FindSheets(inside);
  for (int n = 0; n < sheets.count; ++n) place(sheets.edges[n]);
}

void PlaceInCutCell(const Cell& cell, const CutCell& cut, std::vector<Eigen::Vector4f>& placed) {
  placed.clear();
  const CutCellSheets sheets = FindSheets(cut);
  const CellPoints points(cell);
  const float thickness = SheetThickness(cell, [&](int c) { return cut.corner_inside[c]; });
  for (int n = 0; n < sheets.count; ++n) {
    const std::vector<Edge> edges = EdgesOf(cut, sheets, n);
    placed.push_back(thickness > 0 ? PlaceOnSide(points, edges, thickness)
                                   : MeetInCutCell(points, edges));
  }
}

}  // namespace liquidblend::spacetime
