// PLY 1.0, ascii and binary of both byte orders.
//
// Why not a library: files may be hostile. This reader bounds its memory by the file's size, and
// its errors name the element (readers.h).
#include <algorithm>
#include <bit>
#include <cstring>
#include <limits>
#include <string_view>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "core/base/status_macros.h"
#include "worker/ingest/formats/ply_header.h"
#include "worker/ingest/formats/polygons.h"
#include "worker/ingest/formats/readers.h"
#include "worker/ingest/formats/text.h"

namespace liquidblend::ingest {
namespace {

static_assert(std::endian::native == std::endian::little, "binary numbers are swapped on that");

constexpr int64_t kLargestInteger = std::numeric_limits<uint32_t>::max();

// Hands out the numbers behind the header one by one.
class PlyBody {
 public:
  PlyBody(std::string_view bytes, PlyEncoding encoding) : rest_(bytes), encoding_(encoding) {}

  // False at the end of the file or, in ascii, where there is no such number.
  bool Next(PlyType type, double& value) {
    return encoding_ == PlyEncoding::kAscii ? NextWordOf(type, value) : NextBinary(type, value);
  }

  // Why Next returned false, at an element of the file.
  absl::Status Failure(const PlyElement& element, int64_t index) const {
    const std::string where = absl::StrCat(element.name, " ", index);
    if (!bad_word_.empty()) {
      return absl::InvalidArgumentError(
          absl::StrCat(where, ": ", Quoted(bad_word_), " is not a number of the declared type"));
    }
    return absl::DataLossError(
        absl::StrCat("the file is truncated at ", where, " of ", element.count));
  }

  absl::Status ExpectEnd() {
    if (encoding_ == PlyEncoding::kAscii) {
      const std::string_view extra = NextWord(rest_);
      if (extra.empty()) return absl::OkStatus();
      return absl::InvalidArgumentError(
          absl::StrCat(Quoted(extra), " follows the last element of the header"));
    }
    if (rest_.empty()) return absl::OkStatus();
    return absl::InvalidArgumentError(
        absl::StrCat(rest_.size(), " bytes follow the last element of the header"));
  }

  // Whether `count` elements can still be there. In ascii a number takes two bytes, the last one.
  bool CanHold(const PlyElement& element) const {
    int64_t size = 0;
    for (const PlyProperty& property : element.properties) {
      const PlyType first = property.is_list ? property.count_type : property.type;
      size += encoding_ == PlyEncoding::kAscii ? 2 : PlyTypeSize(first);
    }
    return element.count * size <= static_cast<int64_t>(rest_.size()) + 1;
  }

 private:
  bool NextWordOf(PlyType type, double& value) {
    const std::string_view word = NextWord(rest_);
    if (word.empty()) return false;
    int64_t integer = 0;
    const bool is_number = IsInteger(type)
                               ? ParseInteger(word, integer) && -kLargestInteger <= integer &&
                                     integer <= kLargestInteger
                               : ParseNumber(word, value);
    if (!is_number) bad_word_ = word;
    if (IsInteger(type)) value = static_cast<double>(integer);
    return is_number;
  }

  template <typename Number>
  static double As(const char* bytes) {
    Number number;
    std::memcpy(&number, bytes, sizeof(number));
    return static_cast<double>(number);
  }

  bool NextBinary(PlyType type, double& value) {
    const auto size = static_cast<size_t>(PlyTypeSize(type));
    if (rest_.size() < size) return false;
    char bytes[8];
    std::memcpy(bytes, rest_.data(), size);
    if (encoding_ == PlyEncoding::kBigEndian) std::reverse(bytes, bytes + size);
    rest_.remove_prefix(size);
    switch (type) {
      case PlyType::kInt8:
        value = As<int8_t>(bytes);
        break;
      case PlyType::kUint8:
        value = As<uint8_t>(bytes);
        break;
      case PlyType::kInt16:
        value = As<int16_t>(bytes);
        break;
      case PlyType::kUint16:
        value = As<uint16_t>(bytes);
        break;
      case PlyType::kInt32:
        value = As<int32_t>(bytes);
        break;
      case PlyType::kUint32:
        value = As<uint32_t>(bytes);
        break;
      case PlyType::kFloat32:
        value = As<float>(bytes);
        break;
      case PlyType::kFloat64:
        value = As<double>(bytes);
        break;
    }
    return true;
  }

