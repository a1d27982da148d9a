#include "client/cli/render/studio.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>

namespace liquidblend::render {
namespace {

constexpr int kOcclusionRays = 2;        // per sample
constexpr float kOcclusionReach = 0.4f;  // times size
constexpr float kLampRadius = 0.16f;     // sine of half its angle

const Vector kLampDirection = Vector(-0.45f, -0.55f, 1.0f).normalized();
const Vector kLampColor(1.05f, 1.0f, 0.92f);
const Vector kRoomColor(0.62f, 0.70f, 0.80f);
const Vector kFloorColor(0.58f, 0.61f, 0.64f);
const Vector kFarColor(0.70f, 0.76f, 0.82f);
const Vector kZenithColor(0.22f, 0.36f, 0.58f);
const Vector kShadowColor(0.22f, 0.50f, 0.66f);  // what a liquid lets through

Vector Mix(const Vector& a, const Vector& b, float share) { return a + share * (b - a); }

// A direction around `axis`, as dense as the cosine.
Vector CosineDirection(const Vector& axis, Random& random) {
  const float angle = 2.0f * std::numbers::pi_v<float> * random.Next();
  const float z = 1.0f - 2.0f * random.Next();
  const float r = std::sqrt(std::max(0.0f, 1.0f - z * z));
  const Vector direction = axis + 0.999f * Vector(r * std::cos(angle), r * std::sin(angle), z);
  return direction.normalized();
}

}  // namespace

Random::Random(uint32_t x, uint32_t y, uint32_t sample)
    : state_((x * 73856093u) ^ (y * 19349663u) ^ (sample * 83492791u)) {
  Next();
}

float Random::Next() {  // PCG hash
  state_ = state_ * 747796405u + 2891336453u;
  const uint32_t word = ((state_ >> ((state_ >> 28u) + 4u)) ^ state_) * 277803737u;
  return static_cast<float>(((word >> 22u) ^ word) >> 8u) * 0x1p-24f;
}

Studio::Studio(const Scene& scene, const Bounds& bounds)
    : scene_(scene), floor_z_(static_cast<float>(bounds.min.z)) {
  const Vector low(static_cast<float>(bounds.min.x), static_cast<float>(bounds.min.y), floor_z_);
  const Vector high(static_cast<float>(bounds.max.x), static_cast<float>(bounds.max.y),
                    static_cast<float>(bounds.max.z));
  center_ = 0.5f * (low + high);
  size_ = std::max(1e-6f, (high - low).norm());
  floor_z_ -= 2e-3f * size_;
}

Vector Studio::Room(const Vector& direction) const {
  const float height = std::clamp(direction.z(), 0.0f, 1.0f);
  const Vector wall = Mix(kFarColor, kZenithColor, std::sqrt(height));
  // The lamp as a soft-edged disc, for highlights.
  const float lamp = std::clamp((direction.dot(kLampDirection) - 0.955f) / 0.03f, 0.0f, 1.0f);
  return wall + 2.2f * lamp * kLampColor;
}

Vector Studio::Background(const Ray& ray, Random& random) const {
  const float t = (floor_z_ - ray.origin.z()) / ray.direction.z();
  if (ray.direction.z() > -1e-4f || t <= 0.0f) return Room(ray.direction);
  const Vector point = ray.origin + ray.direction * t;
  const Vector lit = kFloorColor.cwiseProduct(Lighting(point, Vector::UnitZ(), random));
  // The floor melts into the wall far away: no horizon.
  const float away = (point - center_).head<2>().norm() / size_;
  return Mix(lit, kFarColor, std::clamp((away - 0.6f) / 2.2f, 0.0f, 1.0f));
}

Vector Studio::Lighting(const Vector& point, const Vector& normal, Random& random) const {
  const float facing = std::max(0.0f, normal.dot(kLampDirection));
  const Vector lamp = 0.72f * facing * Mix(kShadowColor, Vector::Ones(), LampShare(point, random));
  const Vector room = Mix(kShadowColor, Vector::Ones(), Openness(point, normal, random));
  return lamp.cwiseProduct(kLampColor) + room.cwiseProduct(kRoomColor);
}

float Studio::LampShare(const Vector& point, Random& random) const {
  const Vector jitter(random.Next() - 0.5f, random.Next() - 0.5f, random.Next() - 0.5f);
  const Ray ray{point, (kLampDirection + 2.0f * kLampRadius * jitter).normalized()};
  return scene_.Occluded(ray, epsilon()) ? 0.0f : 1.0f;
}

float Studio::Openness(const Vector& point, const Vector& normal, Random& random) const {
  int open = 0;
  for (int i = 0; i < kOcclusionRays; ++i) {
    const Ray ray{point, CosineDirection(normal, random)};
    open += scene_.Occluded(ray, epsilon(), kOcclusionReach * size_) ? 0 : 1;
  }
  return static_cast<float>(open) / kOcclusionRays;
}

}  // namespace liquidblend::render
