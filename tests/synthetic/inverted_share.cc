#include "tests/synthetic/inverted_share.h"

#include "worker/registration/surface/axis_rays.h"

namespace liquidblend::synthetic {
namespace {

// Of the spacing: the first rays lie this far inside, on no plane that a vertex is likely to be on.
constexpr double kOffset = 0.3719;

}  // namespace

CrossingCount CountInverted(const mesh::TriangleMesh& surface, double spacing_m) {
  CrossingCount count;
  if (surface.num_triangles() == 0) return count;
  for (const int axis : {0, 2}) {
    const auto found = registration::FindInverted(
        surface, registration::RaysThrough(surface, axis, spacing_m, kOffset));
    count.num_crossings += found.num_crossings;
    count.num_inverted += static_cast<int64_t>(found.inverted.size());
  }
  return count;
}

}  // namespace liquidblend::synthetic
