#include "tests/accuracy/distance_field_blend.h"

#include <cmath>

#include "tests/synthetic/implicit.h"
#include "tests/synthetic/surface_distance.h"
#include "worker/registration/surface/axis_rays.h"

namespace liquidblend::accuracy {
namespace {

Eigen::Vector3i GridSize(const Eigen::AlignedBox3f& box, double spacing_m) {
  return (box.sizes().cast<double>() / spacing_m).array().ceil().cast<int>() + 1;
}

}  // namespace

SignedDistances::SignedDistances(const mesh::TriangleMesh& surface, const Eigen::AlignedBox3f& box,
                                 double spacing_m)
    : size_(GridSize(box, spacing_m)), values_(static_cast<size_t>(size_.prod())) {
  registration::RayGrid grid;
  grid.axis = 2;
  grid.first_m = box.min().head<2>().cast<double>();
  grid.spacing_m = spacing_m;
  grid.counts = {size_[0], size_[1]};
  const registration::AxisRays rays(surface, grid);
  const synthetic::SurfaceDistance distance(surface);
  size_t n = 0;
  for (int k = 0; k < size_[2]; ++k) {
    for (int j = 0; j < size_[1]; ++j) {
      for (int i = 0; i < size_[0]; ++i, ++n) {
        const Eigen::Vector3d p = box.min().cast<double>() + spacing_m * Eigen::Vector3d(i, j, k);
        const float unsigned_m = distance.Distance(p.cast<float>());
        values_[n] = rays.Winding(i, j, p.z()) > 0 ? -unsigned_m : unsigned_m;
      }
    }
  }
}

mesh::TriangleMesh BlendDistances(const std::vector<const mesh::TriangleMesh*>& surfaces,
                                  const std::vector<double>& weights, double spacing_m) {
  Eigen::AlignedBox3f box;
  for (const mesh::TriangleMesh* surface : surfaces) {
    if (surface->num_vertices() == 0) continue;
    box.extend(Eigen::Vector3f(surface->vertices.rowwise().minCoeff()));
    box.extend(Eigen::Vector3f(surface->vertices.rowwise().maxCoeff()));
  }
  const Eigen::Vector3f margin = Eigen::Vector3f::Constant(static_cast<float>(2 * spacing_m));
  box.min() -= margin;
  box.max() += margin;
  std::vector<SignedDistances> distances;
  for (const mesh::TriangleMesh* surface : surfaces) {
    distances.emplace_back(*surface, box, spacing_m);
  }
  const Eigen::Vector3d origin = box.min().cast<double>();
  const Eigen::Vector3i last = distances[0].size().array() - 1;
  const auto value = [&](const Eigen::Vector3d& p) {
    const Eigen::Vector3i point =
        ((p - origin) / spacing_m).array().round().cast<int>().max(0).min(last.array());
    double sum = 0;
    for (size_t n = 0; n < distances.size(); ++n) sum += weights[n] * distances[n].At(point);
    return sum;
  };
  return synthetic::Polygonize(value,
                               {.min_m = box.min(), .max_m = box.max(), .spacing_m = spacing_m});
}

}  // namespace liquidblend::accuracy
