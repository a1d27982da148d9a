// The layout, all little endian (openvdb::io::Archive):
//   int64 magic; uint32 format version; uint32 library major, minor; uint8 has an index;
//   char[36] uuid; metadata; int32 number of grids
// and for each grid
//   string name, type, name of the grid whose tree it shares; int64 position of: this grid, its
//   leaf buffers, its end; and there: uint32 compression; metadata; string kind of transform; its
//   numbers; tree. Strings are uint32 size, chars; metadata is uint32 count and for each entry
//   string name, string type, uint32 size, bytes.
#include "worker/ingest/formats/vdb_file.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <optional>

#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "core/base/status_macros.h"
#include "worker/ingest/formats/byte_reader.h"
#include "worker/ingest/formats/text.h"

namespace liquidblend::ingest {
namespace {

constexpr int64_t kMagic = 0x56444220;
constexpr uint32_t kOldestVersion = 222;
constexpr uint32_t kNewestVersion = 224;
constexpr size_t kUuidSize = 36;
constexpr std::string_view kHalfSuffix = "_HalfFloat";
constexpr char kUniqueMark = '\x1e';  // between a name and the number that makes it unique

struct Descriptor {
  std::string_view name;
  std::string_view type;
  std::string_view instance_of;
  int64_t begin = 0;
  int64_t buffers = 0;
  int64_t end = 0;
};

// Numbers of a kind of transform, and where scale and translation are among them, or -1.
struct MapKind {
  std::string_view name;
  int num_doubles;
  int scale;
  int translation;
};
constexpr int kIsMatrix = -2;  // in the place of the scale: 16 numbers, a column behind another
constexpr MapKind kMapKinds[] = {
    {"UniformScaleMap", 15, 0, -1},         {"ScaleMap", 15, 0, -1},
    {"UniformScaleTranslateMap", 18, 3, 0}, {"ScaleTranslateMap", 18, 3, 0},
    {"TranslationMap", 3, -1, 0},           {"AffineMap", 16, kIsMatrix, -1},
    {"UnitaryMap", 16, kIsMatrix, -1}};

absl::Status ReadHeader(ByteReader& reader) {
  int64_t magic = 0;
  if (!reader.Read(magic).ok() || magic != kMagic) {
    return absl::InvalidArgumentError("the file does not begin like an OpenVDB file");
  }
  uint32_t version = 0;
  LB_RETURN_IF_ERROR(reader.Read(version));
  if (version < kOldestVersion || version > kNewestVersion) {
    return absl::InvalidArgumentError(absl::StrCat("OpenVDB file format ", version, ", but ",
                                                   kOldestVersion, " to ", kNewestVersion,
                                                   " are read"));
  }
  LB_RETURN_IF_ERROR(reader.Take(2 * sizeof(uint32_t)).status());
  uint8_t has_index = 0;
  LB_RETURN_IF_ERROR(reader.Read(has_index));
  if (has_index == 0) {
    return absl::InvalidArgumentError(
        "the OpenVDB file was written as a stream, without an index of its grids");
  }
  return reader.Take(kUuidSize).status();
}

// Reads the used entries of a grid's metadata; also skips the file's own metadata.
absl::Status ReadMetadata(ByteReader& reader, VdbGrid& grid) {
  uint32_t count = 0;
  LB_RETURN_IF_ERROR(reader.Read(count));
  for (uint32_t i = 0; i < count; ++i) {
    std::string_view name;
    std::string_view type;
    std::string_view value;
    LB_RETURN_IF_ERROR(reader.ReadString(name));
    LB_RETURN_IF_ERROR(reader.ReadString(type));
    LB_RETURN_IF_ERROR(reader.ReadString(value));
    if (name == "class" && type == "string") grid.grid_class = std::string(value);
  }
  return absl::OkStatus();
}

absl::StatusOr<Descriptor> ReadDescriptor(ByteReader& reader, int64_t file_size) {
  Descriptor descriptor;
  LB_RETURN_IF_ERROR(reader.ReadString(descriptor.name));
  LB_RETURN_IF_ERROR(reader.ReadString(descriptor.type));
  LB_RETURN_IF_ERROR(reader.ReadString(descriptor.instance_of));
  LB_RETURN_IF_ERROR(reader.Read(descriptor.begin));
  LB_RETURN_IF_ERROR(reader.Read(descriptor.buffers));
  LB_RETURN_IF_ERROR(reader.Read(descriptor.end));
  if (descriptor.begin != static_cast<int64_t>(reader.position()) ||
      descriptor.begin > descriptor.end) {
    return absl::InvalidArgumentError(absl::StrCat("grid ", Quoted(descriptor.name), " lies at [",
                                                   descriptor.begin, ", ", descriptor.end,
                                                   ") in the file, not at ", reader.position()));
  }
  if (descriptor.end > file_size) {
    return absl::DataLossError(absl::StrCat("the file is truncated: grid ", Quoted(descriptor.name),
                                            " ends at byte ", descriptor.end, " of ", file_size));
  }
  return descriptor;
}

absl::StatusOr<Eigen::Matrix4d> ReadMatrix(ByteReader& reader, const MapKind& kind) {
  double numbers[18];
  for (int i = 0; i < kind.num_doubles; ++i) LB_RETURN_IF_ERROR(reader.Read(numbers[i]));
  Eigen::Matrix4d matrix = Eigen::Matrix4d::Identity();
  if (kind.scale == kIsMatrix) matrix = Eigen::Map<const Eigen::Matrix4d>(numbers);
  for (int axis = 0; axis < 3; ++axis) {
    if (kind.scale >= 0) matrix(axis, axis) = numbers[kind.scale + axis];
    if (kind.translation >= 0) matrix(axis, 3) = numbers[kind.translation + axis];
  }
  const bool is_affine = matrix.row(3) == Eigen::RowVector4d(0, 0, 0, 1);
  if (!matrix.allFinite() || !is_affine || !matrix.inverse().allFinite()) {
    return absl::InvalidArgumentError(
        absl::StrCat("the transform ", std::string(kind.name), " cannot be inverted"));
  }
  return matrix;
}

// Nothing if the transform is not affine.
absl::StatusOr<std::optional<VdbGrid>> ReadGrid(const Descriptor& descriptor,
                                                std::span<const std::byte> bytes) {
  ByteReader reader(bytes);
  VdbGrid grid;
  grid.name = std::string(descriptor.name.substr(0, descriptor.name.find(kUniqueMark)));
  grid.type = std::string(descriptor.type);
  if (absl::EndsWith(grid.type, std::string(kHalfSuffix))) {
    grid.is_half = true;
    grid.type.resize(grid.type.size() - kHalfSuffix.size());
  }
  LB_RETURN_IF_ERROR(reader.Read(grid.compression));
  LB_RETURN_IF_ERROR(ReadMetadata(reader, grid));
  std::string_view map_name;
  LB_RETURN_IF_ERROR(reader.ReadString(map_name));
  const auto kind = std::find_if(std::begin(kMapKinds), std::end(kMapKinds),
                                 [&](const MapKind& entry) { return entry.name == map_name; });
  if (kind == std::end(kMapKinds)) return std::nullopt;
  LB_ASSIGN_OR_RETURN(grid.world_from_index, ReadMatrix(reader, *kind));
  grid.tree = bytes.subspan(reader.position());
  return grid;
}

}  // namespace

absl::StatusOr<std::vector<VdbGrid>> ReadVdbGrids(std::span<const std::byte> bytes) {
  ByteReader reader(bytes);
  LB_RETURN_IF_ERROR(ReadHeader(reader));
  VdbGrid file;  // only its metadata
  LB_RETURN_IF_ERROR(ReadMetadata(reader, file));
  int32_t num_grids = 0;
  LB_RETURN_IF_ERROR(reader.Read(num_grids));
  if (num_grids < 0) {
    return absl::InvalidArgumentError(absl::StrCat("the number of grids is ", num_grids));
  }
  std::vector<VdbGrid> grids;
  for (int32_t i = 0; i < num_grids; ++i) {
    LB_ASSIGN_OR_RETURN(const Descriptor descriptor,
                        ReadDescriptor(reader, static_cast<int64_t>(bytes.size())));
    LB_ASSIGN_OR_RETURN(const auto content,
                        reader.Take(static_cast<uint64_t>(descriptor.end - descriptor.begin)));
    if (!descriptor.instance_of.empty()) continue;
    absl::StatusOr<std::optional<VdbGrid>> grid = ReadGrid(descriptor, content);
    if (!grid.ok()) {
      return absl::Status(grid.status().code(), absl::StrCat("grid ", Quoted(descriptor.name), ": ",
                                                             std::string(grid.status().message())));
    }
    if (grid->has_value()) grids.push_back(**std::move(grid));
  }
  return grids;
}

}  // namespace liquidblend::ingest
