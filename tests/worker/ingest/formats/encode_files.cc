#include "tests/worker/ingest/formats/encode_files.h"

#include <zlib.h>

#include <algorithm>
#include <cassert>
#include <cstring>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"

namespace liquidblend::ingest {
namespace {

void AppendBytes(Bytes& bytes, std::span<const std::byte> more) {
  const size_t before = bytes.size();
  bytes.resize(before + more.size());
  std::copy(more.begin(), more.end(), bytes.begin() + static_cast<std::ptrdiff_t>(before));
}

template <typename Number>
void Append(Bytes& bytes, Number number, bool is_reversed = false) {
  std::byte raw[sizeof(Number)];
  std::memcpy(raw, &number, sizeof(Number));
  if (is_reversed) std::reverse(raw, raw + sizeof(Number));
  AppendBytes(bytes, raw);
}

void AppendText(Bytes& bytes, std::string_view text) { AppendBytes(bytes, AsBytes(text)); }

template <typename Matrix>
void AppendColumns(Bytes& bytes, const Matrix& columns) {
  AppendBytes(bytes, std::as_bytes(std::span(columns.data(), static_cast<size_t>(columns.size()))));
}

}  // namespace

Bytes ToBytes(std::string_view text) {
  const std::span<const std::byte> bytes = AsBytes(text);
  return {bytes.begin(), bytes.end()};
}

std::span<const std::byte> AsBytes(std::string_view text) {
  return std::as_bytes(std::span(text.data(), text.size()));
}

Bytes Gzip(std::span<const std::byte> bytes) {
  z_stream stream = {};
  [[maybe_unused]] int result = deflateInit2(&stream, Z_DEFAULT_COMPRESSION, Z_DEFLATED,
                                             MAX_WBITS + 16, 8, Z_DEFAULT_STRATEGY);
  assert(result == Z_OK);
  Bytes compressed(deflateBound(&stream, bytes.size()));
  stream.next_in = reinterpret_cast<Bytef*>(const_cast<std::byte*>(bytes.data()));
  stream.avail_in = static_cast<uInt>(bytes.size());
  stream.next_out = reinterpret_cast<Bytef*>(compressed.data());
  stream.avail_out = static_cast<uInt>(compressed.size());
  result = deflate(&stream, Z_FINISH);
  assert(result == Z_STREAM_END);
  compressed.resize(stream.total_out);
  deflateEnd(&stream);
  return compressed;
}

Bytes RawBobj(const mesh::TriangleMesh& mesh) {
  Bytes bytes;
  Append(bytes, static_cast<int32_t>(mesh.num_vertices()));
  AppendColumns(bytes, mesh.vertices);
  Append(bytes, static_cast<int32_t>(mesh.num_vertices()));
  AppendColumns(bytes, mesh.vertices);  // normals are not read, any numbers do
  Append(bytes, static_cast<int32_t>(mesh.num_triangles()));
  AppendColumns(bytes, mesh.triangles);
  return bytes;
}

Bytes RawUni(const Eigen::Matrix3Xf& velocities) {
  Bytes bytes;
  AppendText(bytes, "MD01");
  Append(bytes, static_cast<int32_t>(velocities.cols()));
  for (const int32_t number : {7, 8, 9, 1, 12}) Append(bytes, number);
  bytes.resize(292);
  AppendColumns(bytes, velocities);
  return bytes;
}

Bytes Ply(const mesh::TriangleMesh& mesh, PlyKind kind) {
  const bool has_velocities = mesh.velocities.cols() > 0;
  const char* const name[] = {"ascii", "binary_little_endian", "binary_big_endian"};
  Bytes bytes;
  AppendText(bytes, absl::StrCat("ply\nformat ", name[static_cast<int>(kind)],
                                 " 1.0\ncomment for a test\nelement vertex ", mesh.num_vertices(),
                                 "\nproperty float x\nproperty float y\nproperty float z\n",
                                 has_velocities ? "property float vx\nproperty float vy\n" : "",
                                 has_velocities ? "property float vz\n" : "", "element face ",
                                 mesh.num_triangles(),
                                 "\nproperty list uchar int vertex_indices\nend_header\n"));
  for (Eigen::Index v = 0; v < mesh.vertices.cols(); ++v) {
    for (int row = 0; row < (has_velocities ? 6 : 3); ++row) {
      const float value = row < 3 ? mesh.vertices(row, v) : mesh.velocities(row - 3, v);
      if (kind == PlyKind::kAscii) {
        AppendText(bytes, absl::StrFormat("%.9g ", value));
      } else {
        Append(bytes, value, kind == PlyKind::kBigEndian);
      }
    }
  }
  for (Eigen::Index t = 0; t < mesh.triangles.cols(); ++t) {
    const Eigen::Vector3i c = mesh.triangles.col(t);
    if (kind == PlyKind::kAscii) {
      AppendText(bytes, absl::StrCat("3 ", c[0], " ", c[1], " ", c[2], "\n"));
      continue;
    }
    Append(bytes, uint8_t{3});
    for (int k = 0; k < 3; ++k) Append(bytes, c[k], kind == PlyKind::kBigEndian);
  }
  return bytes;
}

Bytes Obj(const mesh::TriangleMesh& mesh) {
  Bytes bytes;
  AppendText(bytes, "# for a test\no liquid\n");
  for (Eigen::Index v = 0; v < mesh.vertices.cols(); ++v) {
    AppendText(bytes, absl::StrFormat("v %.9g %.9g %.9g\n", mesh.vertices(0, v),
                                      mesh.vertices(1, v), mesh.vertices(2, v)));
  }
  for (Eigen::Index t = 0; t < mesh.triangles.cols(); ++t) {
    AppendText(bytes, absl::StrCat("f ", mesh.triangles(0, t) + 1, " ", mesh.triangles(1, t) + 1,
                                   " ", mesh.triangles(2, t) + 1, "\n"));
  }
  return bytes;
}

Bytes StlBinary(const mesh::TriangleMesh& mesh) {
  Bytes bytes = ToBytes("solid, says the header, but it is binary");
  bytes.resize(80);
  Append(bytes, static_cast<uint32_t>(mesh.num_triangles()));
  for (Eigen::Index t = 0; t < mesh.triangles.cols(); ++t) {
    AppendColumns(bytes, Eigen::Vector3f::Zero().eval());  // normals are not read
    for (int k = 0; k < 3; ++k) {
      AppendColumns(bytes, mesh.vertices.col(mesh.triangles(k, t)).eval());
    }
    Append(bytes, uint16_t{0});
  }
  return bytes;
}

Bytes StlAscii(const mesh::TriangleMesh& mesh) {
  Bytes bytes = ToBytes("solid some liquid\n");
  for (Eigen::Index t = 0; t < mesh.triangles.cols(); ++t) {
    AppendText(bytes, "facet normal 0 0 1\n outer loop\n");
    for (int k = 0; k < 3; ++k) {
      const Eigen::Vector3f p = mesh.vertices.col(mesh.triangles(k, t));
      AppendText(bytes, absl::StrFormat("  vertex %.9g %.9g %.9g\n", p.x(), p.y(), p.z()));
    }
    AppendText(bytes, " endloop\nendfacet\n");
  }
  AppendText(bytes, "endsolid\n");
  return bytes;
}

std::vector<LoadedFile> Files(const mesh::Animation& animation, Format format, int first_number) {
  std::vector<LoadedFile> files;
  int number = first_number;
  for (const mesh::TriangleMesh& frame : animation.frames) {
    const std::string digits = absl::StrFormat("%04d", number++);
    if (format == Format::kObj) files.push_back({"mesh_" + digits + ".obj", Obj(frame)});
    if (format == Format::kStl) files.push_back({"mesh_" + digits + ".stl", StlBinary(frame)});
    if (format == Format::kPly) {
      files.push_back({"mesh_" + digits + ".ply", Ply(frame, PlyKind::kLittleEndian)});
    }
    if (format != Format::kMantaflow) continue;
    files.push_back({"fluid_mesh_" + digits + ".bobj.gz", Gzip(RawBobj(frame))});
    if (frame.velocities.cols() == 0) continue;
    files.push_back({"lVelMesh_" + digits + ".uni", Gzip(RawUni(frame.velocities))});
  }
  return files;
}

}  // namespace liquidblend::ingest
