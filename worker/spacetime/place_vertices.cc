#include <algorithm>
#include <cmath>

#include "worker/spacetime/surface_nets.h"

namespace liquidblend::spacetime {
namespace {

constexpr float kTimeMargin = 0.05f;  // vertices stay this far from the layers, in frames
constexpr float kTiny = 1e-6f;        // no corner lies exactly on the surface

// The 16 signed distances at the corners of a 4D cell; bits of the index: x, y, z, t.
using Corners = std::array<float, 16>;

Corners Sample(const Layer& earlier, const Layer& later, int i, int j, int k) {
  Corners phi;
  for (int c = 0; c < 16; ++c) {
    const Layer& layer = (c & 8) != 0 ? later : earlier;
    const int x = i + (c & 1), y = j + (c >> 1 & 1), z = k + (c >> 2 & 1);
    const float distance = std::max(kTiny, layer.band.Distance(x, y, z));
    phi[c] = layer.inside.At(x, y, z) ? -distance : distance;
  }
  return phi;
}

// A margin in space would push walls that lie in a grid plane off it.
Eigen::Vector4f ClampToCell(const Eigen::Vector4f& p) {
  Eigen::Vector4f clamped = p.cwiseMax(0.0f).cwiseMin(1.0f);
  clamped.w() = std::clamp(clamped.w(), kTimeMargin, 1.0f - kTimeMargin);
  return clamped;
}

// Mean of the zero crossings on the cell's 32 edges.
Eigen::Vector4f MeanCrossing(const Corners& phi) {
  Eigen::Vector4f sum = Eigen::Vector4f::Zero();
  int count = 0;
  for (int axis = 0; axis < 4; ++axis) {
    for (int a = 0; a < 16; ++a) {
      const int b = a | 1 << axis;
      if (a == b || (phi[a] < 0) == (phi[b] < 0)) continue;
      Eigen::Vector4f p = Eigen::Vector4i(a & 1, a >> 1 & 1, a >> 2 & 1, a >> 3 & 1).cast<float>();
      p[axis] = phi[a] / (phi[a] - phi[b]);
      sum += p;
      ++count;
    }
  }
  return ClampToCell(sum / static_cast<float>(count));
}

// Value and gradient of the multilinear interpolant, by folding one axis after the other.
float Interpolate(const Corners& phi, const Eigen::Vector4f& p, Eigen::Vector4f& gradient) {
  std::array<float, 16> value = phi;
  std::array<std::array<float, 8>, 4> slope;  // d/d(axis), folded along with the values
  for (int axis = 3, size = 8; axis >= 0; --axis, size /= 2) {
    for (int c = 0; c < size; ++c) {
      slope[axis][c] = value[c + size] - value[c];
      value[c] += p[axis] * slope[axis][c];
      for (int done = axis + 1; done < 4; ++done) {
        slope[done][c] += p[axis] * (slope[done][c + size] - slope[done][c]);
      }
    }
  }
  for (int axis = 0; axis < 4; ++axis) gradient[axis] = slope[axis][0];
  return value[0];
}

Eigen::Vector4f Project(const Corners& phi, Eigen::Vector4f p, int steps) {
  for (int step = 0; step < steps; ++step) {
    Eigen::Vector4f gradient;
    const float value = Interpolate(phi, p, gradient);
    const float slope_sq = gradient.squaredNorm();
    if (!(slope_sq > 1e-8f)) break;
    p -= value / slope_sq * gradient;
    p = ClampToCell(p);
  }
  return p;
}

// Velocity at p (grid units), from the closest triangle of one layer near the cell.
Eigen::Vector3f VelocityAt(const Layer& layer, int i, int j, int k, const Eigen::Vector3f& p) {
  const GridSurface& surface = layer.surface;
  float best = DistanceBand::kBandWidth;
  int32_t t = -1;
  for (int c = 0; c < 8; ++c) {
    const int x = i + (c & 1), y = j + (c >> 1 & 1), z = k + (c >> 2 & 1);
    const float distance = layer.band.Distance(x, y, z);
    if (distance >= best) continue;
    best = distance;
    t = layer.band.Triangle(x, y, z);
  }
  if (t < 0) return Eigen::Vector3f::Zero();
  const auto corner = [&](int c) { return surface.triangles(c, t); };
  const Eigen::Vector3f w =
      ClosestBarycentric(p, surface.vertices.col(corner(0)), surface.vertices.col(corner(1)),
                         surface.vertices.col(corner(2)));
  return w.x() * surface.velocities.col(corner(0)) + w.y() * surface.velocities.col(corner(1)) +
         w.z() * surface.velocities.col(corner(2));
}

// Bits of the cells of row (j, k) whose corners are mixed.
void MixedCells(const Grid& grid, const InsideBits& earlier, const InsideBits& later, int j, int k,
                std::vector<uint64_t>& mixed) {
  const int num_words = grid.words_per_row();
  std::array<const uint64_t*, 8> rows;
  for (int r = 0; r < 4; ++r) {
    rows[r] = earlier.Row(j + (r & 1), k + (r >> 1));
    rows[r + 4] = later.Row(j + (r & 1), k + (r >> 1));
  }
  std::vector<uint64_t> any(num_words + 1, 0), all(num_words + 1, 0);
  for (int w = 0; w < num_words; ++w) {
    all[w] = ~uint64_t{0};
    for (const uint64_t* row : rows) {
      any[w] |= row[w];
      all[w] &= row[w];
    }
  }
  mixed.assign(num_words, 0);
  for (int w = 0; w < num_words; ++w) {
    const uint64_t any_next = any[w] >> 1 | any[w + 1] << 63;
    const uint64_t all_next = all[w] >> 1 | all[w + 1] << 63;
    mixed[w] = (any[w] | any_next) & ~(all[w] & all_next);
  }
}

}  // namespace

Layer SampleLayer(const Grid& grid, GridSurface surface) {
  InsideBits inside = ComputeInside(grid, surface);
  DistanceBand band(grid, surface);
  return {std::move(surface), std::move(inside), std::move(band)};
}

Slab PlaceVertices(const Grid& grid, const Layer& earlier, const Layer& later,
                   int projection_steps) {
  Slab slab;
  slab.row_begin.reserve(grid.num_rows() + 1);
  const bool has_velocities =
      earlier.surface.velocities.cols() > 0 && later.surface.velocities.cols() > 0;
  std::vector<uint64_t> mixed;
  for (int k = 0; k < grid.dims[2]; ++k) {
    for (int j = 0; j < grid.dims[1]; ++j) {
      slab.row_begin.push_back(slab.num_vertices());
      if (j + 1 == grid.dims[1] || k + 1 == grid.dims[2]) continue;
      MixedCells(grid, earlier.inside, later.inside, j, k, mixed);
      ForEachBit(mixed.data(), grid.words_per_row(), [&](int i) {
        const Corners phi = Sample(earlier, later, i, j, k);
        const Eigen::Vector4f local = Project(phi, MeanCrossing(phi), projection_steps);
        const Eigen::Vector4f p = local + Eigen::Vector4i(i, j, k, 0).cast<float>();
        slab.cell_i.push_back(i);
        slab.vertices.push_back(p);
        if (!has_velocities) return;
        const Eigen::Vector3f u0 = VelocityAt(earlier, i, j, k, p.head<3>());
        const Eigen::Vector3f u1 = VelocityAt(later, i, j, k, p.head<3>());
        slab.velocities.push_back((1.0f - p.w()) * u0 + p.w() * u1);
      });
    }
  }
  slab.row_begin.push_back(slab.num_vertices());
  return slab;
}

}  // namespace liquidblend::spacetime
