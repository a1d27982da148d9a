// glTF 2.0, binary (GLB): a mesh for each frame in one file, uncompressed or as Draco.
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <utility>

#include "absl/strings/str_cat.h"
#include "client/cli/export/formats.h"
#include "client/cli/export/gltf_document.h"
#include "client/cli/export/spool.h"
#include "client/src/decode/draco_mesh.h"
#include "client/src/status_macros.h"

namespace liquidblend::cli {
namespace {

constexpr char kGlbName[] = "animation.glb";

// Four bytes each, little endian: "glTF", "JSON", "BIN\0".
constexpr uint32_t kMagic = 0x46546C67;
constexpr uint32_t kJsonChunk = 0x4E4F534A;
constexpr uint32_t kBinaryChunk = 0x004E4942;
constexpr int64_t kMaxFileBytes = std::numeric_limits<uint32_t>::max();

// 65535 itself ends a strip where programs know such a thing.
constexpr size_t kMaxShortVertices = 65535;

std::string Words(const std::vector<uint32_t>& values) {
  return {reinterpret_cast<const char*>(values.data()), values.size() * sizeof(uint32_t)};
}

template <typename T>
absl::string_view BytesOf(const std::vector<T>& values) {
  return {reinterpret_cast<const char*>(values.data()), values.size() * sizeof(T)};
}

// Normals that have lost their length to rounding get it back, as glTF wants.
void Normalise(std::vector<float>& normals) {
  for (size_t n = 0; n + 2 < normals.size(); n += 3) {
    const double x = normals[n], y = normals[n + 1], z = normals[n + 2];
    const double length = std::sqrt(x * x + y * y + z * z);
    for (size_t k = 0; k < 3; ++k) {
      const double fallback = k == 2 ? 1.0 : 0.0;
      normals[n + k] = static_cast<float>(length > 0.0 ? normals[n + k] / length : fallback);
    }
  }
}

void SetBounds(const Mesh& mesh, GltfMesh* out) {
  for (size_t k = 0; k < 3; ++k) out->min[k] = out->max[k] = mesh.positions[k];
  for (size_t i = 0; i < mesh.positions.size(); ++i) {
    out->min[i % 3] = std::min(out->min[i % 3], mesh.positions[i]);
    out->max[i % 3] = std::max(out->max[i % 3], mesh.positions[i]);
  }
}

class GltfWriter : public FrameWriter {
 public:
  GltfWriter(const WriterSettings& settings, const Family& family, const ExportFolder& folder,
             Spool binary)
      : settings_(settings), family_(family), folder_(folder), binary_(std::move(binary)) {}

  absl::Status Add(const Frame& frame) override {
    times_s_.push_back(frame.time_s);
    LBC_ASSIGN_OR_RETURN(DracoMesh decoded, DecodeDracoMesh(frame.data));
    const bool is_draco = settings_.compression == Compression::kDraco;
    if (!is_draco) WeldOpenEdges(decoded.mesh);
    if (decoded.mesh.triangles.empty()) {
      document_.AddFrame(std::nullopt);
      return absl::OkStatus();
    }
    GltfMesh mesh = Describe(decoded);
    LBC_RETURN_IF_ERROR(is_draco ? Store(frame.data, &mesh.draco) : StoreArrays(decoded, &mesh));
    LBC_RETURN_IF_ERROR(CheckSize(binary_.size()));
    document_.AddFrame(mesh);
    return absl::OkStatus();
  }

  absl::StatusOr<ExportedFiles> Finish() override {
    std::vector<double> times_s = times_s_;
    times_s.push_back(times_s.back() + 1.0 / settings_.frames_per_second);
    std::optional<GltfSpan> animation;
    LBC_RETURN_IF_ERROR(Store(document_.AnimationBytes(times_s), &animation));
    const std::string json =
        document_.ToJson({family_.name, family_.up, *animation, binary_.size()}, times_s);
    LBC_RETURN_IF_ERROR(WriteFile(json));
    return ExportedFiles{"", "", 0, {kGlbName}};
  }

