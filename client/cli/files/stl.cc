// STL: binary, a triangle after the other without shared vertices.
#include <array>
#include <cmath>
#include <cstdint>
#include <string>

#include "client/cli/files/mesh_file.h"

namespace liquidblend::cli {
namespace {

constexpr size_t kHeaderBytes = 80;
constexpr size_t kTriangleBytes = 50;

// Unit normal of the triangle a, b, c; 0 if it has no area.
std::array<float, 3> NormalOf(const float* a, const float* b, const float* c) {
  const double u[] = {double{b[0]} - a[0], double{b[1]} - a[1], double{b[2]} - a[2]};
  const double v[] = {double{c[0]} - a[0], double{c[1]} - a[1], double{c[2]} - a[2]};
  const double n[] = {u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2],
                      u[0] * v[1] - u[1] * v[0]};
  const double length = std::sqrt(n[0] * n[0] + n[1] * n[1] + n[2] * n[2]);
  const double scale = length > 0.0 ? 1.0 / length : 0.0;
  return {static_cast<float>(n[0] * scale), static_cast<float>(n[1] * scale),
          static_cast<float>(n[2] * scale)};
}

void AppendFloats(const float* values, std::string* bytes) {
  bytes->append(reinterpret_cast<const char*>(values), 3 * sizeof(float));
}

}  // namespace

std::string ToStl(const Mesh& mesh) {
  std::string bytes = "liquidblend, metres";  // must not begin with "solid", as ASCII files do
  bytes.resize(kHeaderBytes, ' ');
  bytes.reserve(kHeaderBytes + 4 + kTriangleBytes * mesh.num_triangles());
  const auto count = static_cast<uint32_t>(mesh.num_triangles());
  bytes.append(reinterpret_cast<const char*>(&count), sizeof(count));
  for (size_t t = 0; t < mesh.num_triangles(); ++t) {
    const float* corners[3];
    for (size_t k = 0; k < 3; ++k) {
      corners[k] = &mesh.positions[3 * static_cast<size_t>(mesh.triangles[3 * t + k])];
    }
    AppendFloats(NormalOf(corners[0], corners[1], corners[2]).data(), &bytes);
    for (const float* corner : corners) AppendFloats(corner, &bytes);
    bytes.append(2, '\0');  // no attributes
  }
  return bytes;
}

}  // namespace liquidblend::cli
