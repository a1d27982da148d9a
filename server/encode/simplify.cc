#include "server/encode/simplify.h"

#include <meshoptimizer.h>

#include <limits>
#include <vector>

namespace liquidblend::encode {
namespace {

constexpr float kAnyError = std::numeric_limits<float>::max();
constexpr size_t kCorners = 3;

// The triangles' own vertices, in their order.
mesh::TriangleMesh Compacted(const mesh::TriangleMesh& surface,
                             const std::vector<unsigned int>& indices) {
  std::vector<int> new_of(static_cast<size_t>(surface.num_vertices()), -1);
  for (const unsigned int index : indices) new_of[index] = 0;
  int count = 0;
  for (int& vertex : new_of) {
    if (vertex == 0) vertex = count++;
  }
  mesh::TriangleMesh result;
  result.vertices.resize(3, count);
  result.velocities.resize(3, surface.velocities.cols() > 0 ? count : 0);
  for (Eigen::Index v = 0; v < surface.vertices.cols(); ++v) {
    const int vertex = new_of[static_cast<size_t>(v)];
    if (vertex < 0) continue;
    result.vertices.col(vertex) = surface.vertices.col(v);
    if (result.velocities.cols() > 0) result.velocities.col(vertex) = surface.velocities.col(v);
  }
  result.triangles.resize(3, static_cast<Eigen::Index>(indices.size() / kCorners));
  for (size_t i = 0; i < indices.size(); ++i) {
    result.triangles(static_cast<Eigen::Index>(i)) = new_of[indices[i]];
  }
  return result;
}

}  // namespace

mesh::TriangleMesh Simplify(const mesh::TriangleMesh& surface, double share) {
  const auto num_indices = static_cast<size_t>(surface.triangles.size());
  std::vector<unsigned int> indices(num_indices);
  for (size_t i = 0; i < num_indices; ++i) {
    indices[i] = static_cast<unsigned int>(surface.triangles(static_cast<Eigen::Index>(i)));
  }
  const auto num_wanted = static_cast<size_t>(share * static_cast<double>(num_indices / kCorners));
  std::vector<unsigned int> simpler(num_indices);
  simpler.resize(
      meshopt_simplify(simpler.data(), indices.data(), num_indices, surface.vertices.data(),
                       static_cast<size_t>(surface.num_vertices()), sizeof(float) * kCorners,
                       kCorners * num_wanted, kAnyError, /*options=*/0, /*result_error=*/nullptr));
  return Compacted(surface, simpler);
}

}  // namespace liquidblend::encode
