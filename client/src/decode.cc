#include "liquidblend/decode.h"

#include <draco/compression/decode.h>

#include <cstdint>
#include <memory>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "client/src/draco_mesh.h"

namespace liquidblend {
namespace {

// The one converter of draco::Status.
absl::Status FromDraco(const draco::Status& status) {
  return absl::DataLossError(absl::StrCat("damaged Draco mesh: ", status.error_msg_string()));
}

// Three numbers per vertex; none if there is no such attribute of three numbers.
std::vector<float> CopyAttribute(const draco::PointAttribute* attribute, uint32_t num_points) {
  std::vector<float> values;
  if (attribute == nullptr || attribute->num_components() != 3) return values;
  values.resize(3 * static_cast<size_t>(num_points));
  for (uint32_t p = 0; p < num_points; ++p) {
    attribute->ConvertValue<float, 3>(attribute->mapped_index(draco::PointIndex(p)),
                                      &values[3 * static_cast<size_t>(p)]);
  }
  return values;
}

const draco::PointAttribute* FindVelocities(const draco::Mesh& draco_mesh) {
  const int id = draco_mesh.GetAttributeIdByMetadataEntry("name", "velocity");
  return id < 0 ? nullptr : draco_mesh.attribute(id);
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

// Sets the attribute's numbers and its id; none of either if it is not one of three numbers.
void TakeAttribute(const draco::PointAttribute* attribute, uint32_t num_points,
                   std::vector<float>* values, int* id) {
  *values = CopyAttribute(attribute, num_points);
  if (!values->empty()) *id = static_cast<int>(attribute->unique_id());
}

}  // namespace

absl::StatusOr<DracoMesh> DecodeDracoMesh(const std::string& draco_bytes) {
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
  DracoMesh out;
  const uint32_t num_points = draco_mesh->num_points();
  TakeAttribute(positions, num_points, &out.mesh.positions, &out.position_id);
  TakeAttribute(draco_mesh->GetNamedAttribute(draco::GeometryAttribute::NORMAL), num_points,
                &out.mesh.normals, &out.normal_id);
  TakeAttribute(FindVelocities(*draco_mesh), num_points, &out.mesh.velocities, &out.velocity_id);
  if (absl::Status status = CopyTriangles(*draco_mesh, &out.mesh); !status.ok()) return status;
  return out;
}

absl::StatusOr<Mesh> DecodeMesh(const std::string& draco_bytes) {
  absl::StatusOr<DracoMesh> decoded = DecodeDracoMesh(draco_bytes);
  if (!decoded.ok()) return decoded.status();
  WeldOpenEdges(decoded->mesh);
  return std::move(decoded->mesh);
}

}  // namespace liquidblend
