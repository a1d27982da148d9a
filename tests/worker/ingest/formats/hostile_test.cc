// Truncated, damaged and lying files: a status comes back, soon and without much memory.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <malloc.h>
#include <zlib.h>

#include <algorithm>
#include <cstring>
#include <fstream>
#include <functional>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "core/mesh/animation.h"
#include "core/parallel/arena.h"
#include "tests/synthetic/shapes.h"
#include "tests/synthetic/voxels.h"
#include "tests/worker/ingest/formats/encode_files.h"
#include "tests/worker/ingest/formats/encode_vdb.h"
#include "worker/ingest/formats/readers.h"
#include "worker/ingest/read_animation.h"

namespace liquidblend::ingest::hostile_test {
namespace {

using testing::HasSubstr;

// Files that are made when a test begins: OpenVDB starts threads, which the list of tests must not.
struct Sample {
  std::string name;
  std::vector<LoadedFile> (*make)();
};

// A ball of a few voxels, and velocities.
Bytes SmallVdb() {
  const openvdb::Vec3d center(0.4, 0.4, 0.4);
  const auto ball = BallLevelSet(center, 0.1);
  auto velocities = openvdb::Vec3SGrid::create(openvdb::Vec3s(1, 2, 3));
  velocities->setName("v");
  return Vdb({ball, velocities}, openvdb::io::COMPRESS_ZIP | openvdb::io::COMPRESS_ACTIVE_MASK);
}

mesh::TriangleMesh Box() { return synthetic::Box({0, 0, 0}, {1, 1, 1}); }

std::vector<LoadedFile> BoxFiles(Format format) {
  mesh::Animation animation;
  animation.frames.push_back(Box());
  animation.frames[0].velocities = animation.frames[0].vertices;
  return Files(animation, format);
}

std::vector<LoadedFile> OneFile(const std::string& name, const Bytes& bytes) {
  return {{name, bytes}};
}

std::vector<Sample> Samples() {
  return {
      {"Mantaflow", [] { return BoxFiles(Format::kMantaflow); }},
      {"Obj", [] { return BoxFiles(Format::kObj); }},
      {"StlBinary", [] { return BoxFiles(Format::kStl); }},
      {"StlAscii", [] { return OneFile("a_1.stl", StlAscii(Box())); }},
      {"Vdb", [] { return OneFile("a_1.vdb", SmallVdb()); }},
      {"PlyAscii", [] { return OneFile("a_1.ply", Ply(Box(), PlyKind::kAscii)); }},
      {"PlyLittleEndian", [] { return OneFile("a_1.ply", Ply(Box(), PlyKind::kLittleEndian)); }},
      {"PlyBigEndian", [] { return OneFile("a_1.ply", Ply(Box(), PlyKind::kBigEndian)); }},
      {"Meta", []() -> std::vector<LoadedFile> {
         return {{"a_1.obj", Obj(Box())},
                 {"meta.json", ToBytes(R"({"fps": 24, "units": {"vertex_scale": 2.0}})")}};
       }}};
}

absl::StatusOr<mesh::Animation> Read(const std::vector<LoadedFile>& files) {
  static const parallel::Arena arena(1);
  return ReadAnimation("hostile", Views(files), {.voxel_size_m = 0.4}, arena);
}

// Whatever is accepted has to be what the stages behind rely on.
void ExpectStatusOrGoodMesh(const absl::StatusOr<mesh::Animation>& animation) {
  if (!animation.ok()) {
    EXPECT_FALSE(animation.status().message().empty());
    return;
  }
  for (const mesh::TriangleMesh& frame : animation->frames) {
    EXPECT_TRUE(mesh::Validate(frame).ok());
    EXPECT_TRUE(mesh::CheckClosed(frame).closed());
    EXPECT_EQ(mesh::CheckClosed(frame).num_non_manifold_edges, 0);
    EXPECT_GT(mesh::Volume(frame), 0);
  }
}

class Hostile : public testing::TestWithParam<Sample> {
 protected:
  const std::vector<LoadedFile> files_ = GetParam().make();
};

TEST_P(Hostile, EveryPrefixIsRefusedOrStillAGoodMesh) {
  ASSERT_TRUE(Read(files_).ok()) << Read(files_).status();
  for (size_t f = 0; f < files_.size(); ++f) {
    std::vector<LoadedFile> files = files_;
    const size_t size = files[f].bytes.size();
    for (size_t prefix = 0; prefix < size; ++prefix) {
      files[f].bytes = files_[f].bytes;
      files[f].bytes.resize(prefix);
      const absl::StatusOr<mesh::Animation> animation = Read(files);
      ExpectStatusOrGoodMesh(animation);
      // Only the last line end or blank of a text can be missed.
      EXPECT_TRUE(!animation.ok() || prefix + 1 == size) << files[f].name << " " << prefix;
    }
  }
}

TEST_P(Hostile, FlippedBitsAreRefusedOrStillAGoodMesh) {
  std::mt19937 random(7);
  const int num_rounds = 3000;
  for (int round = 0; round < num_rounds; ++round) {
    std::vector<LoadedFile> files = files_;
    Bytes& bytes = files[random() % files.size()].bytes;
    const int num_flips = 1 + static_cast<int>(random() % 4);
    for (int i = 0; i < num_flips; ++i) {
      bytes[random() % bytes.size()] ^= static_cast<std::byte>(1u << random() % 8);
    }
    ExpectStatusOrGoodMesh(Read(files));
  }
}

// Damage below the checksum, where it reaches the numbers.
TEST(HostileMantaflow, FlippedBitsInsideOfTheStreamAreRefusedOrStillAGoodMesh) {
  const mesh::TriangleMesh box = synthetic::Box({0, 0, 0}, {1, 1, 1});
  const Bytes mesh_bytes = RawBobj(box);
  const Bytes velocity_bytes = RawUni(box.vertices);
  std::mt19937 random(8);
  for (int round = 0; round < 1000; ++round) {
    Bytes mesh = mesh_bytes;
    Bytes velocities = velocity_bytes;
    Bytes& bytes = round % 2 == 0 ? mesh : velocities;
    bytes[random() % bytes.size()] ^= static_cast<std::byte>(1u << random() % 8);
    ExpectStatusOrGoodMesh(
        Read({{"a_1.bobj.gz", Gzip(mesh)}, {"lVelMesh_1.uni", Gzip(velocities)}}));
  }
}

INSTANTIATE_TEST_SUITE_P(All, Hostile, testing::ValuesIn(Samples()),
                         [](const auto& param) { return param.param.name; });

// The peak of this process' memory, or -1 where the system does not say.
int64_t PeakMemoryBytes() {
  std::ifstream status("/proc/self/status");
  for (std::string line; std::getline(status, line);) {
    if (line.rfind("VmHWM:", 0) == 0) return std::stoll(line.substr(6)) * 1024;
  }
  return -1;
}

// What reading adds to the peak of this process' memory. Memory that was freed goes back to the
// system first, or else it would serve without being counted.
int64_t PeakAddedBy(const std::vector<LoadedFile>& files, absl::StatusOr<mesh::Animation>& result) {
  malloc_trim(0);
  std::ofstream("/proc/self/clear_refs") << 5;  // the peak starts anew
  const int64_t before = PeakMemoryBytes();
  result = Read(files);
  return PeakMemoryBytes() - before;
}

// Gzip of `head` and then `num_zeros` zeros, made piece by piece.
Bytes GzipZeros(const Bytes& head, size_t num_zeros) {
  Bytes piece = head;
  Bytes compressed(num_zeros / 900 + 4096);
  z_stream stream = {};
  deflateInit2(&stream, Z_BEST_COMPRESSION, Z_DEFLATED, MAX_WBITS + 16, 8, Z_DEFAULT_STRATEGY);
  stream.next_out = reinterpret_cast<Bytef*>(compressed.data());
  stream.avail_out = static_cast<uInt>(compressed.size());
  for (size_t num_left = num_zeros;; num_left -= piece.size()) {
    stream.next_in = reinterpret_cast<Bytef*>(piece.data());
    stream.avail_in = static_cast<uInt>(piece.size());
    const bool is_last = num_left == 0;
    EXPECT_EQ(deflate(&stream, is_last ? Z_FINISH : Z_NO_FLUSH), is_last ? Z_STREAM_END : Z_OK);
    if (is_last) break;
    piece.assign(std::min<size_t>(num_left, 4096), std::byte{0});
  }
  compressed.resize(stream.total_out);
  deflateEnd(&stream);
  return compressed;
}

Bytes Int32(int32_t value) {
  Bytes bytes(sizeof(value));
  std::memcpy(bytes.data(), &value, sizeof(value));
  return bytes;
}

// Far above what refusing takes, far below what the bombs would unpack to.
#ifdef __SANITIZE_THREAD__
constexpr int64_t kSmallMemoryBytes = int64_t{48} << 20;  // ThreadSanitizer's shadow included
#else
constexpr int64_t kSmallMemoryBytes = int64_t{16} << 20;  // AddressSanitizer included
#endif
constexpr size_t kBombSize = size_t{96} << 20;

std::vector<LoadedFile> WithMesh(Bytes bytes) { return {{"a_1.bobj.gz", std::move(bytes)}}; }

struct BombCase {
  std::string name;
  std::vector<LoadedFile> files;
  std::string message;
};

// A level set of leaves `spacing` voxels apart, all of the same values.
Bytes VdbOfLeaves(int num_leaves, int spacing,
                  const std::function<float(const openvdb::Coord&)>& value) {
  auto grid = openvdb::FloatGrid::create(1.0f);
  grid->setName("surface");
  for (int leaf = 0; leaf < num_leaves; ++leaf) {
    const openvdb::Coord origin(leaf % 16 * spacing, leaf / 16 % 16 * spacing,
                                leaf / 256 * spacing);
    auto* const node = grid->tree().touchLeaf(origin);
    for (openvdb::Index i = 0; i < 512; ++i) {
      node->setValueOn(i, value(openvdb::FloatTree::LeafNodeType::offsetToLocalCoord(i)));
    }
  }
  return Vdb({grid}, openvdb::io::COMPRESS_ZIP | openvdb::io::COMPRESS_ACTIVE_MASK);
}

float Checkerboard(const openvdb::Coord& c) {
  return (c.x() + c.y() + c.z()) % 2 == 0 ? 1.0f : -1.0f;
}

// Every second tile of 128 voxels a side is inside: millions of quads in a few bytes.
Bytes VdbOfTiles() {
  auto grid = openvdb::FloatGrid::create(1.0f);
  grid->setName("surface");
  for (int i = 0; i < 4096; ++i) {
    const openvdb::Coord c(i % 16, i / 16 % 16, i / 256);
    grid->tree().addTile(2, openvdb::Coord(c.x() * 128, c.y() * 128, c.z() * 128), Checkerboard(c),
                         false);
  }
  return Vdb({grid}, openvdb::io::COMPRESS_ZIP | openvdb::io::COMPRESS_ACTIVE_MASK);
}

// The bytes with one number overwritten.
template <typename Number>
Bytes With(Bytes bytes, size_t at, Number number) {
  std::memcpy(bytes.data() + at, &number, sizeof(number));
  return bytes;
}

constexpr size_t kVdbMetadataAt = 8 + 4 + 8 + 1 + 36;

std::vector<BombCase> Bombs() {
  const mesh::TriangleMesh box = synthetic::Box({0, 0, 0}, {1, 1, 1});
  const Bytes header = ToBytes(
      "ply\nformat binary_big_endian 1.0\nelement vertex 1\nproperty float x\nproperty float y\n"
      "property float z\nelement face 1\nproperty list uint int vertex_indices\nend_header\n");
  Bytes ply = header;
  ply.resize(header.size() + 12, std::byte{0});
  ply.resize(ply.size() + 4, std::byte{0x70});  // a face with 1.9 billion corners
  Bytes json = ToBytes("{\"a\":");
  json.resize(60000, static_cast<std::byte>('['));
  Bytes long_json = json;
  long_json.resize(1 << 20, static_cast<std::byte>('['));
  return {
      {"PromisedVertices", WithMesh(GzipZeros(Int32(kBombSize / 24), kBombSize)),
       "promises 4194304 vertices, more than so small a file can hold"},
      {"VerticesJustAllowed", WithMesh(GzipZeros(Int32(40000), 960008)),
       "0 normals for 40000 vertices"},
      {"UnpromisedTail", WithMesh(GzipZeros(RawBobj(box), kBombSize)), "more data follows"},
      {"VelocityTail",
       {{"a_1.bobj.gz", Gzip(RawBobj(box))},
        {"lVelMesh_1.uni", GzipZeros(RawUni(box.vertices), kBombSize)}},
       "more data follows"},
      {"PlyFace", {{"a_1.ply", ply}}, "truncated at face 0"},
      {"VdbMetadata",
       {{"a_1.vdb", With(SmallVdb(), kVdbMetadataAt, uint32_t{0xfffffff0})}},
       "the file is truncated"},
      {"VdbName",
       {{"a_1.vdb", With(SmallVdb(), kVdbMetadataAt + 8, uint32_t{0xfffffff0})}},
       "the file is truncated: 4294967280 bytes should follow"},
      {"VdbGrids",
       {{"a_1.vdb", With(SmallVdb(), kVdbMetadataAt + 4, uint32_t{0xfffffff0})}},
       "the number of grids is -16"},
      {"VdbTiles", {{"a_1.vdb", VdbOfTiles()}}, "the surface leaves the level set's narrow band"},
      {"VdbChecker", {{"a_1.vdb", VdbOfLeaves(64, 16, Checkerboard)}}, "more than the "},
      {"StlCount",
       {{"a_1.stl", With(StlBinary(box), 80, uint32_t{0x40000000})}},
       "promises 1073741824 triangles, but 12 are there"},
      {"DeepJson", {{"a_1.obj", Obj(box)}, {"meta.json", json}}, "not a JSON object"},
      {"LongJson", {{"a_1.obj", Obj(box)}, {"meta.json", long_json}}, "more than 65536"},
  };
}

TEST(Bombs, AreRefusedWithSmallMemory) {
  for (const BombCase& bomb : Bombs()) {
    absl::StatusOr<mesh::Animation> animation;
    const int64_t added = PeakAddedBy(bomb.files, animation);
    EXPECT_THAT(std::string(animation.status().message()), HasSubstr(bomb.message)) << bomb.name;
    EXPECT_LT(added, kSmallMemoryBytes) << bomb.name;
  }
}

// What is stated in read_animation.h, where files come closest to it: much surface in few bytes,
// and many nodes of a tree with hardly anything in them.
TEST(Memory, OfAcceptedLevelSetsStaysWithinTheStatedBound) {
  const auto one_voxel = [](const openvdb::Coord& c) {
    return c == openvdb::Coord(4, 4, 4) ? -1.0f : 1.0f;
  };
  for (const Bytes& bytes :
       {VdbOfLeaves(12, 16, Checkerboard), VdbOfLeaves(100, 4096, one_voxel)}) {
    const auto size = static_cast<int64_t>(bytes.size());
    absl::StatusOr<mesh::Animation> animation;
    const int64_t added = PeakAddedBy({{"a_1.vdb", bytes}}, animation);
    ASSERT_TRUE(animation.ok()) << animation.status();
    EXPECT_GE(animation->frames[0].num_triangles(), 1200);
    EXPECT_LT(added, kSmallMemoryBytes + 512 * size) << size;
  }
}

struct LargeFile {
  std::string name;  // of the file
  Bytes bytes;
  int64_t per_byte;     // stated in read_animation.h
  std::string message;  // of the refusal; empty: accepted
};

// Polygons between any vertices, each once forth and once back with other diagonals: closed, and
// with two bytes for a triangle.
Bytes PlyOfFewVertices(int num_vertices, int num_pairs) {
  constexpr int kNumCorners = 255;
  Bytes bytes = ToBytes(
      absl::StrCat("ply\nformat binary_little_endian 1.0\nelement vertex ", num_vertices,
                   "\nproperty uchar x\nproperty uchar y\nproperty uchar z\nelement face ",
                   2 * num_pairs, "\nproperty list uchar ushort vertex_indices\nend_header\n"));
  std::mt19937 random(9);
  for (int i = 0; i < 3 * num_vertices; ++i) bytes.push_back(static_cast<std::byte>(random()));
  for (int pair = 0; pair < num_pairs; ++pair) {
    const int start = static_cast<int>(random() % num_vertices);
    const int stride = 1 + pair % 20;
    const int second_first = static_cast<int>(random() % kNumCorners);
    for (int i = 0; i < 2 * kNumCorners; ++i) {
      if (i % kNumCorners == 0) bytes.push_back(static_cast<std::byte>(kNumCorners));
      const int corner = i < kNumCorners ? i : (second_first + 2 * kNumCorners - i) % kNumCorners;
      const int v = (start + corner * stride) % num_vertices;
      bytes.push_back(static_cast<std::byte>(v));
      bytes.push_back(static_cast<std::byte>(v >> 8));
    }
  }
  return bytes;
}

// Leaves of any values, which crosses the surface at every second edge.
Bytes VdbOfNoise(int num_leaves) {
  std::mt19937 random(5);
  return VdbOfLeaves(num_leaves, 8, [&](const openvdb::Coord&) {
    return static_cast<float>(random()) * 0x1p-31f - 1.0f;
  });
}

std::vector<LargeFile> LargeFiles() {
  const mesh::TriangleMesh touching = synthetic::VoxelSurface(synthetic::RandomVoxels(20, 0.5, 6));
  mesh::TriangleMesh open = touching;
  open.triangles.conservativeResize(3, open.num_triangles() - 1);
  Bytes truncated = VdbOfNoise(200);
  truncated.resize(truncated.size() - 100);
  const std::string is_open = "1 triangle: the surface is open there";
  return {
      {"a_1.stl", StlBinary(open), 192, is_open},
      {"a_1.stl", StlAscii(open), 192, is_open},
      {"a_1.stl", StlBinary(touching), 192, ""},
      {"a_1.obj", Obj(open), 192, is_open},
      {"a_1.obj", Obj(touching), 192, ""},
      {"a_1.ply", Ply(open, PlyKind::kLittleEndian), 192, is_open},
      {"a_1.ply", Ply(touching, PlyKind::kLittleEndian), 192, ""},
      {"a_1.ply", PlyOfFewVertices(7'000, 600), 192, "more than 16 a vertex"},
      {"a_1.ply", PlyOfFewVertices(20'000, 600), 192, ""},
      {"a_1.bobj.gz", Gzip(RawBobj(open)), 512, is_open},
      {"a_1.bobj.gz", Gzip(RawBobj(touching)), 512, ""},
      {"a_1.vdb", VdbOfNoise(200), 512, "more than the "},
      {"a_1.vdb", std::move(truncated), 512, "truncated"},
  };
}

TEST(Memory, OfLargeFilesRefusedOrNotStaysWithinTheStatedBound) {
  for (const LargeFile& file : LargeFiles()) {
    const auto size = static_cast<int64_t>(file.bytes.size());
    const std::string name = absl::StrCat(file.name, " of ", size, " bytes, ", file.message);
    EXPECT_GT(size, 100'000) << name;
    absl::StatusOr<mesh::Animation> animation;
    const int64_t added = PeakAddedBy({{file.name, file.bytes}}, animation);
    EXPECT_EQ(animation.ok(), file.message.empty()) << name << animation.status();
    ExpectStatusOrGoodMesh(animation);
    EXPECT_THAT(std::string(animation.status().message()), HasSubstr(file.message)) << name;
    EXPECT_LT(added, kSmallMemoryBytes + file.per_byte * size) << name;
  }
}

}  // namespace
}  // namespace liquidblend::ingest::hostile_test
