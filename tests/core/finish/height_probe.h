// Heights of a surface over fixed places, as a viewer from above sees them.
#pragma once

#include <Eigen/Core>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "core/mesh/triangle_mesh.h"

namespace liquidblend::finish {

// num x num places, evenly inside of a box in x and y.
struct Places {
  Eigen::Vector2f min_m;
  Eigen::Vector2f max_m;
  int num = 40;
  Eigen::Vector2f at(int i, int j) const {
    const Eigen::Array2f share((static_cast<float>(i) + 0.5F) / static_cast<float>(num),
                               (static_cast<float>(j) + 0.5F) / static_cast<float>(num));
    return min_m.array() + share * (max_m - min_m).array();
  }
};

// Highest z of the surface over each place; NaN where there is none.
inline std::vector<float> HeightsAbove(const mesh::TriangleMesh& surface, const Places& places) {
  std::vector<float> heights(places.num * places.num, std::numeric_limits<float>::quiet_NaN());
  const Eigen::Vector2f step = (places.max_m - places.min_m) / static_cast<float>(places.num);
  for (Eigen::Index t = 0; t < surface.num_triangles(); ++t) {
    Eigen::Matrix3f p;
    for (int k = 0; k < 3; ++k) p.col(k) = surface.vertices.col(surface.triangles(k, t));
    const Eigen::Vector2f low = p.topRows<2>().rowwise().minCoeff();
    const Eigen::Vector2f high = p.topRows<2>().rowwise().maxCoeff();
    const auto index = [&](float x, int axis) {
      const float share = (x - places.min_m[axis]) / step[axis];
      return std::clamp(static_cast<int>(share), 0, places.num - 1);
    };
    for (int i = index(low[0], 0); i <= index(high[0], 0); ++i) {
      for (int j = index(low[1], 1); j <= index(high[1], 1); ++j) {
        Eigen::Matrix3f barycentric = p;
        barycentric.row(2).setOnes();
        Eigen::Vector3f at;
        at << places.at(i, j), 1.0F;
        const float area = barycentric.determinant();
        if (std::abs(area) < 1e-12F) continue;
        Eigen::Vector3f share;
        for (int k = 0; k < 3; ++k) {
          Eigen::Matrix3f replaced = barycentric;
          replaced.col(k) = at;
          share[k] = replaced.determinant() / area;
        }
        if (share.minCoeff() < 0.0F) continue;
        float& height = heights[i * places.num + j];
        height = std::fmax(height, p.row(2).dot(share));
      }
    }
  }
  return heights;
}

// Mean absolute second difference in time, metres, over all places and times where it is below
// `most`: more than that is liquid that comes and goes, not flicker.
inline double Flicker(const std::vector<std::vector<float>>& heights, float most) {
  double sum = 0.0;
  int count = 0;
  for (size_t t = 1; t + 1 < heights.size(); ++t) {
    for (size_t i = 0; i < heights[t].size(); ++i) {
      const float second = heights[t - 1][i] - 2 * heights[t][i] + heights[t + 1][i];
      if (!(std::abs(second) < most)) continue;
      sum += std::abs(second);
      ++count;
    }
  }
  return sum / count;
}

}  // namespace liquidblend::finish
