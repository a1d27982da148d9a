// BOBJ: the mesh file of Mantaflow's cache, gzip.
//
// Why not the reader of worker/ingest/formats: client and worker share no code
// (docs/architecture.md, rule 1). This one keeps the normals, in the client's Mesh.
#include <zlib.h>

#include <algorithm>

#include "absl/strings/str_cat.h"
#include "client/cli/files/mesh_file.h"
#include "client/cli/files/mesh_stats.h"
#include "client/src/status_macros.h"

namespace liquidblend::cli {
namespace {

constexpr int kGzip = 15 + 16;  // zlib's window bits, with a gzip header
constexpr size_t kBlockBytes = size_t{1} << 20;

// Unpacks a gzip stream piece by piece, so that a false count costs no more memory than there are
// bytes.
class GzipReader {
 public:
  GzipReader(const std::string& bytes, std::string name) : name_(std::move(name)) {
    stream_.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(bytes.data()));
    stream_.avail_in = static_cast<uInt>(bytes.size());
    ready_ = inflateInit2(&stream_, kGzip) == Z_OK;
  }
  ~GzipReader() {
    if (ready_) inflateEnd(&stream_);
  }
  GzipReader(const GzipReader&) = delete;
  GzipReader& operator=(const GzipReader&) = delete;

  absl::StatusOr<size_t> ReadCount(const char* what) {
    LBC_ASSIGN_OR_RETURN(const std::vector<int32_t> count, Read<int32_t>(1, what));
    if (count[0] < 0) {
      return absl::DataLossError(absl::StrCat(name_, ": ", what, " is ", count[0]));
    }
    return static_cast<size_t>(count[0]);
  }

  template <typename T>
  absl::StatusOr<std::vector<T>> Read(size_t count, const char* what) {
    std::vector<T> values;
    while (values.size() < count) {
      const size_t begin = values.size();
      values.resize(std::min(count, begin + kBlockBytes / sizeof(T)));
      stream_.next_out = reinterpret_cast<Bytef*>(&values[begin]);
      stream_.avail_out = static_cast<uInt>((values.size() - begin) * sizeof(T));
      if (ready_) inflate(&stream_, Z_SYNC_FLUSH);
      if (!ready_ || stream_.avail_out != 0) {
        return absl::DataLossError(absl::StrCat(name_, ": not gzip, damaged or cut off in ", what));
      }
    }
    return values;
  }

  // Nothing may follow, and gzip's checksum has to be right.
  absl::Status Finish() {
    Bytef extra = 0;
    stream_.next_out = &extra;
    stream_.avail_out = 1;
    if (inflate(&stream_, Z_FINISH) == Z_STREAM_END && stream_.avail_out == 1) {
      return absl::OkStatus();
    }
    return absl::DataLossError(
        absl::StrCat(name_, ": gzip is cut off or damaged at its end, or more data follows"));
  }

 private:
  z_stream stream_{};
  bool ready_ = false;
  std::string name_;
};

template <typename T>
void Append(const T* values, size_t count, std::string* bytes) {
  bytes->append(reinterpret_cast<const char*>(values), count * sizeof(T));
}

absl::StatusOr<std::string> Gzip(const std::string& raw) {
  z_stream stream{};
  if (deflateInit2(&stream, Z_DEFAULT_COMPRESSION, Z_DEFLATED, kGzip, 8, Z_DEFAULT_STRATEGY) !=
      Z_OK) {
    return absl::InternalError("zlib cannot start");
  }
  std::string packed(deflateBound(&stream, raw.size()), '\0');
  stream.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(raw.data()));
  stream.avail_in = static_cast<uInt>(raw.size());
  stream.next_out = reinterpret_cast<Bytef*>(packed.data());
  stream.avail_out = static_cast<uInt>(packed.size());
  const bool whole = deflate(&stream, Z_FINISH) == Z_STREAM_END;
  packed.resize(stream.total_out);
  deflateEnd(&stream);
  if (!whole) return absl::InternalError("zlib cannot pack");
  return packed;
}

}  // namespace

absl::StatusOr<std::string> ToBobj(const Mesh& mesh) {
  const auto num_vertices = static_cast<int32_t>(mesh.num_vertices());
  const auto num_triangles = static_cast<int32_t>(mesh.num_triangles());
  const std::vector<float> normals = mesh.normals.empty() ? VertexNormals(mesh) : mesh.normals;
  std::string raw;
  Append(&num_vertices, 1, &raw);
  Append(mesh.positions.data(), mesh.positions.size(), &raw);
  Append(&num_vertices, 1, &raw);
  Append(normals.data(), normals.size(), &raw);
  Append(&num_triangles, 1, &raw);
  Append(mesh.triangles.data(), mesh.triangles.size(), &raw);
  return Gzip(raw);
}

absl::StatusOr<Mesh> FromBobj(const std::string& bytes, const std::string& name) {
  GzipReader reader(bytes, name);
  Mesh mesh;
  LBC_ASSIGN_OR_RETURN(const size_t num_vertices, reader.ReadCount("number of vertices"));
  LBC_ASSIGN_OR_RETURN(mesh.positions, reader.Read<float>(3 * num_vertices, "positions"));
  LBC_ASSIGN_OR_RETURN(const size_t num_normals, reader.ReadCount("number of normals"));
  LBC_ASSIGN_OR_RETURN(mesh.normals, reader.Read<float>(3 * num_normals, "normals"));
  if (num_normals != num_vertices) mesh.normals.clear();
  LBC_ASSIGN_OR_RETURN(const size_t num_triangles, reader.ReadCount("number of triangles"));
  LBC_ASSIGN_OR_RETURN(mesh.triangles, reader.Read<uint32_t>(3 * num_triangles, "triangles"));
  LBC_RETURN_IF_ERROR(reader.Finish());
  return mesh;
}

}  // namespace liquidblend::cli
