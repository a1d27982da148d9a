// Writes the seeds of the fuzzers: make_corpus tests/fuzz/corpus
#include <array>
#include <cstdio>
#include <cstring>
#include <random>
#include <string>

#include "core/finish/normals.h"
#include "core/store/files/files.h"
#include "server/encode/draco.h"
#include "server/encode/meshopt.h"
#include "tests/fuzz/corpus.h"
#include "tests/synthetic/shapes.h"
#include "tests/synthetic/voxels.h"
#include "tests/worker/ingest/formats/encode_files.h"
#include "tests/worker/ingest/formats/encode_vdb.h"

namespace liquidblend::fuzz {
namespace {

using ingest::Bytes;

class MemoryWriter : public store::BlobWriter {
 public:
  absl::Status Append(std::span<const std::byte> bytes) override {
    content.insert(content.end(), bytes.begin(), bytes.end());
    return absl::OkStatus();
  }
  absl::StatusOr<store::BlobId> Commit() override { return absl::UnimplementedError("in memory"); }

  Bytes content;
};

Bytes Join(const Bytes& first, const Bytes& second) {
  Bytes joined = first;
  joined.insert(joined.end(), second.begin(), second.end());
  return joined;
}

mesh::TriangleMesh BoxWithVelocities() {
  mesh::TriangleMesh box = synthetic::Box({0, 0, 0}, {1, 1, 1});
  box.velocities = 2 * box.vertices;
  return box;
}

// Cubes that touch one another in edges and vertices.
mesh::TriangleMesh TouchingCubes() {
  return synthetic::VoxelSurface(synthetic::RandomVoxels(3, 0.5, 4));
}

void AddMeshes(const Corpus& corpus) {
  const mesh::TriangleMesh box = BoxWithVelocities();
  const Bytes raw = ingest::RawBobj(box);
  const auto size = static_cast<uint16_t>(raw.size());
  const Bytes head = {static_cast<std::byte>(size & 0xff), static_cast<std::byte>(size >> 8)};
  corpus.Add("mantaflow", "box", Join(head, raw));
  corpus.Add("mantaflow", "box_with_velocities",
             Join(Join(head, raw), ingest::RawUni(box.velocities)));
  corpus.Add("ply", "ascii", ingest::Ply(box, ingest::PlyKind::kAscii));
  corpus.Add("ply", "little_endian", ingest::Ply(box, ingest::PlyKind::kLittleEndian));
  corpus.Add("ply", "big_endian", ingest::Ply(box, ingest::PlyKind::kBigEndian));
  corpus.Add("obj", "box", ingest::Obj(box));
  corpus.Add("obj", "quads",
             ingest::ToBytes("v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 0 0 1\nv 1 0 1\nv 1 1 1\n"
                             "v 0 1 1\nf 4 3 2 1\nf 5/1 6//2 7/3/4 8\nf -8 -7 -3 -4\n"
                             "f 2 3 7 \\\n6\nf 3 4 8 7\nf 4 1 5 8\ns off\n"));
  corpus.Add("ply", "touching", ingest::Ply(TouchingCubes(), ingest::PlyKind::kLittleEndian));
  corpus.Add("obj", "touching", ingest::Obj(TouchingCubes()));
  corpus.Add("stl", "touching", ingest::StlBinary(TouchingCubes()));
  corpus.Add("stl", "binary", ingest::StlBinary(box));
  corpus.Add("stl", "ascii", ingest::StlAscii(synthetic::Box({-1, 2, 0}, {3, 4, 5})));
  const Bytes one = {std::byte{6}};
  corpus.Add("gzip", "text", Join(one, ingest::Gzip(ingest::ToBytes("liquid liquid liquid"))));
  corpus.Add("gzip", "mesh", Join(one, ingest::Gzip(raw)));
}

void AddVdb(const Corpus& corpus) {
  const openvdb::Vec3d center(0.4, 0.4, 0.4);
  const auto ball = ingest::BallLevelSet(center, 0.1);
  const auto half = ingest::BallLevelSet(center, 0.1, {.name = "phi", .is_half = true});
  auto velocities = openvdb::Vec3SGrid::create(openvdb::Vec3s(1, 2, 3));
  velocities->setName("v");
  velocities->tree().setValue(openvdb::Coord(8, 8, 8), openvdb::Vec3s(0, 0, 1));
  using namespace openvdb::io;
  corpus.Add("vdb", "zip", ingest::Vdb({ball}, COMPRESS_ZIP | COMPRESS_ACTIVE_MASK));
  corpus.Add("vdb", "blosc_half", ingest::Vdb({half}, COMPRESS_BLOSC | COMPRESS_ACTIVE_MASK));
  corpus.Add("vdb", "velocities",
             ingest::Vdb({velocities, ball}, COMPRESS_BLOSC | COMPRESS_ACTIVE_MASK));
}

void AddMeta(const Corpus& corpus) {
  corpus.Add("meta", "all",
             ingest::ToBytes(R"({"fps": 24, "domain_size_m": [1, 2, 3], "voxel_size_m": 0.5,
 "units": {"vertex_scale": 2.0, "velocity_scale_to_m_per_s": 1e-1},
 "frame_times": [0, 0.5, 3], "other": [null, true, "\u00e9"]})"));
  corpus.Add("meta", "empty", ingest::ToBytes("{}"));
}

void AddSurfaces(const Corpus& corpus) {
  corpus.Add("surface", "torus", ingest::ToBytes("abc"));
  std::mt19937 random(1);
  for (const std::string name : {"fastest", "balanced"}) {
    std::string bytes = {20, 20, name == "fastest" ? '\0' : '\1'};
    for (int i = 0; i < 5 * 200; ++i) bytes.push_back(static_cast<char>(random() % 256));
    corpus.Add("surface", name, ingest::ToBytes(bytes));
  }
}

// A torus without and with all attributes, in both formats of frames.
void AddFrames(const Corpus& corpus) {
  mesh::TriangleMesh torus = synthetic::Torus(Eigen::Vector3f::Zero(), 2.0, 1.0, 12, 8);
  frames::RoundingOptions rounding;
  rounding.position_bits = 12;
  rounding.grid.extent_m = 8.0F;
  rounding.duration_s = 2.0;
  const auto add_meshopt = [&](const std::string& name) {
    const absl::StatusOr<std::string> data = encode::EncodeMeshopt(torus, rounding);
    if (!data.ok()) std::abort();
    corpus.Add("meshopt", name, ingest::ToBytes(*data));
  };
  const auto add_draco = [&](const std::string& name, encode::Preset preset) {
    encode::DracoOptions options;
    options.position_bits = rounding.position_bits;
    options.grid = rounding.grid;
    options.preset = preset;
    const absl::StatusOr<std::string> data = encode::EncodeDraco(torus, options);
    if (!data.ok()) std::abort();
    corpus.Add("draco", name, ingest::ToBytes(data->substr(std::strlen("DRACO"))));
  };
  add_meshopt("torus");
  add_draco("fastest", encode::Preset::kFastest);
  add_draco("balanced", encode::Preset::kBalanced);
  add_draco("smallest", encode::Preset::kSmallest);
  finish::AddNormals(torus);
  torus.velocities = torus.vertices;
  torus.rest.resize(4, torus.num_vertices());
  torus.rest.topRows<3>() = torus.vertices;
  torus.rest.row(3).setConstant(0.5F);
  add_meshopt("all_attributes");
  add_draco("all_attributes", encode::Preset::kFastest);
  add_draco("all_attributes_smallest", encode::Preset::kSmallest);
}

void AddAnimationFiles(const Corpus& corpus) {
  mesh::Animation animation;
  animation.name = "seed";
  animation.frames = {BoxWithVelocities(), mesh::TriangleMesh()};
  animation.notes = {"a note"};
  MemoryWriter without_times;
  MemoryWriter with_times;
  bool ok = store::WriteAnimation(animation, without_times).ok();
  animation.times = {0, 2.5};
  ok = store::WriteAnimation(animation, with_times).ok() && ok;
  if (!ok) std::abort();
  corpus.Add("animation_file", "two_frames", without_times.content);
  corpus.Add("animation_file", "times", with_times.content);
}

void AddFamilyFiles(const Corpus& corpus) {
  const std::vector<mesh::Float4> vertices = {
      {0, 0, 0, -1}, {1, 0, 0, 0}, {0, 1, 0, 1}, {0, 0, 1, 2}, {1, 1, 1, 2}};
  const std::vector<mesh::Float4> displacement(vertices.size(), {0.5f, 0, 0, 0.25f});
  const std::vector<mesh::Tetrahedron> tetrahedra = {{0, 1, 2, 3}};
  const std::vector<mesh::Pyramid> pyramids = {{0, 1, 2, 3, 4}};
  mesh::RegisteredFamily family;
  family.name = "seed";
  family.source = "a";
  family.num_frames = 2;
  family.vertices = vertices;
  family.tetrahedra = tetrahedra;
  MemoryWriter small;
  MemoryWriter large;
  MemoryWriter squares;
  bool ok = store::WriteFamily(family, small).ok();
  family.pyramids = pyramids;
  family.targets = {{"b", displacement, displacement, {}}, {"c", displacement, {}, {}}};
  family.domain_max = {2, 2, 2};
  family.edge_length_m = 1.0;
  ok = store::WriteFamily(family, large).ok() && ok;
  family.rest_time_s = -0.25;
  ok = store::WriteFamily(family, squares).ok() && ok;
  if (!ok) std::abort();
  corpus.Add("family_file", "source_alone", small.content);
  corpus.Add("family_file", "two_targets", large.content);
  corpus.Add("family_file", "squares", squares.content);
}

}  // namespace
}  // namespace liquidblend::fuzz

int main(int argc, char** argv) {
  if (argc != 2) {
    std::fprintf(stderr, "usage: make_corpus FOLDER\n");
    return 1;
  }
  const liquidblend::fuzz::Corpus corpus(argv[1]);
  liquidblend::fuzz::AddMeshes(corpus);
  liquidblend::fuzz::AddVdb(corpus);
  liquidblend::fuzz::AddMeta(corpus);
  liquidblend::fuzz::AddAnimationFiles(corpus);
  liquidblend::fuzz::AddFamilyFiles(corpus);
  liquidblend::fuzz::AddSurfaces(corpus);
  liquidblend::fuzz::AddFrames(corpus);
  liquidblend::fuzz::AddPeerSeeds(corpus);
  liquidblend::fuzz::AddCloudSeeds(corpus);
  return 0;
}
