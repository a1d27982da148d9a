// The mesh cache of Blender's Mantaflow, as written by Blender 3.4. Both files are gzip, numbers
// little endian.
//   .bobj.gz  int32 nv; float32 position[nv][3]; int32 nn = nv; float32 normal[nn][3]; int32 nt;
//             int32 triangle[nt][3]
//   .uni      char[4] "MD01"; int32 n = nv; int32[3] not set; int32 kind of element; int32 bytes
//             per element = 12; char[256]; uint64 time stamp; float32 velocity[n][3]
#include <bit>
#include <cstring>
#include <limits>
#include <string>

#include "absl/strings/str_cat.h"
#include "core/base/status_macros.h"
#include "worker/ingest/formats/gzip.h"
#include "worker/ingest/formats/readers.h"

namespace liquidblend::ingest {
namespace {

static_assert(std::endian::native == std::endian::little, "files are little endian");

constexpr int64_t kTripleSize = 12;  // bytes of float[3] and of int32[3]
constexpr int64_t kUniInfoAndTimeSize = 256 + 8;

absl::StatusOr<int32_t> ReadInt(GzipReader& reader) {
  int32_t value = 0;
  LB_RETURN_IF_ERROR(reader.Read(std::as_writable_bytes(std::span(&value, 1))));
  return value;
}

template <typename Matrix>
absl::Status ReadColumns(GzipReader& reader, Matrix& columns) {
  return reader.Read(
      std::as_writable_bytes(std::span(columns.data(), static_cast<size_t>(columns.size()))));
}

// A count of triples that the stream may still hold without being a bomb.
absl::StatusOr<int32_t> ReadCount(GzipReader& reader, int64_t max_size, const char* what) {
  LB_ASSIGN_OR_RETURN(const int32_t count, ReadInt(reader));
  if (count < 0) {
    return absl::InvalidArgumentError(absl::StrCat("number of ", what, " is ", count));
  }
  if (count * kTripleSize > max_size - reader.position()) {
    return absl::InvalidArgumentError(absl::StrCat("promises ", count, " ", what,
                                                   ", more than so small a file can hold (at most ",
                                                   max_size, " bytes are inflated)"));
  }
  return count;
}

}  // namespace

absl::StatusOr<mesh::TriangleMesh> ReadMantaflowMesh(std::span<const std::byte> bytes) {
  const int64_t max_size = MaxInflatedSize(static_cast<int64_t>(bytes.size()));
  GzipReader reader(bytes);
  mesh::TriangleMesh mesh;
  LB_ASSIGN_OR_RETURN(const int32_t num_vertices, ReadCount(reader, max_size, "vertices"));
  mesh.vertices.resize(3, num_vertices);
  LB_RETURN_IF_ERROR(ReadColumns(reader, mesh.vertices));
  LB_ASSIGN_OR_RETURN(const int32_t num_normals, ReadCount(reader, max_size, "normals"));
  if (num_normals != num_vertices) {
    return absl::InvalidArgumentError(
        absl::StrCat(num_normals, " normals for ", num_vertices, " vertices"));
  }
  LB_RETURN_IF_ERROR(reader.Skip(num_normals * kTripleSize));
  LB_ASSIGN_OR_RETURN(const int32_t num_triangles, ReadCount(reader, max_size, "triangles"));
  mesh.triangles.resize(3, num_triangles);
  LB_RETURN_IF_ERROR(ReadColumns(reader, mesh.triangles));
  LB_RETURN_IF_ERROR(reader.ExpectEnd());
  return mesh;
}

absl::StatusOr<Eigen::Matrix3Xf> ReadMantaflowVelocities(std::span<const std::byte> bytes,
                                                         int64_t num_vertices) {
  GzipReader reader(bytes);
  char magic[4];
  LB_RETURN_IF_ERROR(reader.Read(std::as_writable_bytes(std::span(magic))));
  if (std::memcmp(magic, "MD01", sizeof(magic)) != 0) {
    return absl::InvalidArgumentError("the file does not begin with MD01");
  }
  LB_ASSIGN_OR_RETURN(const int32_t count, ReadInt(reader));
  if (count != num_vertices) {
    return absl::InvalidArgumentError(
        absl::StrCat(count, " velocities for the ", num_vertices, " vertices of the frame's mesh"));
  }
  LB_RETURN_IF_ERROR(reader.Skip(4 * sizeof(int32_t)));  // dimensions, not set; kind of element
  LB_ASSIGN_OR_RETURN(const int32_t element_size, ReadInt(reader));
  if (element_size != kTripleSize) {
    return absl::InvalidArgumentError(
        absl::StrCat("bytes per element are ", element_size, ", not ", kTripleSize));
  }
  LB_RETURN_IF_ERROR(reader.Skip(kUniInfoAndTimeSize));
  Eigen::Matrix3Xf velocities(3, count);
  LB_RETURN_IF_ERROR(ReadColumns(reader, velocities));
  LB_RETURN_IF_ERROR(reader.ExpectEnd());
  return velocities;
}

}  // namespace liquidblend::ingest
