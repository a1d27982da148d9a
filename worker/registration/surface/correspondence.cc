#include "worker/registration/surface/correspondence.h"

#include <cmath>

namespace liquidblend::registration {

bool IsSame(const Correspondence& a, const Correspondence& b) {
  constexpr double kRounding = 1e-9;
  const auto near = [](const Eigen::Vector4d& p, const Eigen::Vector4d& q) {
    return (p - q).norm() <= kRounding * (1 + p.norm());
  };
  return a.kind == b.kind && a.hard == b.hard && near(a.source, b.source) &&
         near(a.target, b.target) &&
         std::abs(a.length_frames - b.length_frames) <= kRounding * (1 + a.length_frames);
}

}  // namespace liquidblend::registration
