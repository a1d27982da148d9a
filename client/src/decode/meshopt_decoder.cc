#include "client/src/decode/meshopt_decoder.h"

#include <meshoptimizer.h>

#include <algorithm>
#include <cmath>
#include <cstddef>

#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"

namespace liquidblend::client {
namespace {

// The codecs' smallest sizes: 2 bits say that a byte of 16 vertices does not change, and a triangle
// takes a byte. A message that claims more than that does not get memory for it.
constexpr size_t kMaxVerticesPerByte = 8;
constexpr size_t kMaxSpareVertices = 4096;  // in the last block

absl::Status Damaged(const std::string& what) {
  return absl::DataLossError(absl::StrCat("damaged MeshoptMesh: ", what));
}

template <typename Vertex>
absl::Status DecodeVertices(const std::string& bytes, size_t count, const char* name,
                            std::vector<Vertex>& vertices) {
  vertices.resize(count);
  if (count == 0) return absl::OkStatus();
  const int error = meshopt_decodeVertexBuffer(vertices.data(), count, sizeof(Vertex),
                                               reinterpret_cast<const unsigned char*>(bytes.data()),
                                               bytes.size());
  return error == 0 ? absl::OkStatus() : Damaged(name);
}

absl::Status DecodeTriangles(const v1::MeshoptMesh& message,
                             std::vector<std::array<uint32_t, 3>>& triangles) {
  triangles.resize(message.num_triangles());
  if (triangles.empty()) return absl::OkStatus();
  const std::string& bytes = message.triangles();
  const int error =
      meshopt_decodeIndexBuffer(triangles.data(), 3 * triangles.size(), sizeof(uint32_t),
                                reinterpret_cast<const unsigned char*>(bytes.data()), bytes.size());
  if (error != 0) return Damaged("triangles");
  uint32_t highest = 0;
  for (const std::array<uint32_t, 3>& corners : triangles) {
    highest = std::max({highest, corners[0], corners[1], corners[2]});
  }
  if (highest < message.num_vertices()) return absl::OkStatus();
  return Damaged(
      absl::StrCat("a triangle refers to vertex ", highest, " of ", message.num_vertices()));
}

// Whether origin + step * n is finite for every n of 16 bits.
bool IsFiniteGrid(float origin, float step) {
  return std::isfinite(origin) && std::isfinite(origin + step * 65535.0F);
}

bool IsFiniteGrid(const google::protobuf::RepeatedField<float>& origin, float step) {
  return std::all_of(origin.begin(), origin.end(),
                     [&](float value) { return IsFiniteGrid(value, step); });
}

bool HasFiniteNumbers(const v1::MeshoptMesh& message) {
  return IsFiniteGrid(message.origin_m(), message.step_m()) &&
         IsFiniteGrid(0.0F, message.velocity_step_m_s()) &&
         IsFiniteGrid(message.rest_origin_m(), message.rest_step_m()) &&
         IsFiniteGrid(message.rest_origin_s(), message.rest_step_s());
}

std::array<float, 3> VectorOf(const google::protobuf::RepeatedField<float>& values) {
  return {values[0], values[1], values[2]};
}

}  // namespace

bool IsDraco(const std::string& bytes) { return absl::StartsWith(bytes, "DRACO"); }

absl::Status MeshoptDecoder::Open(const std::string& bytes) {
  if (!message_.ParseFromString(bytes) || message_.origin_m_size() != 3) {
    return absl::InvalidArgumentError(
        absl::StrCat("neither a Draco mesh nor a MeshoptMesh (", bytes.size(), " bytes)"));
  }
  if (has_rest() && message_.rest_origin_m_size() != 3)
    return Damaged("no origin of rest positions");
  if (!HasFiniteNumbers(message_)) return Damaged("an origin or a step is not finite");
  if (num_vertices() > kMaxVerticesPerByte * message_.positions().size() + kMaxSpareVertices) {
    return Damaged(
        absl::StrCat(num_vertices(), " vertices in ", message_.positions().size(), " bytes"));
  }
  if (num_triangles() > message_.triangles().size()) {
    return Damaged(
        absl::StrCat(num_triangles(), " triangles in ", message_.triangles().size(), " bytes"));
  }
  return absl::OkStatus();
}

absl::Status MeshoptDecoder::Decode() {
  const size_t count = num_vertices();
  const v1::MeshoptMesh& message = message_;
  const absl::Status decoded[] = {
      DecodeVertices(message.positions(), count, "positions", positions_),
      DecodeVertices(message.normals(), has_normals() ? count : 0, "normals", normals_),
      DecodeVertices(message.velocities(), has_velocities() ? count : 0, "velocities", velocities_),
      DecodeVertices(message.rest_positions(), has_rest() ? count : 0, "rest positions", rest_),
      DecodeTriangles(message, triangles_)};
  for (const absl::Status& status : decoded) {
    if (!status.ok()) return status;
  }
  return absl::OkStatus();
}

void MeshoptDecoder::Write(const MeshMemory& out) const {
  const v1::MeshoptMesh& message = message_;
  PackedMesh packed = {.positions = positions_,
                       .triangles = triangles_,
                       .normals = normals_,
                       .velocities = velocities_,
                       .rest = rest_,
                       .origin_m = VectorOf(message.origin_m()),
                       .step_m = message.step_m(),
                       .velocity_step_m_s = message.velocity_step_m_s(),
                       .rest_origin_s = message.rest_origin_s(),
                       .rest_step_s = message.rest_step_s()};
  if (has_rest()) {
    packed.rest_origin_m = VectorOf(message.rest_origin_m());
    packed.rest_step_m = message.rest_step_m();
  }
  Unpack(packed, out);
}

}  // namespace liquidblend::client
