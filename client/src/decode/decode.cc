#include "liquidblend/decode.h"

#include <draco/compression/decode.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <memory>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "client/src/decode/draco_mesh.h"
#include "client/src/decode/draco_size.h"
#include "client/src/decode/meshopt_decoder.h"

namespace liquidblend {
namespace {

// The one converter of draco::Status.
absl::Status FromDraco(const draco::Status& status) {
  return absl::DataLossError(absl::StrCat("damaged Draco mesh: ", status.error_msg_string()));
}

// kSize numbers per vertex.
template <int kSize>
std::vector<float> CopyAttribute(const draco::PointAttribute& attribute, uint32_t num_points) {
  std::vector<float> values(kSize * static_cast<size_t>(num_points));
  for (uint32_t p = 0; p < num_points; ++p) {
    attribute.ConvertValue<float, kSize>(attribute.mapped_index(draco::PointIndex(p)),
                                         &values[kSize * static_cast<size_t>(p)]);
  }
  return values;
}

const draco::PointAttribute* FindNamed(const draco::Mesh& draco_mesh, const char* name) {
  const int id = draco_mesh.GetAttributeIdByMetadataEntry("name", name);
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

absl::StatusOr<Mesh> DecodeMeshopt(const std::string& bytes) {
  client::MeshoptDecoder decoder;
  if (absl::Status status = decoder.Open(bytes); !status.ok()) return status;
  if (absl::Status status = decoder.Decode(); !status.ok()) return status;
  Mesh mesh;
  const size_t count = decoder.num_vertices();
  mesh.positions.resize(3 * count);
  mesh.triangles.resize(3 * size_t{decoder.num_triangles()});
  if (decoder.has_normals()) mesh.normals.resize(3 * count);
  if (decoder.has_velocities()) mesh.velocities.resize(3 * count);
  if (decoder.has_rest()) mesh.rest.resize(4 * count);
  const client::MeshMemory memory = {mesh.positions.data(), mesh.normals.data(),
                                     mesh.velocities.data(), mesh.rest.data(),
                                     mesh.triangles.data()};
  decoder.Write(memory);
  return mesh;
}

// Sets the attribute's numbers and its id; none of either if it is not one of kSize numbers, or the
// mesh is empty.
// kDataLoss if they are not floats (to convert other types is not defined for all bytes that
// libdraco accepts), or one is not finite.
template <int kSize = 3>
absl::Status TakeAttribute(const draco::PointAttribute* attribute, uint32_t num_points,
                           std::vector<float>* values, int* id) {
  if (attribute == nullptr || attribute->num_components() != kSize || num_points == 0) {
    return absl::OkStatus();
  }
  *id = static_cast<int>(attribute->unique_id());
  if (attribute->data_type() != draco::DT_FLOAT32) {
    return absl::DataLossError(
        absl::StrCat("damaged Draco mesh: attribute ", *id, " has numbers of Draco's type ",
                     static_cast<int>(attribute->data_type()), " instead of floats"));
  }
  *values = CopyAttribute<kSize>(*attribute, num_points);
  const auto bad = std::find_if_not(values->begin(), values->end(),
                                    [](float value) { return std::isfinite(value); });
  if (bad == values->end()) return absl::OkStatus();
  return absl::DataLossError(absl::StrCat("damaged Draco mesh: attribute ", *id, " of vertex ",
                                          (bad - values->begin()) / kSize, " is ", *bad));
}

}  // namespace

absl::StatusOr<DracoMesh> DecodeDracoMesh(const std::string& draco_bytes) {
  if (absl::Status status = client::CheckDracoSize(draco_bytes); !status.ok()) return status;
  draco::DecoderBuffer buffer;
  buffer.Init(draco_bytes.data(), draco_bytes.size());
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
  const absl::Status statuses[] = {
      TakeAttribute(positions, num_points, &out.mesh.positions, &out.position_id),
      TakeAttribute(draco_mesh->GetNamedAttribute(draco::GeometryAttribute::NORMAL), num_points,
                    &out.mesh.normals, &out.normal_id),
      TakeAttribute(FindNamed(*draco_mesh, "velocity"), num_points, &out.mesh.velocities,
                    &out.velocity_id),
      TakeAttribute<4>(FindNamed(*draco_mesh, "rest"), num_points, &out.mesh.rest, &out.rest_id),
      CopyTriangles(*draco_mesh, &out.mesh)};
  for (const absl::Status& status : statuses) {
    if (!status.ok()) return status;
  }
  return out;
}

absl::StatusOr<Mesh> DecodeMesh(const std::string& bytes) {
  if (!client::IsDraco(bytes)) return DecodeMeshopt(bytes);
  absl::StatusOr<DracoMesh> decoded = DecodeDracoMesh(bytes);
  if (!decoded.ok()) return decoded.status();
  WeldOpenEdges(decoded->mesh);
  return std::move(decoded->mesh);
}

}  // namespace liquidblend
