#include "server/encode/mesh_files.h"

#include <charconv>
#include <cstdint>

#include "absl/strings/str_cat.h"
#include "server/encode/bytes.h"

namespace liquidblend::encode {
namespace {

bool IsDegenerate(const mesh::TriangleMesh& mesh, Eigen::Index t) {
  const auto corners = mesh.triangles.col(t);
  return corners[0] == corners[1] || corners[1] == corners[2] || corners[2] == corners[0];
}

int64_t NumProper(const mesh::TriangleMesh& mesh) {
  int64_t count = 0;
  for (Eigen::Index t = 0; t < mesh.triangles.cols(); ++t) count += IsDegenerate(mesh, t) ? 0 : 1;
  return count;
}

// Appends the shortest text that reads back to the same float.
void AppendNumber(float value, std::string& text) {
  char digits[32];
  const std::to_chars_result result = std::to_chars(digits, digits + sizeof(digits), value);
  text.push_back(' ');
  text.append(digits, result.ptr);
}

void AppendColumns(const char* word, const Eigen::Matrix3Xf& columns, std::string& text) {
  for (Eigen::Index v = 0; v < columns.cols(); ++v) {
    text.append(word);
    for (int k = 0; k < 3; ++k) AppendNumber(columns(k, v), text);
    text.push_back('\n');
  }
}

}  // namespace

std::string EncodePly(const mesh::TriangleMesh& mesh) {
  const bool has_normals = mesh.normals.cols() > 0, has_velocities = mesh.velocities.cols() > 0;
  const bool has_rest = mesh.rest.cols() > 0;
  constexpr char kNormals[] = "property float nx\nproperty float ny\nproperty float nz\n";
  constexpr char kVelocities[] = "property float vx\nproperty float vy\nproperty float vz\n";
  constexpr char kRest[] =
      "property float rest_x\nproperty float rest_y\nproperty float rest_z\n"
      "property float rest_t\n";
  const int64_t num_triangles = NumProper(mesh);
  std::string bytes = absl::StrCat(
      "ply\nformat binary_little_endian 1.0\nelement vertex ", mesh.num_vertices(),
      "\nproperty float x\nproperty float y\nproperty float z\n", has_normals ? kNormals : "",
      has_velocities ? kVelocities : "", has_rest ? kRest : "", "element face ", num_triangles,
      "\nproperty list uchar int vertex_indices\nend_header\n");
  const auto put = [&](const auto& columns, Eigen::Index v) {
    for (int k = 0; k < columns.rows(); ++k) PutValue(columns(k, v), bytes);
  };
  for (Eigen::Index v = 0; v < mesh.vertices.cols(); ++v) {
    put(mesh.vertices, v);
    if (has_normals) put(mesh.normals, v);
    if (has_velocities) put(mesh.velocities, v);
    if (has_rest) put(mesh.rest, v);
  }
  for (Eigen::Index t = 0; t < mesh.triangles.cols(); ++t) {
    if (IsDegenerate(mesh, t)) continue;
    PutByte(3, bytes);
    for (int k = 0; k < 3; ++k) PutValue(static_cast<int32_t>(mesh.triangles(k, t)), bytes);
  }
  return bytes;
}

std::string EncodeObj(const mesh::TriangleMesh& mesh) {
  const bool has_normals = mesh.normals.cols() > 0;
  std::string text;
  AppendColumns("v", mesh.vertices, text);
  AppendColumns("vn", mesh.normals, text);
  for (Eigen::Index t = 0; t < mesh.triangles.cols(); ++t) {
    if (IsDegenerate(mesh, t)) continue;
    text.push_back('f');
    for (int k = 0; k < 3; ++k) {
      const int64_t number = int64_t{mesh.triangles(k, t)} + 1;
      absl::StrAppend(&text, " ", number);
      if (has_normals) absl::StrAppend(&text, "//", number);
    }
    text.push_back('\n');
  }
  return text;
}

}  // namespace liquidblend::encode
