#include "tests/fuzz/entries.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <memory>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "core/store/files/files.h"
#include "liquidblend/decode.h"
#include "server/encode/draco.h"
#include "server/http/exchange/requests.h"
#include "server/transcode/query.h"
#include "tests/fuzz/checksums.h"
#include "tests/fuzz/require.h"
#include "tests/server/encode/judge.h"
#include "tests/server/encode/scrambled_surface.h"
#include "tests/synthetic/shapes.h"
#include "tests/worker/ingest/formats/encode_files.h"
#include "worker/ingest/formats/gzip.h"
#include "worker/ingest/meta.h"
#include "worker/ingest/read_animation.h"

namespace liquidblend::fuzz {
namespace {

using Bytes = std::span<const std::byte>;

void RunAnimation(const std::vector<ingest::InputFile>& files) {
  static const parallel::Arena arena(1);
  const absl::StatusOr<mesh::Animation> animation =
      ingest::ReadAnimation("fuzz", files, {.voxel_size_m = 0.4}, arena);
  Require(animation.ok() || !animation.status().message().empty(), "a refusal says why");
  if (!animation.ok()) return;
  for (const mesh::TriangleMesh& frame : animation->frames) {
    Require(mesh::Validate(frame).ok(), "meshes are valid");
    const mesh::ClosednessReport report = mesh::CheckClosed(frame);
    Require(report.closed() && report.num_non_manifold_edges == 0, "surfaces are closed manifolds");
    Require(frame.num_triangles() == 0 || mesh::Volume(frame) > 0, "surfaces face outward");
  }
}

void RunPly(Bytes bytes) { RunAnimation({{"a_1.ply", bytes}}); }
void RunObj(Bytes bytes) { RunAnimation({{"a_1.obj", bytes}}); }
void RunStl(Bytes bytes) { RunAnimation({{"a_1.stl", bytes}}); }
void RunVdb(Bytes bytes) { RunAnimation({{"a_1.vdb", bytes}}); }

// uint16 size of what lies inside the .bobj.gz; that; what lies inside the .uni, or nothing.
void RunMantaflow(Bytes bytes) {
  uint16_t size = 0;
  if (bytes.size() < sizeof(size)) return;
  std::memcpy(&size, bytes.data(), sizeof(size));
  bytes = bytes.subspan(sizeof(size));
  const Bytes mesh = bytes.first(std::min<size_t>(size, bytes.size()));
  const Bytes velocities = bytes.subspan(mesh.size());
  const ingest::Bytes mesh_gzip = ingest::Gzip(mesh);
  std::vector<ingest::InputFile> files = {{"a_1.bobj.gz", mesh_gzip}};
  const ingest::Bytes velocities_gzip = ingest::Gzip(velocities);
  if (!velocities.empty()) files.push_back({"lVelMesh_1.uni", velocities_gzip});
  RunAnimation(files);
}

// uint8 size of the pieces that are asked for; the stream.
void RunGzip(Bytes bytes) {
  if (bytes.empty()) return;
  const auto piece = static_cast<size_t>(bytes[0]) + 1;
  const Bytes stream = bytes.subspan(1);
  ingest::GzipReader reader(stream);
  std::vector<std::byte> out(piece);
  const int64_t max_size = ingest::MaxInflatedSize(static_cast<int64_t>(stream.size()));
  while (reader.position() < max_size && reader.Read(out).ok()) {
  }
  Require(reader.position() <= max_size + static_cast<int64_t>(piece), "no more than is asked for");
  const absl::Status end = reader.ExpectEnd();
  Require(end.ok() || !end.message().empty(), "a refusal says why");
}

void RunMeta(Bytes bytes) {
  const absl::StatusOr<ingest::Meta> meta = ingest::ReadMeta(bytes);
  if (!meta.ok()) return;
  Require(meta->frames_per_second >= 0 && meta->vertex_scale >= 0, "scales are positive");
  Require(std::is_sorted(meta->frame_times.begin(), meta->frame_times.end()), "times rise");
}

// A copy of a file with its checksums made right, at an address as a memory map has it.
class CheckedBlob : public store::Blob {
 public:
  explicit CheckedBlob(std::vector<std::byte> content) : size_(content.size()) {
    constexpr size_t kAlignment = 64;
    const size_t rounded = (size_ / kAlignment + 1) * kAlignment;
    bytes_.reset(static_cast<std::byte*>(std::aligned_alloc(kAlignment, rounded)));
    std::copy(content.begin(), content.end(), bytes_.get());
  }
  Bytes bytes() const override { return {bytes_.get(), size_}; }

