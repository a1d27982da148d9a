#include "client/cli/render/water.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <atomic>
#include <cmath>
#include <memory>
#include <thread>
#include <vector>

#include "absl/strings/str_cat.h"
#include "client/cli/render/scene.h"
#include "client/cli/render/studio.h"
#include "client/src/status_macros.h"
#include "core/base/cores.h"

namespace liquidblend::render {
namespace {

constexpr float kRefractiveIndex = 1.33f;
constexpr int kMaxDepth = 3;                       // passages through the liquid along one ray
constexpr int kMaxSegments = 4;                    // straight pieces inside the liquid per passage
const Vector kAbsorption(12.0f, 4.2f, 1.8f);       // per size of the scene
const Vector kScatterColor(0.012f, 0.12f, 0.30f);  // of deep liquid

Vector Reflect(const Vector& direction, const Vector& normal) {
  return direction - 2.0f * direction.dot(normal) * normal;
}

// Snell's law; `normal` against the direction, `ratio` of refractive indices, outside over inside.
// False if all light is reflected.
bool Refract(const Vector& direction, const Vector& normal, float ratio, Vector* refracted) {
  const float cosine = -direction.dot(normal);
  const float k = 1.0f - ratio * ratio * (1.0f - cosine * cosine);
  if (k < 0.0f) return false;
  *refracted = (ratio * direction + (ratio * cosine - std::sqrt(k)) * normal).normalized();
  return true;
}

float Fresnel(float cosine) {
  constexpr float kStraight = 0.02f;  // of water
  const float x = 1.0f - std::clamp(cosine, 0.0f, 1.0f);
  return kStraight + (1.0f - kStraight) * x * x * x * x * x;
}

// A smooth normal may turn away from the eye at a silhouette: then it is bent back.
Vector BendToward(const Vector& normal, const Vector& to_eye) {
  constexpr float kLeast = 0.02f;
  const float facing = normal.dot(to_eye);
  if (facing > kLeast) return normal;
  return (normal + (kLeast - facing) * to_eye).normalized();
}

class Tracer {
 public:
  Tracer(const Scene& scene, const Studio& studio) : scene_(scene), studio_(studio) {}

  Vector Trace(const Ray& ray, int depth, Random& random) const {
    Hit hit;
    if (!scene_.Intersect(ray, studio_.epsilon(), &hit)) return studio_.Background(ray, random);
    if (hit.geometric_normal.dot(ray.direction) >
        0.0f) {  // from inside: a ray that slipped through
      return kScatterColor;
    }
    const Vector normal = BendToward(hit.normal, -ray.direction);
    const float fresnel = Fresnel(-ray.direction.dot(normal));
    const Vector body = kScatterColor.cwiseProduct(studio_.Lighting(hit.point, normal, random));
    const Vector through = Through(ray, hit, normal, 1.8f * body, depth, random);
    return fresnel * Mirrored(ray, hit, normal, random) + (1.0f - fresnel) * through;
  }

 private:
  // The reflected light: of the studio, or of the liquid itself in its plain color.
  Vector Mirrored(const Ray& ray, const Hit& hit, const Vector& normal, Random& random) const {
    const Ray mirrored{hit.point, Reflect(ray.direction, normal)};
    if (scene_.Occluded(mirrored, studio_.epsilon())) return 1.5f * kScatterColor;
    return studio_.Background(mirrored, random);
  }

  // Light that comes through the liquid, absorbed on its way, plus what the liquid scatters.
  Vector Through(const Ray& ray, const Hit& hit, const Vector& normal, const Vector& body,
                 int depth, Random& random) const {
    Ray inside{hit.point, ray.direction};
    Refract(ray.direction, normal, 1.0f / kRefractiveIndex, &inside.direction);
    float length = 0.0f;
    Vector behind = body;
    for (int segment = 0; segment < kMaxSegments; ++segment) {
      Hit exit;
      if (!scene_.Leave(inside, studio_.epsilon(), &exit)) {
        behind = studio_.Background(inside, random);
        break;
      }
      length += exit.distance;
      const Vector inward = -BendToward(exit.normal, inside.direction);
      Vector outside;
      if (Refract(inside.direction, inward, kRefractiveIndex, &outside)) {
        if (depth > 1) behind = Trace({exit.point, outside}, depth - 1, random);
        break;
      }
      inside = {exit.point, Reflect(inside.direction, inward)};
    }
    const Vector exponent = -kAbsorption * (length / studio_.size());
    const Vector clear = exponent.array().exp().matrix();
    return clear.cwiseProduct(behind) + (Vector::Ones() - clear).cwiseProduct(body);
  }

