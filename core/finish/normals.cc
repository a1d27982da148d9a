#include "core/finish/normals.h"

#include <Eigen/Geometry>

namespace liquidblend::finish {

void AddNormals(mesh::TriangleMesh& surface) {
  surface.normals = Eigen::Matrix3Xf::Zero(3, surface.num_vertices());
  for (Eigen::Index t = 0; t < surface.num_triangles(); ++t) {
    const Eigen::Vector3i corners = surface.triangles.col(t);
    const Eigen::Vector3f a = surface.vertices.col(corners[0]);
    const Eigen::Vector3f ab = surface.vertices.col(corners[1]) - a;
    const Eigen::Vector3f ac = surface.vertices.col(corners[2]) - a;
    const Eigen::Vector3f twice_area = ab.cross(ac);
    for (int k = 0; k < 3; ++k) surface.normals.col(corners[k]) += twice_area;
  }
  for (Eigen::Index v = 0; v < surface.num_vertices(); ++v) {
    const float length = surface.normals.col(v).stableNorm();
    if (length > 0.0F) {
      surface.normals.col(v) /= length;
    } else {
      surface.normals.col(v) = Eigen::Vector3f::UnitZ();
    }
  }
}

}  // namespace liquidblend::finish
