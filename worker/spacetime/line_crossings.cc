#include "worker/spacetime/line_crossings.h"

#include <algorithm>
#include <cmath>

namespace liquidblend::spacetime {
namespace {

// Twice the signed area of (a, b, p) in the u-v plane. Evaluated from the vertex of lower index, so
// that the two triangles at an edge see exactly opposite values.
double EdgeSide(const Eigen::Matrix3Xf& vertices, const GridLines& lines, int a, int b, double pu,
                double pv) {
  const bool swap = a > b;
  const int lo = swap ? b : a, hi = swap ? a : b;
  const double au = vertices(lines.u, lo), av = vertices(lines.v, lo);
  const double bu = vertices(lines.u, hi), bv = vertices(lines.v, hi);
  const double side = (bu - au) * (pv - av) - (bv - av) * (pu - au);
  const double strict = side == 0.0 ? 1e-300 : side;
  return swap ? -strict : strict;
}

void CrossAt(const GridSurface& surface, int64_t t, const GridLines& lines, int64_t line, double pu,
             double pv, std::vector<Crossing>& crossings) {
  const int a = surface.triangles(0, t), b = surface.triangles(1, t), c = surface.triangles(2, t);
  const double side_c = EdgeSide(surface.vertices, lines, a, b, pu, pv);
  const double side_a = EdgeSide(surface.vertices, lines, b, c, pu, pv);
  const double side_b = EdgeSide(surface.vertices, lines, c, a, pu, pv);
  const bool positive = side_a > 0 && side_b > 0 && side_c > 0;
  const bool negative = side_a < 0 && side_b < 0 && side_c < 0;
  if (!positive && !negative) return;
  const double sum = side_a + side_b + side_c;
  const double at =
      (side_a * surface.vertices(lines.axis, a) + side_b * surface.vertices(lines.axis, b) +
       side_c * surface.vertices(lines.axis, c)) /
      sum;
  // Positive: the normal points along the axis.
  crossings.push_back({line, at, positive ? -1 : 1, static_cast<int32_t>(t)});
}

}  // namespace

LineShift NthLineShift(int n) {
  return {1e-6 * (1.4142135 + 3.7 * n), 1e-6 * (0.7320508 + 2.3 * n)};
}

void CrossLine(const GridSurface& surface, int64_t t, const GridLines& lines, int64_t line,
               LineShift shift, std::vector<Crossing>& crossings) {
  CrossAt(surface, t, lines, line, static_cast<double>(line % lines.num_u) + shift.u,
          static_cast<double>(line / lines.num_u) + shift.v, crossings);
}

void CrossLines(const GridSurface& surface, int64_t t, const GridLines& lines, LineShift shift,
                std::vector<Crossing>& crossings) {
  Eigen::Matrix3f corners;
  for (int c = 0; c < 3; ++c) corners.col(c) = surface.vertices.col(surface.triangles(c, t));
  const Eigen::Vector3f lo = corners.rowwise().minCoeff(), hi = corners.rowwise().maxCoeff();
  const int u_end = std::min(lines.num_u - 1, static_cast<int>(std::floor(hi[lines.u])));
  const int v_end = std::min(lines.num_v - 1, static_cast<int>(std::floor(hi[lines.v])));
  for (int v = std::max(0, static_cast<int>(std::ceil(lo[lines.v] - 1e-3f))); v <= v_end; ++v) {
    for (int u = std::max(0, static_cast<int>(std::ceil(lo[lines.u] - 1e-3f))); u <= u_end; ++u) {
      CrossAt(surface, t, lines, lines.Line(u, v), u + shift.u, v + shift.v, crossings);
    }
  }
}

}  // namespace liquidblend::spacetime
