#include "worker/spacetime/field/line_crossings.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace liquidblend::spacetime {
namespace {

// From vertex a to vertex b in the u-v plane. Seen from the one of lower index, so that the two
// triangles at an edge see exactly opposite values.
class ProjectedEdge {
 public:
  ProjectedEdge(const Eigen::Matrix3Xf& vertices, const GridLines& lines, int a, int b)
      : swap_(a > b) {
    const int lo = swap_ ? b : a, hi = swap_ ? a : b;
    u_ = vertices(lines.u, lo);
    v_ = vertices(lines.v, lo);
    along_u_ = vertices(lines.u, hi) - u_;
    along_v_ = vertices(lines.v, hi) - v_;
  }
  // Twice the signed area of (a, b, p); never 0.
  double Side(double pu, double pv) const {
    const double side = along_u_ * (pv - v_) - along_v_ * (pu - u_);
    const double strict = side == 0.0 ? 1e-300 : side;
    return swap_ ? -strict : strict;
  }

 private:
  bool swap_;
  double u_, v_, along_u_, along_v_;
};

// A triangle that lines may cross.
class Crossed {
 public:
  Crossed(const GridSurface& surface, int64_t t, const GridLines& lines)
      : triangle_(static_cast<int32_t>(t)),
        ab_(surface.vertices, lines, surface.triangles(0, t), surface.triangles(1, t)),
        bc_(surface.vertices, lines, surface.triangles(1, t), surface.triangles(2, t)),
        ca_(surface.vertices, lines, surface.triangles(2, t), surface.triangles(0, t)) {
    for (int c = 0; c < 3; ++c) at_[c] = surface.vertices(lines.axis, surface.triangles(c, t));
  }

  void CrossAt(int64_t line, double pu, double pv, std::vector<Crossing>& crossings) const {
    const double side_c = ab_.Side(pu, pv), side_a = bc_.Side(pu, pv);
    if ((side_a > 0) != (side_c > 0)) return;
    const double side_b = ca_.Side(pu, pv);
    if ((side_b > 0) != (side_c > 0)) return;
    const double sum = side_a + side_b + side_c;
    const double at = (side_a * at_[0] + side_b * at_[1] + side_c * at_[2]) / sum;
    // Positive: the normal points along the axis.
    crossings.push_back({line, at, side_c > 0 ? -1 : 1, triangle_});
  }

 private:
  int32_t triangle_;
  ProjectedEdge ab_, bc_, ca_;
  std::array<double, 3> at_;  // of the corners, along the lines
};

}  // namespace

LineShift NthLineShift(int n) {
  return {1e-6 * (1.4142135 + 3.7 * n), 1e-6 * (0.7320508 + 2.3 * n)};
}

void CrossLine(const GridSurface& surface, int64_t t, const GridLines& lines, int64_t line,
               LineShift shift, std::vector<Crossing>& crossings) {
  Crossed(surface, t, lines)
      .CrossAt(line, static_cast<double>(line % lines.num_u) + shift.u,
               static_cast<double>(line / lines.num_u) + shift.v, crossings);
}

void CrossLines(const GridSurface& surface, int64_t t, const GridLines& lines, LineShift shift,
                std::vector<Crossing>& crossings) {
  Eigen::Matrix3f corners;
  for (int c = 0; c < 3; ++c) corners.col(c) = surface.vertices.col(surface.triangles(c, t));
  const Eigen::Vector3f lo = corners.rowwise().minCoeff(), hi = corners.rowwise().maxCoeff();
  const int u_end = std::min(lines.num_u - 1, static_cast<int>(std::floor(hi[lines.u])));
  const int v_end = std::min(lines.num_v - 1, static_cast<int>(std::floor(hi[lines.v])));
  const int u_begin = std::max(0, static_cast<int>(std::ceil(lo[lines.u] - 1e-3f)));
  const int v_begin = std::max(0, static_cast<int>(std::ceil(lo[lines.v] - 1e-3f)));
  if (u_begin > u_end || v_begin > v_end) return;
  const Crossed triangle(surface, t, lines);
  for (int v = v_begin; v <= v_end; ++v) {
    for (int u = u_begin; u <= u_end; ++u) {
      triangle.CrossAt(lines.Line(u, v), u + shift.u, v + shift.v, crossings);
    }
  }
}

}  // namespace liquidblend::spacetime