 private:
  static GltfMesh Describe(const DracoMesh& decoded) {
    GltfMesh mesh;
    mesh.num_vertices = decoded.mesh.num_vertices();
    mesh.num_indices = decoded.mesh.triangles.size();
    mesh.has_short_indices = mesh.num_vertices <= kMaxShortVertices;
    SetBounds(decoded.mesh, &mesh);
    mesh.attributes.push_back({"POSITION", std::nullopt, decoded.position_id});
    if (decoded.normal_id >= 0) {
      mesh.attributes.push_back({"NORMAL", std::nullopt, decoded.normal_id});
    }
    if (decoded.velocity_id >= 0) {
      mesh.attributes.push_back({"_VELOCITY", std::nullopt, decoded.velocity_id});
    }
    if (decoded.rest_id >= 0) {
      mesh.attributes.push_back({"_REST", std::nullopt, decoded.rest_id, "VEC4"});
    }
    return mesh;
  }

  static const std::vector<float>& ValuesOf(const Mesh& mesh,
                                            const GltfMesh::Attribute& attribute) {
    if (attribute.name == "POSITION") return mesh.positions;
    if (attribute.name == "NORMAL") return mesh.normals;
    return attribute.name == "_REST" ? mesh.rest : mesh.velocities;
  }

  absl::Status StoreArrays(DracoMesh& decoded, GltfMesh* mesh) {
    Normalise(decoded.mesh.normals);
    for (GltfMesh::Attribute& attribute : mesh->attributes) {
      LBC_RETURN_IF_ERROR(Store(BytesOf(ValuesOf(decoded.mesh, attribute)), &attribute.values));
    }
    const std::vector<uint32_t>& indices = decoded.mesh.triangles;
    if (!mesh->has_short_indices) return Store(BytesOf(indices), &mesh->indices);
    return Store(BytesOf(std::vector<uint16_t>(indices.begin(), indices.end())), &mesh->indices);
  }

  // Appends the bytes to the binary chunk, whose parts begin at multiples of four.
  absl::Status Store(absl::string_view bytes, std::optional<GltfSpan>* span) {
    *span = GltfSpan{binary_.size(), static_cast<int64_t>(bytes.size())};
    LBC_RETURN_IF_ERROR(binary_.Append(bytes));
    return binary_.Append(std::string((4 - bytes.size() % 4) % 4, '\0'));
  }

  static absl::Status CheckSize(int64_t num_bytes) {
    if (num_bytes <= kMaxFileBytes) return absl::OkStatus();
    return absl::InvalidArgumentError(
        absl::StrCat("--format gltf: the file would have ", num_bytes,
                     " bytes or more; a GLB holds ", kMaxFileBytes,
                     " at most. Use --compression draco, a coarser level (--lod), or fewer frames "
                     "(--fps)"));
  }

  absl::Status WriteFile(std::string json) {
    json.append((4 - json.size() % 4) % 4, ' ');
    const int64_t num_bytes = 12 + 8 + static_cast<int64_t>(json.size()) + 8 + binary_.size();
    LBC_RETURN_IF_ERROR(CheckSize(num_bytes));
    LBC_ASSIGN_OR_RETURN(Spool file, Spool::Create(folder_.TemporaryPath(kGlbName)));
    LBC_RETURN_IF_ERROR(file.Append(Words({kMagic, 2, static_cast<uint32_t>(num_bytes)})));
    LBC_RETURN_IF_ERROR(file.Append(Words({static_cast<uint32_t>(json.size()), kJsonChunk})));
    LBC_RETURN_IF_ERROR(file.Append(json));
    LBC_RETURN_IF_ERROR(file.Append(Words({static_cast<uint32_t>(binary_.size()), kBinaryChunk})));
    LBC_RETURN_IF_ERROR(file.AppendAll(binary_));
    return file.Close();
  }

  const WriterSettings& settings_;
  const Family& family_;
  const ExportFolder& folder_;
  Spool binary_;
  GltfDocument document_;
  std::vector<double> times_s_;
};

}  // namespace

absl::StatusOr<std::unique_ptr<FrameWriter>> MakeGltfWriter(const WriterSettings& settings,
                                                            const Family& family,
                                                            const ExportFolder& folder) {
  LBC_RETURN_IF_ERROR(folder.CheckUnused({kGlbName}));
  LBC_ASSIGN_OR_RETURN(Spool binary, Spool::Create(folder.TemporaryPath("animation.bin")));
  return std::make_unique<GltfWriter>(settings, family, folder, std::move(binary));
}

}  // namespace liquidblend::cli
