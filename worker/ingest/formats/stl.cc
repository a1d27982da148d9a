// STL, binary and ascii: loose triangles, welded where their corners have the same position.
//   binary  char[80]; uint32 n; then n times float32 normal[3], corner[3][3]; uint16 attribute;
//           little endian
//   ascii   solid ...; facet normal x y z; outer loop; vertex x y z, three times; endloop;
//   endfacet;
//           endsolid ...; solids may follow one another
#include <algorithm>
#include <array>
#include <bit>
#include <cstring>
#include <limits>
#include <numeric>
#include <string_view>
#include <vector>

#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "core/base/status_macros.h"
#include "worker/ingest/formats/readers.h"
#include "worker/ingest/formats/text.h"

namespace liquidblend::ingest {
namespace {

static_assert(std::endian::native == std::endian::little, "binary numbers are little endian");

constexpr size_t kHeaderSize = 80;
constexpr size_t kCountSize = sizeof(uint32_t);
constexpr size_t kNormalSize = 3 * sizeof(float);
constexpr size_t kTriangleSize = 50;
constexpr int64_t kMaxTriangles = std::numeric_limits<int32_t>::max() / 3;

// Three corners a triangle, one behind another.
using Corners = std::vector<Eigen::Vector3f>;

bool IsWord(std::string_view word, const char* keyword) {
  return absl::EqualsIgnoreCase(absl::string_view(word.data(), word.size()), keyword);
}

// Bits that are equal where positions are; both zeros are equal.
std::array<uint32_t, 3> CornerKey(const Eigen::Vector3f& position) {
  std::array<uint32_t, 3> key;
  for (int axis = 0; axis < 3; ++axis) key[axis] = std::bit_cast<uint32_t>(position[axis] + 0.0f);
  return key;
}

// Vertices are numbered in the order in which the triangles name them first.
mesh::TriangleMesh Weld(const Corners& corners) {
  std::vector<int32_t> order(corners.size());
  std::iota(order.begin(), order.end(), 0);
  std::sort(order.begin(), order.end(), [&](int32_t a, int32_t b) {
    const auto key_a = CornerKey(corners[a]);
    const auto key_b = CornerKey(corners[b]);
    return key_a != key_b ? key_a < key_b : a < b;
  });
  std::vector<int32_t> first(corners.size());  // the lowest corner at the same position
  for (size_t i = 0; i < order.size(); ++i) {
    const bool is_same = i > 0 && CornerKey(corners[order[i]]) == CornerKey(corners[order[i - 1]]);
    first[order[i]] = is_same ? first[order[i - 1]] : order[i];
  }
  mesh::TriangleMesh mesh;
  mesh.triangles.resize(3, static_cast<Eigen::Index>(corners.size() / 3));
  std::vector<int32_t>& vertex = order;  // of each corner
  int32_t num_vertices = 0;
  for (size_t c = 0; c < corners.size(); ++c) {
    vertex[c] = first[c] == static_cast<int32_t>(c) ? num_vertices++ : vertex[first[c]];
    mesh.triangles.data()[c] = vertex[c];
  }
  mesh.vertices.resize(3, num_vertices);
  for (size_t c = 0; c < corners.size(); ++c) mesh.vertices.col(vertex[c]) = corners[first[c]];
  return mesh;
}

absl::StatusOr<Corners> ReadBinary(std::string_view file) {
  if (file.size() < kHeaderSize + kCountSize) {
    return absl::DataLossError(absl::StrCat("the file is truncated in its header, after ",
                                            file.size(), " of ", kHeaderSize + kCountSize,
                                            " bytes"));
  }
  uint32_t count = 0;
  std::memcpy(&count, file.data() + kHeaderSize, sizeof(count));
  const std::string_view body = file.substr(kHeaderSize + kCountSize);
  if (count > body.size() / kTriangleSize) {
    return absl::DataLossError(absl::StrCat("the header promises ", count, " triangles, but ",
                                            body.size() / kTriangleSize, " are there"));
  }
  if (body.size() != count * kTriangleSize) {
    return absl::InvalidArgumentError(absl::StrCat(
        body.size() - count * kTriangleSize, " bytes follow the last of ", count, " triangles"));
  }
  if (count > kMaxTriangles) {
    return absl::InvalidArgumentError(absl::StrCat(count, " triangles are too many"));
  }
  Corners corners(3 * size_t{count});
  for (size_t t = 0; t < count; ++t) {
    std::memcpy(corners[3 * t].data(), body.data() + t * kTriangleSize + kNormalSize,
                3 * sizeof(Eigen::Vector3f));
  }
  return corners;
}

// Reads ascii word by word; what it expects is named with the triangle.
class AsciiReader {
 public:
  explicit AsciiReader(std::string_view text) : rest_(text) {}

