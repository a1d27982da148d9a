// Wavefront OBJ: statements v and f.
//
// Why not a library: files may be hostile. This reader bounds its memory by the size of the file,
// refuses statements that would change the surface, and its errors name the element (readers.h).
#include <algorithm>
#include <limits>
#include <string_view>
#include <vector>

#include "absl/strings/str_cat.h"
#include "core/base/status_macros.h"
#include "worker/ingest/formats/polygons.h"
#include "worker/ingest/formats/readers.h"
#include "worker/ingest/formats/text.h"

namespace liquidblend::ingest {
namespace {

// Statements that say nothing about the surface. Others, curved surfaces among them, are refused.
constexpr std::string_view kSkipped[] = {"vn",       "vt",       "vp",         "p",        "l",
                                         "o",        "g",        "s",          "mg",       "usemtl",
                                         "mtllib",   "usemap",   "maplib",     "lod",      "bevel",
                                         "c_interp", "d_interp", "shadow_obj", "trace_obj"};

constexpr int64_t kMaxVertices = std::numeric_limits<int32_t>::max();

absl::Status ReadVertex(std::string_view words, std::vector<Eigen::Vector3f>& vertices) {
  Eigen::Vector3f position;
  for (int axis = 0; axis < 3; ++axis) {
    const std::string_view word = NextWord(words);
    double value = 0.0;
    if (!ParseNumber(word, value)) {
      return absl::InvalidArgumentError(
          absl::StrCat("vertex ", vertices.size() + 1, ": ", Quoted(word), " is not a coordinate"));
    }
    position[axis] = ToFloat(value);
  }
  if (static_cast<int64_t>(vertices.size()) >= kMaxVertices) {
    return absl::InvalidArgumentError("too many vertices");
  }
  vertices.push_back(position);
  return absl::OkStatus();
}

// Corners are i, i/j, i//k or i/j/k; i counts from 1, or from -1 for the vertex read last.
absl::Status ReadFace(std::string_view words, int64_t num_vertices, Polygons& polygons) {
  int32_t num_corners = 0;
  for (std::string_view word = NextWord(words); !word.empty(); word = NextWord(words)) {
    int64_t number = 0;
    const bool is_integer = ParseInteger(word.substr(0, word.find('/')), number);
    const int64_t v = number < 0 ? num_vertices + number : number - 1;
    if (!is_integer || v < 0 || v >= kMaxVertices) {
      return absl::InvalidArgumentError(absl::StrCat("face ", polygons.num_corners.size() + 1, ": ",
                                                     Quoted(word), " is not a vertex"));
    }
    polygons.corners.push_back(static_cast<int32_t>(v));
    ++num_corners;
  }
  polygons.num_corners.push_back(num_corners);
  return absl::OkStatus();
}

bool IsSkipped(std::string_view statement) {
  return statement.empty() || statement.front() == '#' ||
         std::find(std::begin(kSkipped), std::end(kSkipped), statement) != std::end(kSkipped);
}

}  // namespace

absl::StatusOr<mesh::TriangleMesh> ReadObj(std::span<const std::byte> bytes) {
  std::string_view text(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  std::vector<Eigen::Vector3f> vertices;
  Polygons polygons;
  polygons.first_number = 1;
  while (!text.empty()) {
    std::string_view words = NextLine(text, LineEnds::kContinued);
    const std::string_view statement = NextWord(words);
    if (statement == "v") {
      LB_RETURN_IF_ERROR(ReadVertex(words, vertices));
    } else if (statement == "f") {
      LB_RETURN_IF_ERROR(ReadFace(words, static_cast<int64_t>(vertices.size()), polygons));
    } else if (!IsSkipped(statement)) {
      return absl::InvalidArgumentError(
          absl::StrCat(Quoted(statement), " is not a statement of a polygon OBJ"));
    }
  }
  mesh::TriangleMesh mesh;
  mesh.vertices.resize(3, static_cast<Eigen::Index>(vertices.size()));
  for (size_t v = 0; v < vertices.size(); ++v) mesh.vertices.col(v) = vertices[v];
  LB_ASSIGN_OR_RETURN(mesh.triangles, Triangulate(polygons, mesh.vertices));
  return mesh;
}

}  // namespace liquidblend::ingest
