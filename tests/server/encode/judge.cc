#include "tests/server/encode/judge.h"

#include <draco/compression/decode.h>
#include <draco/mesh/mesh.h>

#include <algorithm>
#include <cmath>

#include "absl/status/status.h"

namespace liquidblend::encode {

double StepOf(const DracoOptions& options) {
  return options.grid.extent_m / (std::exp2(options.position_bits) - 1.0);
}

absl::StatusOr<mesh::TriangleMesh> TryDecode(const std::string& data) {
  draco::DecoderBuffer buffer;
  buffer.Init(data.data(), data.size());
  draco::Decoder decoder;
  auto decoded = decoder.DecodeMeshFromBuffer(&buffer);
  if (!decoded.ok()) return absl::DataLossError(decoded.status().error_msg_string());
  const draco::Mesh& mesh = *decoded.value();
  const draco::PointAttribute* position =
      mesh.GetNamedAttribute(draco::GeometryAttribute::POSITION);
  const draco::PointAttribute* normal = mesh.GetNamedAttribute(draco::GeometryAttribute::NORMAL);
  const int velocity = mesh.GetAttributeIdByMetadataEntry("name", kVelocityName);
  if (mesh.num_attributes() != 1 + (normal != nullptr) + (velocity >= 0)) {
    return absl::DataLossError("other attributes");
  }
  mesh::TriangleMesh out;
  const auto read = [&](const draco::PointAttribute* attribute, Eigen::Matrix3Xf& values) {
    values.resize(3, mesh.num_points());
    for (uint32_t v = 0; v < mesh.num_points(); ++v) {
      attribute->GetMappedValue(draco::PointIndex(v), values.col(v).data());
    }
  };
  read(position, out.vertices);
  if (normal != nullptr) read(normal, out.normals);
  if (velocity >= 0) read(mesh.attribute(velocity), out.velocities);
  out.triangles.resize(3, mesh.num_faces());
  for (uint32_t t = 0; t < mesh.num_faces(); ++t) {
    for (int k = 0; k < 3; ++k) {
      out.triangles(k, t) = static_cast<int>(mesh.face(draco::FaceIndex(t))[k].value());
    }
  }
  return out;
}

std::vector<std::array<int64_t, 9>> NodesOf(const mesh::TriangleMesh& mesh,
                                            const DracoOptions& options) {
  using Triangle = std::array<int64_t, 9>;
  std::vector<Triangle> triangles;
  for (Eigen::Index t = 0; t < mesh.num_triangles(); ++t) {
    Triangle nodes;
    for (int i = 0; i < 9; ++i) {
      const double x = mesh.vertices(i % 3, mesh.triangles(i / 3, t));
      nodes[i] = std::llround((x - options.grid.origin[i % 3]) / StepOf(options));
    }
    Triangle& lowest = triangles.emplace_back(nodes);
    for (int turn = 0; turn < 2; ++turn) {
      std::rotate(nodes.begin(), nodes.begin() + 3, nodes.end());
      lowest = std::min(lowest, nodes);
    }
  }
  std::sort(triangles.begin(), triangles.end());
  return triangles;
}

}  // namespace liquidblend::encode
