#include "client/cli/render/scene.h"

#include <algorithm>

#include "absl/strings/str_cat.h"
#include "client/cli/mesh_stats.h"

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
  rtcSetSceneFlags(scene_, RTC_SCENE_FLAG_ROBUST);
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

  hit->distance = query.ray.tfar;
  hit->point = ray.origin + ray.direction * query.ray.tfar;
  hit->geometric_normal = Vector(query.hit.Ng_x, query.hit.Ng_y, query.hit.Ng_z).normalized();
  const uint32_t* v = &triangles_[3 * static_cast<size_t>(query.hit.primID)];
  const float weights[] = {1.0f - query.hit.u - query.hit.v, query.hit.u, query.hit.v};
  Vector normal = Vector::Zero();
  for (size_t k = 0; k < 3; ++k) {
    normal += weights[k] * Eigen::Map<const Vector>(&normals_[3 * static_cast<size_t>(v[k])]);
  }
  hit->normal = normal.norm() > 1e-6f ? Vector(normal.normalized()) : hit->geometric_normal;
  return true;
}

bool Scene::Occluded(const Ray& ray, float near, float far) const {
  RTCRay query = ToEmbree(ray, near, far);
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  rtcOccluded1(scene_, &context, &query);
  return query.tfar < 0.0f;
}

}  // namespace liquidblend::render