  const Scene& scene_;
  const Studio& studio_;
};

uint8_t ToByte(float linear) {
  const float x = std::clamp(linear, 0.0f, 1.0f);
  const float srgb = x <= 0.0031308f ? 12.92f * x : 1.055f * std::pow(x, 1.0f / 2.4f) - 0.055f;
  return static_cast<uint8_t>(srgb * 255.0f + 0.5f);
}

// Bright light bends over instead of being cut off.
float Soften(float linear) {
  return linear <= 0.8f ? linear : 1.0f - 0.2f * std::exp((0.8f - linear) / 0.2f);
}

void RenderRow(const Tracer& tracer, const Camera& camera, const WaterOptions& options, int y,
               Image* image) {
  const int side = options.samples_per_side;
  const float step = 1.0f / static_cast<float>(side);
  for (int x = 0; x < options.width; ++x) {
    Vector sum = Vector::Zero();
    for (int sample = 0; sample < side * side; ++sample) {
      Random random(static_cast<uint32_t>(x), static_cast<uint32_t>(y),
                    static_cast<uint32_t>(sample));
      const float dx = (static_cast<float>(sample % side) + 0.5f) * step;
      const float dy = (static_cast<float>(sample / side) + 0.5f) * step;
      const Ray ray =
          camera.MakeRay((static_cast<float>(x) + dx) / static_cast<float>(options.width),
                         (static_cast<float>(y) + dy) / static_cast<float>(options.height));
      const Vector color = tracer.Trace(ray, kMaxDepth, random);
      sum += Vector(Soften(color.x()), Soften(color.y()), Soften(color.z()));
    }
    const Vector mean = sum * (step * step);
    image->Set(x, y, {ToByte(mean.x()), ToByte(mean.y()), ToByte(mean.z())});
  }
}

absl::Status CheckRange(const char* field, int value, int lowest, int highest) {
  if (value >= lowest && value <= highest) return absl::OkStatus();
  return absl::InvalidArgumentError(
      absl::StrCat(field, " is ", value, "; it must be in [", lowest, ", ", highest, "]"));
}

}  // namespace

absl::Status WaterOptions::Validate() const {
  LBC_RETURN_IF_ERROR(CheckRange("width", width, 16, 8192));
  LBC_RETURN_IF_ERROR(CheckRange("height", height, 16, 8192));
  LBC_RETURN_IF_ERROR(CheckRange("samples_per_side", samples_per_side, 1, 16));
  return camera.Validate();
}

absl::StatusOr<Image> RenderWater(const Mesh& mesh, const Bounds& bounds,
                                  const WaterOptions& options) {
  LBC_RETURN_IF_ERROR(options.Validate());
  LBC_ASSIGN_OR_RETURN(const std::unique_ptr<Scene> scene, Scene::Make(mesh));
  const Studio studio(*scene, bounds);
  const Camera camera(bounds, static_cast<double>(options.width) / options.height, options.camera);
  const Tracer tracer(*scene, studio);
  Image image(options.width, options.height, Color{});
  std::atomic<int> next_row = 0;
  const auto render_rows = [&] {
    for (int y = next_row++; y < options.height; y = next_row++) {
      RenderRow(tracer, camera, options, y, &image);
    }
  };
  std::vector<std::jthread> threads;
  const int num_threads = base::NumCores();
  for (int i = 1; i < num_threads; ++i) threads.emplace_back(render_rows);
  render_rows();
  threads.clear();  // waits for all rows
  return image;
}

}  // namespace liquidblend::render
