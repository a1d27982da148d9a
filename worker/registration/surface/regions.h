// Regions of space-time, to find the place where a figure is worst. Internal to
// worker/registration.
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cmath>
#include <map>

namespace liquidblend::registration {

// Weights at points, registration units, summed over regions of kEdges to a side and kEdges frames.
class Regions {
 public:
  static constexpr float kEdges = 8.0f;

  void Add(const Eigen::Vector4f& position, double weight) {
    std::array<int, 4> key;
    for (int k = 0; k < 4; ++k) {
      key[k] = static_cast<int>(std::floor(std::clamp(position[k] / kEdges, -1e6f, 1e6f)));
    }
    Region& region = regions_[key];
    region.weight += weight;
    region.sum += weight * position.cast<double>();
  }
  // The centre of the heaviest region; zero if there is none.
  Eigen::Vector4d Worst() const {
    const Region* worst = nullptr;
    for (const auto& [key, region] : regions_) {
      if (region.weight > (worst == nullptr ? 0.0 : worst->weight)) worst = &region;
    }
    return worst == nullptr ? Eigen::Vector4d::Zero() : Eigen::Vector4d(worst->sum / worst->weight);
  }

 private:
  struct Region {
    double weight = 0.0;
    Eigen::Vector4d sum = Eigen::Vector4d::Zero();
  };
  std::map<std::array<int, 4>, Region> regions_;
};

}  // namespace liquidblend::registration
