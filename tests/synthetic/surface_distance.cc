#include "tests/synthetic/surface_distance.h"

#include <embree3/rtcore.h>

#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>
#include <limits>

namespace liquidblend::synthetic {
namespace {

// Ericson, Real-Time Collision Detection, section 5.1.5.
Eigen::Vector3f ClosestOnTriangle(const Eigen::Vector3f& p, const Eigen::Vector3f& a,
                                  const Eigen::Vector3f& b, const Eigen::Vector3f& c) {
  const auto on_edge = [&](const Eigen::Vector3f& from, const Eigen::Vector3f& to) {
    const Eigen::Vector3f edge = to - from;
    const float length_sq = edge.squaredNorm();
    const float s = length_sq > 0 ? std::clamp((p - from).dot(edge) / length_sq, 0.0f, 1.0f) : 0.0f;
    return Eigen::Vector3f(from + s * edge);
  };
  const Eigen::Vector3f normal = (b - a).cross(c - a);
  const float area_sq = normal.squaredNorm();
  if (area_sq > 0) {
    const float wa = (b - p).cross(c - p).dot(normal), wb = (c - p).cross(a - p).dot(normal),
                wc = (a - p).cross(b - p).dot(normal);
    if (wa >= 0 && wb >= 0 && wc >= 0) return (wa * a + wb * b + wc * c) / (wa + wb + wc);
  }
  Eigen::Vector3f best = on_edge(a, b);
  for (const Eigen::Vector3f& q : {on_edge(b, c), on_edge(c, a)}) {
    if ((p - q).squaredNorm() < (p - best).squaredNorm()) best = q;
  }
  return best;
}

struct Query {
  const mesh::TriangleMesh* surface;
  Eigen::Vector3f point;
};

bool OnTriangle(RTCPointQueryFunctionArguments* args) {
  const Query& query = *static_cast<const Query*>(args->userPtr);
  const auto corner = [&](int c) {
    return Eigen::Vector3f(query.surface->vertices.col(query.surface->triangles(c, args->primID)));
  };
  const float distance =
      (query.point - ClosestOnTriangle(query.point, corner(0), corner(1), corner(2))).norm();
  if (distance >= args->query->radius) return false;
  args->query->radius = distance;
  return true;
}

double MeanDistance(const mesh::TriangleMesh& from, const mesh::TriangleMesh& to) {
  const SurfaceDistance distance(to);
  double sum = 0;
  for (int64_t v = 0; v < from.num_vertices(); ++v) sum += distance.Distance(from.vertices.col(v));
  return sum / static_cast<double>(std::max<int64_t>(1, from.num_vertices()));
}

}  // namespace

struct SurfaceDistance::Impl {
  mesh::TriangleMesh surface;
  RTCDevice device = rtcNewDevice("threads=1");
  RTCScene scene = rtcNewScene(device);
  ~Impl() {
    rtcReleaseScene(scene);
    rtcReleaseDevice(device);
  }
};

SurfaceDistance::SurfaceDistance(const mesh::TriangleMesh& surface) : impl_(new Impl{surface}) {
  const RTCGeometry geometry = rtcNewGeometry(impl_->device, RTC_GEOMETRY_TYPE_TRIANGLE);
  const auto copy = [&](RTCBufferType type, RTCFormat format, const auto& columns) {
    void* buffer =
        rtcSetNewGeometryBuffer(geometry, type, 0, format, 12, static_cast<size_t>(columns.cols()));
    std::copy_n(reinterpret_cast<const char*>(columns.data()), columns.size() * 4,
                static_cast<char*>(buffer));
  };
  if (surface.num_triangles() > 0) {
    copy(RTC_BUFFER_TYPE_VERTEX, RTC_FORMAT_FLOAT3, impl_->surface.vertices);
    copy(RTC_BUFFER_TYPE_INDEX, RTC_FORMAT_UINT3, impl_->surface.triangles);
    rtcCommitGeometry(geometry);
    rtcAttachGeometry(impl_->scene, geometry);
  }
  rtcReleaseGeometry(geometry);
  rtcCommitScene(impl_->scene);
}

SurfaceDistance::~SurfaceDistance() = default;
SurfaceDistance::SurfaceDistance(SurfaceDistance&&) noexcept = default;

float SurfaceDistance::Distance(const Eigen::Vector3f& point) const {
  Query query{&impl_->surface, point};
  RTCPointQuery point_query;
  point_query.x = point.x();
  point_query.y = point.y();
  point_query.z = point.z();
  point_query.time = 0;
  point_query.radius = std::numeric_limits<float>::infinity();
  RTCPointQueryContext context;
  rtcInitPointQueryContext(&context);
  rtcPointQuery(impl_->scene, &point_query, &context, OnTriangle, &query);
  return point_query.radius;
}

double MeanSymmetricDistance(const mesh::TriangleMesh& a, const mesh::TriangleMesh& b) {
  return 0.5 * (MeanDistance(a, b) + MeanDistance(b, a));
}

}  // namespace liquidblend::synthetic
