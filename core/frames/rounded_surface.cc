#include "core/frames/rounded_surface.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/frames/used_part.h"

namespace liquidblend::frames {
namespace {

// Rounds to n * extent / limit, as libdraco does: in floats.
uint16_t Round(float value, float origin, float extent, float limit) {
  const float inside = std::clamp(value, origin, origin + extent) - origin;
  // Far from 0 the sum above is rounded, by more than half a step of a fine grid.
  return static_cast<uint16_t>(std::min(std::floor(inside * (limit / extent) + 0.5F), limit));
}

float LimitOf(int bits) { return static_cast<float>((1 << bits) - 1); }

// The octahedron's upper half is projected along z, the lower one is folded outward.
std::array<int16_t, 2> Octahedral(const Eigen::Vector3f& normal) {
  const float sum = normal.cwiseAbs().sum();
  if (!(sum > 0.0F)) return {0, 0};
  Eigen::Vector2f flat = normal.head<2>() / sum;
  if (normal.z() < 0.0F) {
    const Eigen::Vector2f folded = (1.0F - flat.reverse().array().abs()).matrix();
    flat = {std::copysign(folded.x(), flat.x()), std::copysign(folded.y(), flat.y())};
  }
  const auto round = [](float x) { return static_cast<int16_t>(std::lround(x * kNormalLimit)); };
  return {round(flat.x()), round(flat.y())};
}

void RoundVelocities(const Eigen::Matrix3Xf& velocities, const std::vector<int32_t>& vertices,
                     RoundedSurface& out) {
  float fastest = 0.0F;
  for (const int32_t v : vertices) {
    fastest = std::max(fastest, velocities.col(v).lpNorm<Eigen::Infinity>());
  }
  out.velocity_step_m_s = fastest / kVelocityLimit;
  const float scale = out.velocity_step_m_s > 0.0F ? 1.0F / out.velocity_step_m_s : 0.0F;
  const auto round = [&](float x) {
    const long n = std::lround(x * scale);
    return static_cast<int16_t>(std::clamp<long>(n, -kVelocityLimit, kVelocityLimit));
  };
  for (const int32_t v : vertices) {
    const Eigen::Vector3f velocity = velocities.col(v);
    out.velocities.push_back({round(velocity.x()), round(velocity.y()), round(velocity.z()), 0});
  }
}

void RoundRestPositions(const Eigen::Matrix4Xf& rest, const std::vector<int32_t>& vertices,
                        const RoundingOptions& options, RoundedSurface& out) {
  const float limit = LimitOf(kRestPositionBits);
  const Grid& grid = options.grid;
  // A family of one frame has no duration; all its times are 0.
  const float duration_s = options.duration_s > 0 ? static_cast<float>(options.duration_s) : 1.0F;
  out.rest_step_m = grid.extent_m / limit;
  out.rest_step_s = duration_s / limit;
  for (const int32_t v : vertices) {
    std::array<uint16_t, 4>& n = out.rest.emplace_back();
    for (int k = 0; k < 3; ++k) n[k] = Round(rest(k, v), grid.origin[k], grid.extent_m, limit);
    n[3] = Round(rest(3, v), 0.0F, duration_s, limit);
  }
}

}  // namespace

RoundedSurface RoundSurface(const mesh::TriangleMesh& mesh, const RoundingOptions& options) {
  RoundedSurface out;
  UsedPart used = FindUsedPart(mesh);
  out.triangles = std::move(used.triangles);
  const std::vector<int32_t>& vertices = used.vertices;
  const Grid& grid = options.grid;
  const float limit = LimitOf(options.position_bits);
  out.origin_m = grid.origin;
  out.step_m = grid.extent_m / limit;
  out.positions.reserve(vertices.size());
  for (const int32_t v : vertices) {
    std::array<uint16_t, 4>& n = out.positions.emplace_back();
    for (int k = 0; k < 3; ++k) {
      n[k] = Round(mesh.vertices(k, v), grid.origin[k], grid.extent_m, limit);
    }
  }
  if (mesh.normals.cols() > 0) {
    for (const int32_t v : vertices) out.normals.push_back(Octahedral(mesh.normals.col(v)));
  }
  if (mesh.velocities.cols() > 0) RoundVelocities(mesh.velocities, vertices, out);
  if (mesh.rest.cols() > 0) RoundRestPositions(mesh.rest, vertices, options, out);
  return out;
}

}  // namespace liquidblend::frames
