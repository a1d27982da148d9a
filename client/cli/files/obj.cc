// OBJ: Wavefront text, vertices and triangles.
//
// Why not the reader of worker/ingest/formats: client and worker share no code
// (docs/architecture.md, rule 1). This one reads only triangles, into the client's Mesh.
#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "absl/strings/str_split.h"
#include "client/cli/files/mesh_file.h"

namespace liquidblend::cli {
namespace {

absl::Status Refuse(const std::string& name, size_t line_number, const char* reason) {
  return absl::InvalidArgumentError(absl::StrCat(name, ": line ", line_number, ": ", reason));
}

bool AddVertex(const std::vector<absl::string_view>& words, Mesh* mesh) {
  for (size_t k = 1; k <= 3; ++k) {
    float value = 0.0f;
    if (k >= words.size() || !absl::SimpleAtof(words[k], &value)) return false;
    mesh->positions.push_back(value);
  }
  return true;
}

// "7", "7/1", "7//3" -> vertex 6. Relative (negative) indices are not read.
bool AddTriangle(const std::vector<absl::string_view>& words, Mesh* mesh) {
  if (words.size() != 4) return false;
  for (size_t k = 1; k <= 3; ++k) {
    uint32_t index = 0;
    if (!absl::SimpleAtoi(words[k].substr(0, words[k].find('/')), &index) || index == 0) {
      return false;
    }
    mesh->triangles.push_back(index - 1);
  }
  return true;
}

}  // namespace

std::string ToObj(const Mesh& mesh) {
  std::string text;
  for (size_t v = 0; v < mesh.num_vertices(); ++v) {
    const float* p = &mesh.positions[3 * v];
    absl::StrAppendFormat(&text, "v %.9g %.9g %.9g\n", p[0], p[1], p[2]);
  }
  for (size_t t = 0; t < mesh.num_triangles(); ++t) {
    const uint32_t* v = &mesh.triangles[3 * t];
    absl::StrAppend(&text, "f ", v[0] + 1, " ", v[1] + 1, " ", v[2] + 1, "\n");
  }
  return text;
}

absl::StatusOr<Mesh> FromObj(const std::string& bytes, const std::string& name,
                             std::string* passed_over) {
  Mesh mesh;
  bool has_normals = false, has_texture = false;
  size_t line_number = 0;
  for (const absl::string_view line : absl::StrSplit(bytes, '\n')) {
    ++line_number;
    const std::vector<absl::string_view> words =
        absl::StrSplit(line, absl::ByAnyChar(" \t\r"), absl::SkipEmpty());
    if (words.empty()) continue;
    has_normals = has_normals || words[0] == "vn";
    has_texture = has_texture || words[0] == "vt";
    if (words[0] == "v" && !AddVertex(words, &mesh)) {
      return Refuse(name, line_number, "\"v\" needs three numbers");
    }
    if (words[0] == "f" && !AddTriangle(words, &mesh)) {
      return Refuse(name, line_number,
                    "\"f\" needs three positive indices: only triangles are read");
    }
  }
  if (mesh.positions.empty()) {
    return absl::InvalidArgumentError(absl::StrCat(name, ": not an OBJ file: no vertices"));
  }
  if (passed_over != nullptr) {
    *passed_over =
        absl::StrCat(has_normals ? "normals" : "", has_normals && has_texture ? " and " : "",
                     has_texture ? "texture coordinates" : "");
  }
  return mesh;
}

}  // namespace liquidblend::cli