 private:
  struct Free {
    void operator()(std::byte* bytes) const { std::free(bytes); }
  };
  size_t size_;
  std::unique_ptr<std::byte[], Free> bytes_;
};

void RunAnimationFile(Bytes bytes) {
  const CheckedBlob blob(WithRightChecksums<store::v1::AnimationManifest>(bytes));
  const absl::StatusOr<mesh::Animation> animation = store::ReadAnimation(blob, "fuzz");
  if (!animation.ok()) return;
  Require(animation->times.empty() || std::ssize(animation->times) == animation->num_frames(),
          "a time per frame");
  for (const mesh::TriangleMesh& frame : animation->frames) {
    Require(mesh::Validate(frame).ok(), "meshes are valid");
  }
}

void RunFamilyFile(Bytes bytes) {
  auto blob = std::make_shared<CheckedBlob>(WithRightChecksums<store::v1::FamilyManifest>(bytes));
  const absl::StatusOr<mesh::RegisteredFamily> family = store::OpenFamily(std::move(blob), "fuzz");
  if (!family.ok()) return;
  Require(mesh::Validate(*family).ok(), "families are valid");
}

// What the bytes make of a torus: uint8 its rings, uint8 its sides, uint8 preset, then of each
// change uint8 kind, uint16 and uint16 which triangles, edges or vertices. No triangle is dropped,
// so the surface stays closed, however odd.
mesh::TriangleMesh ReadSurface(Bytes bytes) {
  const auto byte = [&](size_t i) { return std::to_integer<int>(bytes[i]); };
  mesh::TriangleMesh torus =
      synthetic::Torus(Eigen::Vector3f::Zero(), 2.0, 1.0, 3 + byte(0) % 14, 3 + byte(1) % 14);
  for (Eigen::Index v = 0; v < torus.num_vertices(); ++v) {
    torus.vertices.col(v) = Eigen::Vector3i(static_cast<int>(v), 17, 4).cast<float>();
  }
  encode::ScrambledSurface surface(std::move(torus));
  for (size_t i = 3; i + 5 <= bytes.size(); i += 5) {
    const uint64_t a = 256 * byte(i + 1) + byte(i + 2), b = 256 * byte(i + 3) + byte(i + 4);
    if (byte(i) % 8 == 0) {
      surface.MergeVertices(a, b);
    } else {
      surface.TurnEdge(a, b);
    }
  }
  return encode::WithoutDegenerate(surface.mesh());
}

void RunSurface(Bytes bytes) {
  if (bytes.size() < 3) return;
  const mesh::TriangleMesh surface = ReadSurface(bytes);
  encode::DracoOptions options;
  options.preset = std::to_integer<int>(bytes[2]) % 2 == 0 ? encode::Preset::kFastest
                                                           : encode::Preset::kBalanced;
  options.position_bits = 9;
  options.grid.extent_m = 511.0F;  // nodes at whole numbers
  static encode::SurfaceWriter writer;
  const absl::StatusOr<std::string> data = encode::EncodeDraco(surface, options, writer);
  Require(data.ok(), "closed surfaces are encoded");
  const absl::StatusOr<mesh::TriangleMesh> decoded = encode::TryDecode(*data);
  Require(decoded.ok(), "libdraco reads what is written");
  Require(encode::NodesOf(*decoded, options) == encode::NodesOf(surface, options),
          "all triangles are there");
}

bool AreFinite(const std::vector<float>& values) {
  return std::all_of(values.begin(), values.end(), [](float v) { return std::isfinite(v); });
}

// Data of a frame, as a client gets it.
void RunFrame(const std::string& data) {
  const absl::StatusOr<Mesh> mesh = DecodeMesh(data);
  Require(mesh.ok() || !mesh.status().message().empty(), "a refusal says why");
  if (!mesh.ok()) return;
  const auto is_below = [&](uint32_t v) { return v < mesh->num_vertices(); };
  Require(std::all_of(mesh->triangles.begin(), mesh->triangles.end(), is_below),
          "triangles have vertices of the mesh");
  for (const std::vector<float>* attribute : {&mesh->normals, &mesh->velocities}) {
    Require(attribute->empty() || attribute->size() == mesh->positions.size(),
            "attributes have a value per vertex");
    Require(AreFinite(*attribute), "numbers are finite");
  }
  Require(mesh->rest.empty() || mesh->rest.size() == 4 * mesh->num_vertices(),
          "attributes have a value per vertex");
  Require(AreFinite(mesh->positions) && AreFinite(mesh->rest), "numbers are finite");
}

std::string ToString(Bytes bytes) {
  return std::string(reinterpret_cast<const char*>(bytes.data()), bytes.size());
}

// A frame in the format MESHOPT.
void RunMeshopt(Bytes bytes) {
  const std::string data = ToString(bytes);
  if (!data.starts_with("DRACO")) RunFrame(data);
}

// A frame in the format DRACO, without the word it begins with.
void RunDraco(Bytes bytes) { RunFrame("DRACO" + ToString(bytes)); }

bool AreFinite(const google::protobuf::RepeatedField<double>& values) {
  return std::all_of(values.begin(), values.end(), [](double v) { return std::isfinite(v); });
}

// The query of a URL.
void RunQuery(Bytes bytes) {
  const std::string_view query(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  const absl::StatusOr<std::vector<transcode::QueryField>> fields = transcode::ParseQuery(query);
  Require(fields.ok() || !fields.status().message().empty(), "a refusal says why");
  if (!fields.ok()) return;
  const absl::StatusOr<v1::GetFrameRequest> request = http::ToGetFrame("fuzz", *fields);
  Require(request.ok() || !request.status().message().empty(), "a refusal says why");
  if (!request.ok()) return;
  Require(AreFinite(request->weights()) && std::isfinite(request->time_s()), "numbers are finite");
  for (const v1::Parameter& parameter : request->parameters()) {
    Require(std::isfinite(parameter.value()), "numbers are finite");
  }
  Require(request->version() >= 0, "versions are positive");
}

constexpr Entry kEntries[] = {{"mantaflow", RunMantaflow},
                              {"ply", RunPly},
                              {"obj", RunObj},
                              {"stl", RunStl},
                              {"vdb", RunVdb},
                              {"gzip", RunGzip},
                              {"meta", RunMeta},
                              {"animation_file", RunAnimationFile},
                              {"family_file", RunFamilyFile},
                              {"surface", RunSurface},
                              {"meshopt", RunMeshopt},
                              {"draco", RunDraco},
                              {"query", RunQuery},
                              {"s3_answer", RunS3Answer},
                              {"credentials", RunCredentials}};

}  // namespace

std::span<const Entry> ReaderEntries() { return kEntries; }

}  // namespace liquidblend::fuzz
