#include <draco/compression/encode.h>

#include <cstdlib>
#include <memory>
#include <utility>
#include <vector>

#include "tests/client/fake_server.h"

namespace liquidblend::testing {
namespace {

int AddAttribute(draco::GeometryAttribute::Type type, const std::vector<float>& values,
                 draco::Mesh& out) {
  draco::GeometryAttribute attribute;
  attribute.Init(type, nullptr, 3, draco::DT_FLOAT32, false, 3 * sizeof(float), 0);
  const int id = out.AddAttribute(attribute, true, out.num_points());
  for (uint32_t v = 0; v < out.num_points(); ++v) {
    out.attribute(id)->SetAttributeValue(draco::AttributeValueIndex(v), &values[3 * v]);
  }
  return id;
}

}  // namespace

Mesh MakeOctahedron(double weight, double time_s) {
  const auto r = static_cast<float>(1.0 + weight);
  const auto x = static_cast<float>(time_s);
  Mesh mesh;
  mesh.positions = {x + r, 0, 0, x - r, 0, 0, x, r, 0, x, -r, 0, x, 0, r, x, 0, -r};
  mesh.triangles = {0, 2, 4, 2, 1, 4, 1, 3, 4, 3, 0, 4, 2, 0, 5, 1, 2, 5, 3, 1, 5, 0, 3, 5};
  return mesh;
}

std::string EncodeDraco(const Mesh& mesh, int position_bits) {
  draco::Mesh out;
  out.set_num_points(static_cast<uint32_t>(mesh.num_vertices()));
  AddAttribute(draco::GeometryAttribute::POSITION, mesh.positions, out);
  if (!mesh.normals.empty()) AddAttribute(draco::GeometryAttribute::NORMAL, mesh.normals, out);
  if (!mesh.velocities.empty()) {
    const int id = AddAttribute(draco::GeometryAttribute::GENERIC, mesh.velocities, out);
    auto metadata = std::make_unique<draco::AttributeMetadata>();
    metadata->AddEntryString("name", "velocity");
    out.AddAttributeMetadata(id, std::move(metadata));
  }
  for (uint32_t t = 0; t < mesh.num_triangles(); ++t) {
    out.AddFace({draco::PointIndex(mesh.triangles[3 * t]),
                 draco::PointIndex(mesh.triangles[3 * t + 1]),
                 draco::PointIndex(mesh.triangles[3 * t + 2])});
  }
  draco::Encoder encoder;
  encoder.SetAttributeQuantization(draco::GeometryAttribute::POSITION, position_bits);
  draco::EncoderBuffer buffer;
  if (!encoder.EncodeMeshToBuffer(out, &buffer).ok()) std::abort();
  return std::string(buffer.data(), buffer.size());
}

}  // namespace liquidblend::testing