  absl::StatusOr<Corners> Read() {
    while (!NextWord(rest_).empty()) {  // "solid"
      NextLine(rest_);                  // its name
      LB_RETURN_IF_ERROR(ReadSolid());
      std::string_view after = rest_;
      const std::string_view word = NextWord(after);
      if (!word.empty() && !IsWord(word, "solid")) return Unexpected("solid", word);
    }
    return std::move(corners_);
  }

 private:
  // Up to the line of "endsolid", that included.
  absl::Status ReadSolid() {
    for (std::string_view word = NextWord(rest_); !IsWord(word, "endsolid");
         word = NextWord(rest_)) {
      if (!IsWord(word, "facet")) return Unexpected("facet or endsolid", word);
      LB_RETURN_IF_ERROR(ReadFacet());
    }
    NextLine(rest_);
    return absl::OkStatus();
  }

  absl::Status ReadFacet() {
    Eigen::Vector3f position;
    LB_RETURN_IF_ERROR(Expect("normal"));
    LB_RETURN_IF_ERROR(ReadTriple(position));
    LB_RETURN_IF_ERROR(Expect("outer"));
    LB_RETURN_IF_ERROR(Expect("loop"));
    for (int corner = 0; corner < 3; ++corner) {
      LB_RETURN_IF_ERROR(Expect("vertex"));
      LB_RETURN_IF_ERROR(ReadTriple(position));
      corners_.push_back(position);
    }
    LB_RETURN_IF_ERROR(Expect("endloop"));
    LB_RETURN_IF_ERROR(Expect("endfacet"));
    ++num_triangles_;
    if (num_triangles_ <= kMaxTriangles) return absl::OkStatus();
    return absl::InvalidArgumentError("too many triangles");
  }

  absl::Status ReadTriple(Eigen::Vector3f& triple) {
    for (int axis = 0; axis < 3; ++axis) {
      const std::string_view word = NextWord(rest_);
      double value = 0.0;
      if (!ParseNumber(word, value)) return Unexpected("a number", word);
      triple[axis] = ToFloat(value);
    }
    return absl::OkStatus();
  }

  absl::Status Expect(const char* keyword) {
    const std::string_view word = NextWord(rest_);
    return IsWord(word, keyword) ? absl::OkStatus() : Unexpected(keyword, word);
  }

  absl::Status Unexpected(const char* expected, std::string_view word) const {
    if (word.empty()) {
      return absl::DataLossError(
          absl::StrCat("the file is truncated at triangle ", num_triangles_));
    }
    return absl::InvalidArgumentError(absl::StrCat("triangle ", num_triangles_, ": ", Quoted(word),
                                                   " where ", expected, " should be"));
  }

  std::string_view rest_;
  int64_t num_triangles_ = 0;
  Corners corners_;
};

// Binary files may begin with "solid" too; their size tells.
bool IsAscii(std::string_view file) {
  std::string_view rest = file;
  if (!IsWord(NextWord(rest), "solid")) return false;
  if (file.size() < kHeaderSize + kCountSize) return true;
  uint32_t count = 0;
  std::memcpy(&count, file.data() + kHeaderSize, sizeof(count));
  return file.size() != kHeaderSize + kCountSize + count * kTriangleSize;
}

}  // namespace

absl::StatusOr<mesh::TriangleMesh> ReadStl(std::span<const std::byte> bytes) {
  const std::string_view file(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  absl::StatusOr<Corners> corners = IsAscii(file) ? AsciiReader(file).Read() : ReadBinary(file);
  if (!corners.ok()) return corners.status();
  return Weld(*corners);
}

}  // namespace liquidblend::ingest
