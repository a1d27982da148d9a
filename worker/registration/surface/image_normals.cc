#include "worker/registration/surface/image_normals.h"

#include <Eigen/LU>

#include "core/mesh/cross_product.h"

namespace liquidblend::registration {
namespace {

// An orthonormal basis T of the tangent space with det(T, N) > 0.
Eigen::Matrix<float, 4, 3> TangentBasis(const Eigen::Vector4f& normal) {
  Eigen::Index largest = 0;
  normal.cwiseAbs().maxCoeff(&largest);
  Eigen::Matrix<float, 4, 3> basis;
  for (int axis = 0, c = 0; axis < 4; ++axis) {
    if (axis == largest) continue;
    Eigen::Vector4f t = Eigen::Vector4f::Unit(axis);
    t -= normal.dot(t) * normal;
    for (int k = 0; k < c; ++k) t -= basis.col(k).dot(t) * basis.col(k);
    basis.col(c++) = t.normalized();
  }
  Eigen::Matrix4f frame;
  frame << basis, normal;
  if (frame.determinant() < 0) basis.col(0) = -basis.col(0);
  return basis;
}

}  // namespace

Eigen::Vector4f ImageNormal(const Surface& source, const PackedLists& neighbors,
                            const Points& displacement, float weight, int64_t v) {
  // In all four coordinates first: the tangent space's three would be sums across a vector.
  Eigen::Matrix4f moments = Eigen::Matrix4f::Zero(), moved_moments = moments;
  for (const int32_t w : neighbors[v]) {
    const Eigen::Vector4f offset = source.points.col(w) - source.points.col(v);
    const Eigen::Vector4f moved = offset + weight * (displacement.col(w) - displacement.col(v));
    moments += offset * offset.transpose();
    moved_moments += moved * offset.transpose();
  }
  const Eigen::Matrix<float, 4, 3> basis = TangentBasis(source.mesh.normals.col(v));
  const Eigen::Matrix<float, 4, 3> image = moved_moments * basis;
  const Eigen::Matrix3f spread =
      basis.transpose() * moments * basis + 1e-4f * Eigen::Matrix3f::Identity();
  const Eigen::Vector4f normal = mesh::CrossProduct(image * spread.inverse());
  const float length = normal.norm();
  return length > 0 ? Eigen::Vector4f(normal / length) : Eigen::Vector4f(Eigen::Vector4f::Zero());
}

Points ImageNormals(const Surface& source, const PackedLists& neighbors, const Points& displacement,
                    float weight, const parallel::Arena& arena) {
  Points normals(4, source.points.cols());
  arena.For(normals.cols(), [&](int64_t v) {
    normals.col(v) = ImageNormal(source, neighbors, displacement, weight, v);
  });
  return normals;
}

}  // namespace liquidblend::registration
