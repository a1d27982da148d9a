#include "client/cli/render/upright.h"

#include <algorithm>
#include <array>
#include <cstddef>
#include <vector>

namespace liquidblend::render {
namespace {

// Where a coordinate of the turned point comes from.
struct Source {
  size_t axis;
  int sign;
};

// Sources of x, y and z; rotations, no reflections.
std::array<Source, 3> SourcesOf(Up up) {
  switch (up) {
    case Up::kX:
      return {{{1, 1}, {2, 1}, {0, 1}}};
    case Up::kY:
      return {{{0, 1}, {2, -1}, {1, 1}}};
    case Up::kMinusX:
      return {{{1, -1}, {2, 1}, {0, -1}}};
    case Up::kMinusY:
      return {{{0, 1}, {2, 1}, {1, -1}}};
    case Up::kMinusZ:
      return {{{0, 1}, {1, -1}, {2, -1}}};
    case Up::kUnknown:
    case Up::kZ:
      break;
  }
  return {{{0, 1}, {1, 1}, {2, 1}}};
}

template <typename Number>
std::array<Number, 3> Turned(const Number* point, const std::array<Source, 3>& sources) {
  std::array<Number, 3> turned;
  for (size_t k = 0; k < 3; ++k) {
    turned[k] = static_cast<Number>(sources[k].sign) * point[sources[k].axis];
  }
  return turned;
}

void Turn(std::vector<float>& vectors, const std::array<Source, 3>& sources) {
  for (size_t n = 0; n + 2 < vectors.size(); n += 3) {
    const std::array<float, 3> turned = Turned(&vectors[n], sources);
    std::copy(turned.begin(), turned.end(), vectors.begin() + static_cast<std::ptrdiff_t>(n));
  }
}

}  // namespace

Mesh Upright(Mesh mesh, Up up) {
  const std::array<Source, 3> sources = SourcesOf(up);
  Turn(mesh.positions, sources);
  Turn(mesh.normals, sources);
  Turn(mesh.velocities, sources);
  return mesh;
}

Bounds Upright(const Bounds& bounds, Up up) {
  const std::array<Source, 3> sources = SourcesOf(up);
  const double low[] = {bounds.min.x, bounds.min.y, bounds.min.z};
  const double high[] = {bounds.max.x, bounds.max.y, bounds.max.z};
  const std::array<double, 3> a = Turned(low, sources), b = Turned(high, sources);
  return {{std::min(a[0], b[0]), std::min(a[1], b[1]), std::min(a[2], b[2])},
          {std::max(a[0], b[0]), std::max(a[1], b[1]), std::max(a[2], b[2])}};
}

}  // namespace liquidblend::render