  std::string_view rest_;
  PlyEncoding encoding_;
  std::string_view bad_word_;
};

// Rows of the vertex element that hold positions and velocities, by property.
struct VertexLayout {
  std::vector<int> row;  // per property: 0..2 position, 3..5 velocity, -1 neither
  bool has_velocities = false;
};

absl::StatusOr<VertexLayout> FindLayout(const PlyElement& vertex) {
  VertexLayout layout;
  layout.row.assign(vertex.properties.size(), -1);
  constexpr std::string_view kNames[] = {"x", "y", "z", "vx", "vy", "vz"};
  layout.has_velocities =
      vertex.Find("vx") >= 0 || vertex.Find("vy") >= 0 || vertex.Find("vz") >= 0;
  for (int row = 0; row < (layout.has_velocities ? 6 : 3); ++row) {
    const int p = vertex.Find(kNames[row]);
    if (p < 0 || vertex.properties[p].is_list) {
      return absl::InvalidArgumentError(
          absl::StrCat("element vertex has no scalar property ", std::string(kNames[row])));
    }
    layout.row[p] = row;
  }
  return layout;
}

// A list's length or a scalar's single number.
bool NextLength(PlyBody& body, const PlyProperty& property, int64_t& length) {
  double value = 1.0;
  if (property.is_list && !body.Next(property.count_type, value)) return false;
  length = static_cast<int64_t>(value);
  return true;
}

bool SkipProperty(PlyBody& body, const PlyProperty& property) {
  int64_t length = 0;
  if (!NextLength(body, property, length)) return false;
  double unused = 0.0;
  for (int64_t i = 0; i < length; ++i) {
    if (!body.Next(property.type, unused)) return false;
  }
  return true;
}

absl::Status ReadVertices(PlyBody& body, const PlyElement& element, mesh::TriangleMesh& mesh) {
  LB_ASSIGN_OR_RETURN(const VertexLayout layout, FindLayout(element));
  mesh.vertices.resize(3, element.count);
  if (layout.has_velocities) mesh.velocities.resize(3, element.count);
  for (int32_t v = 0; v < element.count; ++v) {
    for (size_t p = 0; p < element.properties.size(); ++p) {
      const int row = layout.row[p];
      if (row < 0) {
        if (!SkipProperty(body, element.properties[p])) return body.Failure(element, v);
        continue;
      }
      double value = 0.0;
      if (!body.Next(element.properties[p].type, value)) return body.Failure(element, v);
      (row < 3 ? mesh.vertices(row, v) : mesh.velocities(row - 3, v)) = ToFloat(value);
    }
  }
  return absl::OkStatus();
}

absl::StatusOr<int> FindCorners(const PlyElement& face) {
  int p = face.Find("vertex_indices");
  if (p < 0) p = face.Find("vertex_index");
  if (p >= 0 && face.properties[p].is_list && IsInteger(face.properties[p].type)) return p;
  return absl::InvalidArgumentError(
      "element face has no list of integers vertex_indices or vertex_index");
}

absl::Status ReadFace(PlyBody& body, const PlyElement& element, int32_t face,
                      const PlyProperty& property, Polygons& polygons) {
  int64_t length = 0;
  if (!NextLength(body, property, length)) return body.Failure(element, face);
  if (length < 3 || length > std::numeric_limits<int32_t>::max()) {
    return absl::InvalidArgumentError(absl::StrCat("face ", face, " has ", length, " corners"));
  }
  for (int64_t c = 0; c < length; ++c) {
    double v = 0.0;
    if (!body.Next(property.type, v)) return body.Failure(element, face);
    if (v < 0 || v > std::numeric_limits<int32_t>::max()) {
      return absl::InvalidArgumentError(
          absl::StrCat("face ", face, ": vertex ", v, " is out of range"));
    }
    polygons.corners.push_back(static_cast<int32_t>(v));
  }
  polygons.num_corners.push_back(static_cast<int32_t>(length));
  return absl::OkStatus();
}

absl::Status ReadFaces(PlyBody& body, const PlyElement& element, Polygons& polygons) {
  LB_ASSIGN_OR_RETURN(const int corners, FindCorners(element));
  for (int32_t face = 0; face < element.count; ++face) {
    for (int p = 0; p < static_cast<int>(element.properties.size()); ++p) {
      const PlyProperty& property = element.properties[p];
      if (p == corners) {
        LB_RETURN_IF_ERROR(ReadFace(body, element, face, property, polygons));
      } else if (!SkipProperty(body, property)) {
        return body.Failure(element, face);
      }
    }
  }
  return absl::OkStatus();
}

absl::Status SkipElement(PlyBody& body, const PlyElement& element) {
  for (int32_t i = 0; i < element.count; ++i) {
    for (const PlyProperty& property : element.properties) {
      if (!SkipProperty(body, property)) return body.Failure(element, i);
    }
  }
  return absl::OkStatus();
}

}  // namespace

absl::StatusOr<mesh::TriangleMesh> ReadPly(std::span<const std::byte> bytes) {
  const std::string_view file(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  LB_ASSIGN_OR_RETURN(const PlyHeader header, ReadPlyHeader(file));
  PlyBody body(file.substr(header.size), header.encoding);
  mesh::TriangleMesh mesh;
  Polygons polygons;
  bool has_vertices = false;
  bool has_faces = false;
  for (const PlyElement& element : header.elements) {
    if (!body.CanHold(element)) {
      return absl::DataLossError(absl::StrCat("the header promises ", element.count, " of element ",
                                              Quoted(element.name),
                                              ", more than the file can hold"));
    }
    if (element.name == "vertex") {
      has_vertices = true;
      LB_RETURN_IF_ERROR(ReadVertices(body, element, mesh));
    } else if (element.name == "face") {
      has_faces = true;
      LB_RETURN_IF_ERROR(ReadFaces(body, element, polygons));
    } else {
      LB_RETURN_IF_ERROR(SkipElement(body, element));
    }
  }
  LB_RETURN_IF_ERROR(body.ExpectEnd());
  if (!has_vertices || !has_faces) {
    return absl::InvalidArgumentError(
        absl::StrCat("the header has no element ", has_vertices ? "face" : "vertex"));
  }
  LB_ASSIGN_OR_RETURN(mesh.triangles, Triangulate(polygons, mesh.vertices));
  return mesh;
}

}  // namespace liquidblend::ingest
