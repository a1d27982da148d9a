// PLY: the Stanford polygon format, binary little endian.
//
// Why not the reader of worker/ingest/formats: client and worker share no code
// (docs/architecture.md, rule 1). This one reads only what liquidblend writes.
#include <algorithm>
#include <cstring>
#include <iterator>
#include <optional>
#include <sstream>
#include <string>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "client/cli/files/mesh_file.h"

namespace liquidblend::cli {
namespace {

constexpr size_t kFaceBytes = 1 + 3 * sizeof(uint32_t);

struct PlyHeader {
  size_t num_vertices = 0;
  size_t num_faces = 0;
  std::vector<std::string> properties;  // of a vertex, a float each; x, y, z first
  size_t data_offset = 0;
};

template <typename T>
void Append(const T& value, std::string* bytes) {
  bytes->append(reinterpret_cast<const char*>(&value), sizeof(value));
}

absl::Status Refuse(const std::string& name, const std::string& reason) {
  return absl::InvalidArgumentError(absl::StrCat(name, ": ", reason));
}

// One line between "ply" and "end_header". `element` is the one that properties belong to.
absl::Status ReadHeaderLine(const std::string& line, const std::string& name, std::string* element,
                            PlyHeader* header) {
  std::istringstream words(line);
  std::string keyword, a, b, c, d;
  words >> keyword >> a >> b >> c >> d;
  if (keyword == "comment" || keyword == "obj_info") return absl::OkStatus();
  if (keyword == "format") {
    if (a == "binary_little_endian") return absl::OkStatus();
    return Refuse(name, absl::StrCat("PLY format ", a, "; only binary_little_endian is read"));
  }
  if (keyword == "element") {
    *element = a;
    size_t* count = a == "vertex" ? &header->num_vertices : &header->num_faces;
    if ((a == "vertex" || a == "face") && (std::istringstream(b) >> *count)) {
      return absl::OkStatus();
    }
  }
  if (keyword == "property" && *element == "vertex" && (a == "float" || a == "float32")) {
    const char* const first_names[] = {"x", "y", "z"};
    const size_t index = header->properties.size();
    header->properties.push_back(b);
    if (index >= 3 || b == first_names[index]) return absl::OkStatus();
  }
  if (keyword == "property" && *element == "face" && a == "list" &&
      (b == "uchar" || b == "uint8") &&
      (c == "int" || c == "uint" || c == "int32" || c == "uint32") &&
      (d == "vertex_indices" || d == "vertex_index")) {
    return absl::OkStatus();
  }
  return Refuse(name, absl::StrCat("PLY header line \"", line,
                                   "\": only float vertices that start with x, y, z and one "
                                   "uchar-int list of vertex_indices are read"));
}

absl::StatusOr<PlyHeader> ReadHeader(const std::string& bytes, const std::string& name) {
  PlyHeader header;
  std::string element;
  size_t begin = 0;
  for (int number = 0;; ++number) {
    const size_t end = bytes.find('\n', begin);
    if (end == std::string::npos) return Refuse(name, "not a PLY file, or its header is cut off");
    std::string line = bytes.substr(begin, end - begin);
    if (!line.empty() && line.back() == '\r') line.pop_back();
    begin = end + 1;
    if (number == 0 && line != "ply") return Refuse(name, "not a PLY file");
    if (number == 0) continue;
    if (line == "end_header") break;
    if (absl::Status status = ReadHeaderLine(line, name, &element, &header); !status.ok()) {
      return status;
    }
  }
  if (header.properties.size() < 3) return Refuse(name, "PLY without float x, y, z");
  header.data_offset = begin;
  return header;
}

// Properties in a row that are an attribute.
struct Attribute {
  std::vector<std::string> names;
  std::vector<float> Mesh::*values;
};
const std::vector<Attribute>& Attributes() {
  static const std::vector<Attribute> attributes = {
      {{"x", "y", "z"}, &Mesh::positions},
      {{"nx", "ny", "nz"}, &Mesh::normals},
      {{"vx", "vy", "vz"}, &Mesh::velocities},
      {{"rest_x", "rest_y", "rest_z", "rest_t"}, &Mesh::rest}};
  return attributes;
}

// Index of the first of the attribute's properties; nothing if they are not all there.
std::optional<size_t> Find(const Attribute& attribute, const std::vector<std::string>& properties) {
  const auto found = std::search(properties.begin(), properties.end(), attribute.names.begin(),
                                 attribute.names.end());
  if (found == properties.end()) return std::nullopt;
  return static_cast<size_t>(found - properties.begin());
}

// The vertices at `read`. Names the properties that are in none of the attributes.
std::string ReadVertices(const PlyHeader& header, const char* read, Mesh* mesh) {
  const size_t num_floats = header.properties.size();
  std::vector<std::string> others = header.properties;
  for (const Attribute& attribute : Attributes()) {
    const std::optional<size_t> first = Find(attribute, header.properties);
    if (!first.has_value()) continue;
    const size_t size = attribute.names.size();
    for (size_t k = 0; k < size; ++k) others[*first + k].clear();
    std::vector<float>& values = mesh->*attribute.values;
    values.resize(size * header.num_vertices);
    for (size_t v = 0; v < header.num_vertices; ++v) {
      std::memcpy(&values[size * v], read + sizeof(float) * (num_floats * v + *first),
                  size * sizeof(float));
    }
  }
  others.erase(std::remove(others.begin(), others.end(), ""), others.end());
  return absl::StrJoin(others, ", ");
}

}  // namespace

std::string ToPly(const Mesh& mesh) {
  std::string bytes =
      absl::StrCat("ply\nformat binary_little_endian 1.0\nelement vertex ", mesh.num_vertices());
  for (const Attribute& attribute : Attributes()) {
    if ((mesh.*attribute.values).empty() && attribute.values != &Mesh::positions) continue;
    for (const std::string& name : attribute.names) {
      absl::StrAppend(&bytes, "\nproperty float ", name);
    }
  }
  absl::StrAppend(&bytes, "\nelement face ", mesh.num_triangles(),
                  "\nproperty list uchar int vertex_indices\nend_header\n");
  for (size_t v = 0; v < mesh.num_vertices(); ++v) {
    for (const Attribute& attribute : Attributes()) {
      const std::vector<float>& values = mesh.*attribute.values;
      if (values.empty()) continue;
      const size_t size = attribute.names.size();
      bytes.append(reinterpret_cast<const char*>(&values[size * v]), size * sizeof(float));
    }
  }
  for (size_t t = 0; t < mesh.num_triangles(); ++t) {
    Append(uint8_t{3}, &bytes);
    for (size_t k = 0; k < 3; ++k) Append(mesh.triangles[3 * t + k], &bytes);
  }
  return bytes;
}

absl::StatusOr<Mesh> FromPly(const std::string& bytes, const std::string& name,
                             std::string* passed_over) {
  absl::StatusOr<PlyHeader> header = ReadHeader(bytes, name);
  if (!header.ok()) return header.status();
  const size_t vertex_bytes = sizeof(float) * header->properties.size();
  const size_t available = bytes.size() - header->data_offset;
  if (header->num_vertices > available / vertex_bytes ||
      header->num_faces > (available - header->num_vertices * vertex_bytes) / kFaceBytes) {
    return absl::DataLossError(absl::StrCat(name, ": cut off, or not all faces are triangles"));
  }
  Mesh mesh;
  const char* read = bytes.data() + header->data_offset;
  const std::string others = ReadVertices(*header, read, &mesh);
  if (passed_over != nullptr) *passed_over = others;
  read += header->num_vertices * vertex_bytes;
  mesh.triangles.resize(3 * header->num_faces);
  for (size_t t = 0; t < header->num_faces; ++t, read += kFaceBytes) {
    if (*read != 3) {
      return Refuse(name, absl::StrCat("face ", t, " is not a triangle; only triangles are read"));
    }
    std::memcpy(&mesh.triangles[3 * t], read + 1, 3 * sizeof(uint32_t));
  }
  return mesh;
}

}  // namespace liquidblend::cli
