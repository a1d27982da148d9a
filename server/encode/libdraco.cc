#include "server/encode/libdraco.h"

#include <draco/compression/config/compression_shared.h>
#include <draco/compression/expert_encode.h>
#include <draco/mesh/mesh.h>
#include <draco/metadata/geometry_metadata.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <memory>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "core/base/status_macros.h"
#include "core/frames/used_part.h"

namespace liquidblend::encode {
namespace {

constexpr int kPositionId = 0;     // number of the attribute that is always there
constexpr int kNormalBits = 10;    // octahedral: a tenth of a degree
constexpr int kVelocityBits = 14;  // of the frame's own range
constexpr int kRestBits = 16;      // likewise

absl::Status StatusOf(const draco::Status& status) {
  if (status.ok()) return absl::OkStatus();
  return absl::InternalError(absl::StrCat("libdraco: ", status.error_msg_string()));
}

// Moves a position onto the grid's border if it is outside. libdraco does not clamp: such a
// position would need more bits than it has.
std::array<float, 3> ClampToGrid(const Eigen::Vector3f& position, const frames::Grid& grid) {
  std::array<float, 3> clamped;
  for (int k = 0; k < 3; ++k) {
    clamped[k] = std::clamp(position[k], grid.origin[k], grid.origin[k] + grid.extent_m);
  }
  return clamped;
}

// Adds an attribute of kSize floats per vertex and returns its number; value(v): of vertex v of the
// mesh.
template <size_t kSize = 3, typename Value>
int AddAttribute(draco::GeometryAttribute::Type type, const frames::UsedPart& used,
                 const Value& value, draco::Mesh& out) {
  draco::GeometryAttribute attribute;
  attribute.Init(type, nullptr, kSize, draco::DT_FLOAT32, false, sizeof(float) * kSize, 0);
  const int id = out.AddAttribute(attribute, /*identity_mapping=*/true, out.num_points());
  for (uint32_t v = 0; v < out.num_points(); ++v) {
    const std::array<float, kSize> numbers = value(used.vertices[v]);
    out.attribute(id)->SetAttributeValue(draco::AttributeValueIndex(v), numbers.data());
  }
  return id;
}

// Input of the encoder, and the numbers of the optional attributes; -1: none.
struct DracoMesh {
  std::unique_ptr<draco::Mesh> mesh;
  int normal = -1;
  int velocity = -1;
  int rest = -1;
};

void SetName(const char* name, int attribute, draco::Mesh& mesh) {
  auto metadata = std::make_unique<draco::AttributeMetadata>();
  metadata->AddEntryString("name", name);
  mesh.AddAttributeMetadata(attribute, std::move(metadata));
}

// Builds the mesh without libdraco's builder, which removes duplicates. That is slow and changes
// the mesh.
DracoMesh ToDraco(const mesh::TriangleMesh& mesh, const frames::UsedPart& used,
                  const frames::Grid& grid) {
  DracoMesh out{std::make_unique<draco::Mesh>()};
  out.mesh->set_num_points(static_cast<uint32_t>(used.vertices.size()));
  AddAttribute(
      draco::GeometryAttribute::POSITION, used,
      [&](int32_t v) { return ClampToGrid(mesh.vertices.col(v), grid); }, *out.mesh);
  const auto column = [](const Eigen::Matrix3Xf& values, int32_t v) {
    return std::array<float, 3>{values(0, v), values(1, v), values(2, v)};
  };
  if (mesh.normals.cols() > 0) {
    out.normal = AddAttribute(
        draco::GeometryAttribute::NORMAL, used, [&](int32_t v) { return column(mesh.normals, v); },
        *out.mesh);
  }
  if (mesh.velocities.cols() > 0) {
    out.velocity = AddAttribute(
        draco::GeometryAttribute::GENERIC, used,
        [&](int32_t v) { return column(mesh.velocities, v); }, *out.mesh);
    SetName(kVelocityName, out.velocity, *out.mesh);
  }
  if (mesh.rest.cols() > 0) {
    const auto place = [&](int32_t v) {
      return std::array<float, 4>{mesh.rest(0, v), mesh.rest(1, v), mesh.rest(2, v),
                                  mesh.rest(3, v)};
    };
    out.rest = AddAttribute<4>(draco::GeometryAttribute::GENERIC, used, place, *out.mesh);
    SetName(kRestName, out.rest, *out.mesh);
  }
  out.mesh->SetNumFaces(used.triangles.size());
  for (uint32_t t = 0; t < used.triangles.size(); ++t) {
    const auto& [a, b, c] = used.triangles[t];
    out.mesh->SetFace(draco::FaceIndex(t),
                      {draco::PointIndex(a), draco::PointIndex(b), draco::PointIndex(c)});
  }
  return out;
}

// libdraco's speed for a preset. A higher speed also means less precise probabilities.
struct Settings {
  int speed;
  EdgebreakerMethod method;
  draco::PredictionSchemeMethod prediction;
};

Settings SettingsOf(Preset preset) {
  switch (preset) {
    case Preset::kBalanced:
      return {4, EdgebreakerMethod::kValence, draco::MESH_PREDICTION_PARALLELOGRAM};
    case Preset::kSmallest:
      return {0, EdgebreakerMethod::kValence,
              draco::MESH_PREDICTION_CONSTRAINED_MULTI_PARALLELOGRAM};
    default:
      return {7, EdgebreakerMethod::kStandard, draco::MESH_PREDICTION_PARALLELOGRAM};
  }
}

void ChooseMethods(const DracoOptions& options, const DracoMesh& mesh,
                   draco::ExpertEncoder& encoder) {
  const Settings settings = SettingsOf(options.preset);
  encoder.SetEncodingMethod(draco::MESH_EDGEBREAKER_ENCODING);
  encoder.options().SetGlobalInt("edgebreaker_method", static_cast<int>(settings.method));
  encoder.options().SetGlobalBool("split_mesh_on_seams", true);  // there are none
  if (mesh.normal >= 0) encoder.SetAttributeQuantization(mesh.normal, kNormalBits);
  if (mesh.velocity >= 0) encoder.SetAttributeQuantization(mesh.velocity, kVelocityBits);
  if (mesh.rest >= 0) encoder.SetAttributeQuantization(mesh.rest, kRestBits);
  draco::Options position;  // its setters round to six decimals and know fewer schemes
  position.SetInt("quantization_bits", options.position_bits);
  const std::array<float, 3>& origin = options.grid.origin;
  position.SetString("quantization_origin",
                     absl::StrFormat("%.9g %.9g %.9g", origin[0], origin[1], origin[2]));
  position.SetString("quantization_range", absl::StrFormat("%.9g", options.grid.extent_m));
  position.SetInt("prediction_scheme", settings.prediction);
  encoder.options().SetAttributeOptions(kPositionId, position);
}

}  // namespace

absl::StatusOr<std::string> EncodeWithLibdraco(const mesh::TriangleMesh& mesh,
                                               const DracoOptions& options) {
  const frames::UsedPart used = frames::FindUsedPart(mesh);
  const DracoMesh draco_mesh = ToDraco(mesh, used, options.grid);
  draco::ExpertEncoder encoder(*draco_mesh.mesh);
  const int speed = SettingsOf(options.preset).speed;
  encoder.SetSpeedOptions(speed, speed);
  if (used.triangles.empty()) {
    // Edgebreaker refuses a mesh without triangles, and the decoder a quantised attribute without
    // values. Every decoder reads this encoding.
    encoder.SetEncodingMethod(draco::MESH_SEQUENTIAL_ENCODING);
  } else {
    ChooseMethods(options, draco_mesh, encoder);
  }
  draco::EncoderBuffer buffer;
  LB_RETURN_IF_ERROR(StatusOf(encoder.EncodeToBuffer(&buffer)));
  return std::string(buffer.data(), buffer.size());
}

}  // namespace liquidblend::encode
