#include "client/src/decode/unpack.h"

#include <algorithm>
#include <cmath>
#include <cstddef>

namespace liquidblend::client {
namespace {

constexpr float kNormalLimit = 511.0F;

// Three coordinates of each vertex: origin + step * n.
template <typename Vertex>
void Scale(std::span<const Vertex> vertices, const std::array<float, 3>& origin, float step,
           float* out) {
  for (const Vertex& vertex : vertices) {
    for (size_t k = 0; k < 3; ++k) *out++ = origin[k] + step * static_cast<float>(vertex[k]);
  }
}

// The inverse of an octahedral projection.
void UnpackNormals(std::span<const std::array<int16_t, 2>> normals, float* out) {
  for (const std::array<int16_t, 2>& normal : normals) {
    float x = normal[0] / kNormalLimit, y = normal[1] / kNormalLimit;
    const float z = 1.0F - std::abs(x) - std::abs(y);
    const float folded = std::max(-z, 0.0F);  // of the lower half
    x -= std::copysign(folded, x);
    y -= std::copysign(folded, y);
    const float scale = 1.0F / std::sqrt(x * x + y * y + z * z);
    *out++ = x * scale;
    *out++ = y * scale;
    *out++ = z * scale;
  }
}

void UnpackRest(const PackedMesh& packed, float* out) {
  for (const std::array<uint16_t, 4>& n : packed.rest) {
    for (size_t k = 0; k < 3; ++k) {
      *out++ = packed.rest_origin_m[k] + packed.rest_step_m * static_cast<float>(n[k]);
    }
    *out++ = packed.rest_origin_s + packed.rest_step_s * static_cast<float>(n[3]);
  }
}

// Meshoptimizer's codec may turn a triangle: all are turned alike.
void CopyTriangles(std::span<const std::array<uint32_t, 3>> triangles, uint32_t* out) {
  for (const std::array<uint32_t, 3>& corners : triangles) {
    const auto first =
        static_cast<size_t>(std::min_element(corners.begin(), corners.end()) - corners.begin());
    for (size_t k = 0; k < 3; ++k) *out++ = corners[(first + k) % 3];
  }
}

}  // namespace

void Unpack(const PackedMesh& packed, const MeshMemory& out) {
  if (out.positions != nullptr) {
    Scale(packed.positions, packed.origin_m, packed.step_m, out.positions);
  }
  if (out.normals != nullptr) UnpackNormals(packed.normals, out.normals);
  if (out.velocities != nullptr) {
    Scale(packed.velocities, {0, 0, 0}, packed.velocity_step_m_s, out.velocities);
  }
  if (out.rest != nullptr) UnpackRest(packed, out.rest);
  if (out.triangles != nullptr) CopyTriangles(packed.triangles, out.triangles);
}

}  // namespace liquidblend::client
