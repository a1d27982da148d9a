#include "core/frames/used_part.h"

namespace liquidblend::frames {

UsedPart FindUsedPart(const mesh::TriangleMesh& mesh) {
  UsedPart used;
  used.triangles.reserve(mesh.num_triangles());
  used.vertices.reserve(mesh.num_vertices());
  std::vector<int32_t> number(mesh.num_vertices(), -1);
  for (Eigen::Index t = 0; t < mesh.num_triangles(); ++t) {
    const Eigen::Vector3i corners = mesh.triangles.col(t);
    if (corners[0] == corners[1] || corners[1] == corners[2] || corners[2] == corners[0]) continue;
    std::array<uint32_t, 3>& triangle = used.triangles.emplace_back();
    for (int k = 0; k < 3; ++k) {
      int32_t& v = number[corners[k]];
      if (v < 0) {
        v = static_cast<int32_t>(used.vertices.size());
        used.vertices.push_back(corners[k]);
      }
      triangle[k] = static_cast<uint32_t>(v);
    }
  }
  return used;
}

}  // namespace liquidblend::frames
