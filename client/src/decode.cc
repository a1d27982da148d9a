#include "liquidblend/decode.h"

#include <draco/compression/decode.h>

#include <memory>
#include <utility>

#include "absl/strings/str_cat.h"
#include "client/src/weld.h"

namespace liquidblend {
namespace {

// The one converter of draco::Status.
absl::Status FromDraco(const draco::Status& status) {
  return absl::DataLossError(absl::StrCat("damaged Draco mesh: ", status.error_msg_string()));
}

void CopyPositions(const draco::PointAttribute& positions, int num_points, Mesh* mesh) {
  mesh->positions.resize(3 * static_cast<size_t>(num_points));
  for (int p = 0; p < num_points; ++p) {
    positions.ConvertValue<float, 3>(positions.mapped_index(draco::PointIndex(p)),
                                     &mesh->positions[3 * static_cast<size_t>(p)]);
  }
}

absl::Status CopyTriangles(const draco::Mesh& draco_mesh, Mesh* mesh) {
  mesh->triangles.reserve(3 * static_cast<size_t>(draco_mesh.num_faces()));
  for (draco::FaceIndex f(0); f < draco_mesh.num_faces(); ++f) {
    for (const draco::PointIndex& p : draco_mesh.face(f)) {
      if (p.value() >= draco_mesh.num_points()) {
        return absl::DataLossError(absl::StrCat("damaged Draco mesh: triangle ", f.value(),
                                                " refers to vertex ", p.value(), " of ",
                                                draco_mesh.num_points()));
      }
      mesh->triangles.push_back(p.value());
    }
  }
  return absl::OkStatus();
}

}  // namespace

absl::StatusOr<Mesh> DecodeMesh(const std::string& draco_bytes) {
  draco::DecoderBuffer buffer;
  buffer.Init(draco_bytes.data(), draco_bytes.size());
  const auto type = draco::Decoder::GetEncodedGeometryType(&buffer);
  if (!type.ok() || type.value() != draco::TRIANGULAR_MESH) {
    return absl::InvalidArgumentError(
        absl::StrCat("not a Draco mesh (", draco_bytes.size(), " bytes)"));
  }
  draco::Decoder decoder;
  auto decoded = decoder.DecodeMeshFromBuffer(&buffer);
  if (!decoded.ok()) return FromDraco(decoded.status());
  const std::unique_ptr<draco::Mesh> draco_mesh = std::move(decoded).value();

  const draco::PointAttribute* positions =
      draco_mesh->GetNamedAttribute(draco::GeometryAttribute::POSITION);
  if (positions == nullptr || positions->num_components() != 3) {
    return absl::InvalidArgumentError("the Draco mesh has no POSITION attribute of three numbers");
  }
  Mesh mesh;
  CopyPositions(*positions, static_cast<int>(draco_mesh->num_points()), &mesh);
  if (absl::Status status = CopyTriangles(*draco_mesh, &mesh); !status.ok()) return status;
  WeldOpenEdges(mesh);
  return mesh;
}

}  // namespace liquidblend
