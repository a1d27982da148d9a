#include "client/cli/render/scene.h"

#include <algorithm>
#include <vector>

#include "absl/strings/str_cat.h"
#include "client/cli/files/mesh_stats.h"

namespace liquidblend::render {
namespace {

RTCRay ToEmbree(const Ray& ray, float near, float far) {
  RTCRay result{};
  result.org_x = ray.origin.x();
  result.org_y = ray.origin.y();
  result.org_z = ray.origin.z();
  result.dir_x = ray.direction.x();
  result.dir_y = ray.direction.y();
  result.dir_z = ray.direction.z();
  result.tnear = near;
  result.tfar = far;
  result.mask = ~0u;
  return result;
}

RTCGeometry MakeGeometry(RTCDevice device, const Mesh& mesh) {
  RTCGeometry geometry = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_TRIANGLE);
  void* positions = rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3,
                                            3 * sizeof(float), mesh.num_vertices());
  void* triangles = rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3,
                                            3 * sizeof(uint32_t), mesh.num_triangles());
  if (positions != nullptr && triangles != nullptr) {
    std::copy(mesh.positions.begin(), mesh.positions.end(), static_cast<float*>(positions));
    std::copy(mesh.triangles.begin(), mesh.triangles.end(), static_cast<uint32_t*>(triangles));
  }
  rtcCommitGeometry(geometry);
  return geometry;
}

struct Crossing {
  float distance;
  int step;  // of the winding number along the ray: 1 into the liquid, -1 out of it
  RTCHit hit;
};

// Context of a ray that makes Embree record each hit and go on.
struct CollectingContext {
  RTCIntersectContext context;  // first: Embree hands back a pointer to it
  std::vector<Crossing>* crossings;

  static void Collect(const RTCFilterFunctionNArguments* arguments) {
    auto* self = reinterpret_cast<CollectingContext*>(arguments->context);
    const RTCRay ray = rtcGetRayFromRayN(arguments->ray, arguments->N, 0);
    const RTCHit hit = rtcGetHitFromHitN(arguments->hit, arguments->N, 0);
    const Vector direction(ray.dir_x, ray.dir_y, ray.dir_z);
    const int step = direction.dot(Vector(hit.Ng_x, hit.Ng_y, hit.Ng_z)) > 0.0f ? -1 : 1;
    self->crossings->push_back({ray.tfar, step, hit});
    arguments->valid[0] = 0;
  }
};

// All crossings beyond `near`, the nearest first; at one distance those that enter come first.
std::vector<Crossing> CrossingsOf(RTCScene scene, const Ray& ray, float near) {
  std::vector<Crossing> crossings;
  CollectingContext collecting;
  rtcInitIntersectContext(&collecting.context);
  collecting.context.filter = CollectingContext::Collect;
  collecting.crossings = &crossings;
  RTCRayHit query{};
  query.ray = ToEmbree(ray, near, std::numeric_limits<float>::infinity());
  query.hit.geomID = RTC_INVALID_GEOMETRY_ID;
  rtcIntersect1(scene, &collecting.context, &query);
  std::sort(crossings.begin(), crossings.end(), [](const Crossing& a, const Crossing& b) {
    if (a.distance != b.distance) return a.distance < b.distance;
    return a.step != b.step ? a.step > b.step : a.hit.primID < b.hit.primID;
  });
  return crossings;
}

}  // namespace

absl::StatusOr<std::unique_ptr<Scene>> Scene::Make(const Mesh& mesh) {
  RTCDevice device = rtcNewDevice("threads=1");
  if (device == nullptr) return absl::InternalError("Embree cannot start");
  std::unique_ptr<Scene> scene(new Scene(device, mesh));
  if (const RTCError error = rtcGetDeviceError(device); error != RTC_ERROR_NONE) {
    return absl::InternalError(
        absl::StrCat("Embree refuses the mesh: error ", static_cast<int>(error)));
  }
  return scene;
}

Scene::Scene(RTCDevice device, const Mesh& mesh)
    : device_(device),
      scene_(rtcNewScene(device)),
      triangles_(mesh.triangles),
      normals_(cli::VertexNormals(mesh)) {
  rtcSetSceneFlags(scene_, static_cast<RTCSceneFlags>(RTC_SCENE_FLAG_ROBUST |
                                                      RTC_SCENE_FLAG_CONTEXT_FILTER_FUNCTION));
  if (mesh.num_triangles() > 0) {
    RTCGeometry geometry = MakeGeometry(device_, mesh);
    rtcAttachGeometry(scene_, geometry);
    rtcReleaseGeometry(geometry);
  }
  rtcCommitScene(scene_);
}

Scene::~Scene() {
  rtcReleaseScene(scene_);
  rtcReleaseDevice(device_);
}

bool Scene::Intersect(const Ray& ray, float near, Hit* hit) const {
  RTCRayHit query{};
  query.ray = ToEmbree(ray, near, std::numeric_limits<float>::infinity());
  query.hit.geomID = RTC_INVALID_GEOMETRY_ID;
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  rtcIntersect1(scene_, &context, &query);
  if (query.hit.geomID == RTC_INVALID_GEOMETRY_ID) return false;

  *hit = HitAt(ray, query.ray.tfar, query.hit);
  return true;
}

bool Scene::Leave(const Ray& ray, float near, Hit* hit) const {
  const std::vector<Crossing> crossings = CrossingsOf(scene_, ray, near);
  int winding = 0;  // at the start: what all crossings together take away
  for (const Crossing& crossing : crossings) winding -= crossing.step;
  for (const Crossing& crossing : crossings) {
    winding += crossing.step;
    if (winding > 0) continue;
    *hit = HitAt(ray, crossing.distance, crossing.hit);
    return true;
  }
  return false;
}

Hit Scene::HitAt(const Ray& ray, float distance, const RTCHit& found) const {
  Hit hit;
  hit.distance = distance;
  hit.point = ray.origin + ray.direction * distance;
  hit.geometric_normal = Vector(found.Ng_x, found.Ng_y, found.Ng_z).normalized();
  const uint32_t* v = &triangles_[3 * static_cast<size_t>(found.primID)];
  const float weights[] = {1.0f - found.u - found.v, found.u, found.v};
  Vector normal = Vector::Zero();
  for (size_t k = 0; k < 3; ++k) {
    normal += weights[k] * Eigen::Map<const Vector>(&normals_[3 * static_cast<size_t>(v[k])]);
  }
  hit.normal = normal.norm() > 1e-6f ? Vector(normal.normalized()) : hit.geometric_normal;
  return hit;
}

bool Scene::Occluded(const Ray& ray, float near, float far) const {
  RTCRay query = ToEmbree(ray, near, far);
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  rtcOccluded1(scene_, &context, &query);
  return query.tfar < 0.0f;
}

}  // namespace liquidblend::render
