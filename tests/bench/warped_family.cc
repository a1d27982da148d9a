#include "tests/bench/warped_family.h"

#include <cmath>
#include <memory>
#include <numbers>
#include <utility>
#include <vector>

#include "tests/synthetic/families.h"

namespace liquidblend::bench {
namespace {

synthetic::Field TimeWarp(double warp_frames) {
  return [=](int64_t, const Eigen::Vector4f& at) {
    const double phase = std::numbers::pi * (2.0 * at[0] + at[1]);
    return Eigen::Vector4f(0.05F, 0.0F, 0.0F, static_cast<float>(warp_frames * std::sin(phase)));
  };
}

}  // namespace

Loaded::Loaded(mesh::RegisteredFamily registered) : family(std::move(registered)), index(family) {}

const Loaded& FamilyOf(const WarpedTorus& torus) {
  static std::unique_ptr<Loaded> loaded;
  static WarpedTorus made;
  if (loaded == nullptr || made != torus) {
    loaded.reset();
    made = torus;
    const int num_minor = static_cast<int>(std::sqrt(torus.vertices_per_frame / 2.0));
    synthetic::ComplexOptions options;
    options.num_frames = torus.num_frames;
    options.growth_per_frame = 0.4F / static_cast<float>(torus.num_frames);
    const std::vector<synthetic::TargetFields> targets(torus.num_targets,
                                                       {TimeWarp(torus.warp_frames), {}});
    loaded = std::make_unique<Loaded>(synthetic::MakeFamily(
        synthetic::HexahedralTorus(torus.vertices_per_frame / num_minor, num_minor, options),
        targets));
  }
  return *loaded;
}

}  // namespace liquidblend::bench
