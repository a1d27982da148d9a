#include "server/encode/meshopt.h"

#include <meshoptimizer.h>

#include <vector>

#include "absl/strings/str_cat.h"
#include "core/base/status_macros.h"
#include "liquidblend/v1/liquidblend.pb.h"

namespace liquidblend::encode {
namespace {

template <typename Vertex>
std::string EncodeVertices(const std::vector<Vertex>& vertices) {
  std::string bytes(meshopt_encodeVertexBufferBound(vertices.size(), sizeof(Vertex)), '\0');
  bytes.resize(meshopt_encodeVertexBuffer(reinterpret_cast<unsigned char*>(bytes.data()),
                                          bytes.size(), vertices.data(), vertices.size(),
                                          sizeof(Vertex)));
  return bytes;
}

std::string EncodeTriangles(const frames::RoundedSurface& surface) {
  const auto* const indices = reinterpret_cast<const uint32_t*>(surface.triangles.data());
  const size_t num_indices = 3 * surface.triangles.size();
  std::string bytes(meshopt_encodeIndexBufferBound(num_indices, surface.positions.size()), '\0');
  bytes.resize(meshopt_encodeIndexBuffer(reinterpret_cast<unsigned char*>(bytes.data()),
                                         bytes.size(), indices, num_indices));
  return bytes;
}

}  // namespace

absl::StatusOr<std::string> EncodeMeshopt(const mesh::TriangleMesh& mesh,
                                          const frames::RoundingOptions& options) {
  const int bits = options.position_bits;
  if (bits < frames::kMinPositionBits || bits > frames::kMaxRoundedBits) {
    return absl::InvalidArgumentError(absl::StrCat("position_bits is ", bits, ", not in [",
                                                   frames::kMinPositionBits, ", ",
                                                   frames::kMaxRoundedBits, "]"));
  }
  LB_RETURN_IF_ERROR(mesh::Validate(mesh));
  const frames::RoundedSurface surface = frames::RoundSurface(mesh, options);
  v1::MeshoptMesh message;
  message.set_num_vertices(static_cast<uint32_t>(surface.positions.size()));
  message.set_num_triangles(static_cast<uint32_t>(surface.triangles.size()));
  message.mutable_origin_m()->Add(surface.origin_m.begin(), surface.origin_m.end());
  message.set_step_m(surface.step_m);
  message.set_positions(EncodeVertices(surface.positions));
  message.set_triangles(EncodeTriangles(surface));
  if (!surface.normals.empty()) message.set_normals(EncodeVertices(surface.normals));
  if (!surface.velocities.empty()) {
    message.set_velocities(EncodeVertices(surface.velocities));
    message.set_velocity_step_m_s(surface.velocity_step_m_s);
  }
  if (!surface.rest.empty()) {
    message.set_rest_positions(EncodeVertices(surface.rest));
    message.mutable_rest_origin_m()->Add(surface.origin_m.begin(), surface.origin_m.end());
    message.set_rest_step_m(surface.rest_step_m);
    message.set_rest_step_s(surface.rest_step_s);
  }
  return message.SerializeAsString();
}

}  // namespace liquidblend::encode
