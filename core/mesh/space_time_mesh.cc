#include "core/mesh/space_time_mesh.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <tuple>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "core/base/status_macros.h"

namespace liquidblend::mesh {
namespace {

constexpr int32_t kNone = -1;
constexpr int64_t kMaxFacetsAtOnce = int64_t{1} << 23;  // bounds the memory of the facet check

// Facets of the cell kinds as corner numbers, each run through so that a cell's facets together are
// its oriented boundary; kNone ends a triangle.
using FacetCorners = std::array<int, 4>;
constexpr std::array<FacetCorners, 4> kTetrahedronFacets = {
    {{1, 2, 3, kNone}, {0, 3, 2, kNone}, {0, 1, 3, kNone}, {0, 2, 1, kNone}}};
constexpr std::array<FacetCorners, 5> kPyramidFacets = {
    {{0, 3, 2, 1}, {0, 1, 4, kNone}, {1, 2, 4, kNone}, {2, 3, 4, kNone}, {3, 0, 4, kNone}}};
constexpr std::array<FacetCorners, 5> kWedgeFacets = {
    {{0, 2, 1, kNone}, {3, 4, 5, kNone}, {0, 1, 4, 3}, {1, 2, 5, 4}, {2, 0, 3, 5}}};
constexpr std::array<FacetCorners, 6> kHexahedronFacets = {
    {{0, 2, 3, 1}, {4, 5, 7, 6}, {0, 1, 5, 4}, {2, 6, 7, 3}, {0, 4, 6, 2}, {1, 3, 7, 5}}};

// A facet of one cell, with its corners in an order that does not depend on the cell: the lowest
// vertex first, then the lower one of its neighbours.
struct Facet {
  std::array<int32_t, 4> vertices;
  int32_t cell;      // counted over all kinds
  int8_t direction;  // +1 or -1: how the cell runs through it
};

bool operator<(const Facet& a, const Facet& b) {
  return std::tie(a.vertices, a.cell) < std::tie(b.vertices, b.cell);
}

// Makes a facet. Nothing if its corners coincide, so that it is only an edge or a vertex.
template <typename Cell>
std::optional<Facet> MakeFacet(const Cell& cell, const FacetCorners& corners, int32_t cell_number) {
  std::array<int32_t, 4> around = {kNone, kNone, kNone, kNone};
  int size = 0;
  for (const int corner : corners) {
    if (corner != kNone && (size == 0 || around[size - 1] != cell[corner])) {
      around[size++] = cell[corner];
    }
  }
  if (size > 1 && around[size - 1] == around[0]) around[--size] = kNone;
  if (size < 3) return std::nullopt;
  const int lowest =
      static_cast<int>(std::min_element(around.begin(), around.begin() + size) - around.begin());
  const int32_t next = around[(lowest + 1) % size];
  const int32_t previous = around[(lowest + size - 1) % size];
  const int step = next < previous ? 1 : size - 1;
  Facet facet = {
      {kNone, kNone, kNone, kNone}, cell_number, next < previous ? int8_t{1} : int8_t{-1}};
  for (int i = 0; i < size; ++i) facet.vertices[i] = around[(lowest + i * step) % size];
  return facet;
}

// Calls visit(kind, index in its kind, cell, facets, number over all kinds) for each cell.
template <typename Visit>
void ForEachCell(const SpaceTimeMesh& mesh, Visit&& visit) {
  int32_t number = 0;
  const auto visit_kind = [&](const char* kind, const auto& cells, const auto& facets) {
    for (size_t i = 0; i < cells.size(); ++i) visit(kind, i, cells[i], facets, number++);
  };
  visit_kind("tetrahedron", mesh.tetrahedra, kTetrahedronFacets);
  visit_kind("pyramid", mesh.pyramids, kPyramidFacets);
  visit_kind("wedge", mesh.wedges, kWedgeFacets);
  visit_kind("hexahedron", mesh.hexahedra, kHexahedronFacets);
}

std::string NameOfCell(const SpaceTimeMesh& mesh, int32_t wanted) {
  std::string name;
  ForEachCell(mesh, [&](const char* kind, size_t i, const auto&, const auto&, int32_t number) {
    if (number == wanted) name = absl::StrCat(kind, " ", i);
  });
  return name;
}

absl::Status CheckColumns(const char* what, int64_t num_columns, int64_t num_vertices) {
  if (num_columns == 0 || num_columns == num_vertices) return absl::OkStatus();
  return absl::InvalidArgumentError(absl::StrCat("space-time mesh has ", num_columns, " ", what,
                                                 " for ", num_vertices, " vertices"));
}

template <typename Columns>
absl::Status CheckFinite(const char* what, const Columns& columns) {
  for (Eigen::Index v = 0; v < columns.cols(); ++v) {
    if (columns.col(v).allFinite()) continue;
    return absl::InvalidArgumentError(absl::StrCat(what, " ", v, " is not finite"));
  }
  return absl::OkStatus();
}

absl::Status CheckNumbers(const SpaceTimeMesh& mesh) {
  if (mesh.num_vertices() > std::numeric_limits<int32_t>::max()) {
    return absl::InvalidArgumentError(
        absl::StrCat("space-time mesh has too many vertices: ", mesh.num_vertices()));
  }
  if (mesh.num_cells() > std::numeric_limits<int32_t>::max()) {
    return absl::InvalidArgumentError(
        absl::StrCat("space-time mesh has too many cells: ", mesh.num_cells()));
  }
  if (mesh.num_frames < 1) {
    return absl::InvalidArgumentError(
        absl::StrCat("space-time mesh has num_frames = ", mesh.num_frames));
  }
  if (!std::isfinite(mesh.frames_per_second) || mesh.frames_per_second <= 0.0) {
    return absl::InvalidArgumentError(
        absl::StrCat("space-time mesh has frames_per_second = ", mesh.frames_per_second));
  }
  if (!std::isfinite(mesh.edge_length_m) || mesh.edge_length_m < 0.0) {
    return absl::InvalidArgumentError(
        absl::StrCat("space-time mesh has edge_length_m = ", mesh.edge_length_m));
  }
  return absl::OkStatus();
}

absl::Status CheckRigidPieces(const SpaceTimeMesh& mesh) {
  for (size_t n = 0; n < mesh.rigid_pieces.size(); ++n) {
    const RigidPiece& piece = mesh.rigid_pieces[n];
    if (piece.first_vertex < 0 || piece.num_vertices < 1 ||
        piece.first_vertex > mesh.num_vertices() - piece.num_vertices) {
      return absl::InvalidArgumentError(absl::StrCat("rigid piece ", n, " has ", piece.num_vertices,
                                                     " vertices from ", piece.first_vertex,
                                                     " on, of ", mesh.num_vertices()));
    }
  }
  return absl::OkStatus();
}

absl::Status CheckEndSlabs(const SpaceTimeMesh& mesh) {
  const int64_t first = mesh.num_first_vertices;
  const int64_t last = mesh.num_last_vertices;
  const int64_t count = mesh.num_vertices();
  if (first < 0 || last < 0 || first > count || last > count - first) {
    return absl::InvalidArgumentError(absl::StrCat("space-time mesh has ", first,
                                                   " vertices in the first and ", last,
                                                   " in the last slab, of ", count));
  }
  for (int64_t v = 0; v < first; ++v) {
    if (mesh.vertices(3, v) < 0.0f) continue;
    return absl::InvalidArgumentError(absl::StrCat("vertex ", v, " of the first slab has time ",
                                                   mesh.vertices(3, v), ", not before frame 0"));
  }
  for (int64_t v = count - last; v < count; ++v) {
    if (mesh.vertices(3, v) > static_cast<float>(mesh.num_frames - 1)) continue;
    return absl::InvalidArgumentError(absl::StrCat("vertex ", v, " of the last slab has time ",
                                                   mesh.vertices(3, v), ", not after frame ",
                                                   mesh.num_frames - 1));
  }
  return absl::OkStatus();
}

absl::Status CheckCorners(const SpaceTimeMesh& mesh) {
  absl::Status status;
  ForEachCell(mesh, [&](const char* kind, size_t i, const auto& cell, const auto&, int32_t) {
    if (!status.ok()) return;
    for (size_t c = 0; c < cell.size(); ++c) {
      if (cell[c] < 0 || cell[c] >= mesh.num_vertices()) {
        status = absl::InvalidArgumentError(
            absl::StrCat(kind, " ", i, " has vertex ", cell[c], ", of ", mesh.num_vertices()));
        return;
      }
      const auto* const same = std::find(cell.begin(), cell.begin() + c, cell[c]);
      const bool may_coincide = cell.size() == 8 && same == cell.begin() + (c ^ 4);
      if (same != cell.begin() + c && !may_coincide) {
        status = absl::InvalidArgumentError(
            absl::StrCat(kind, " ", i, " has vertex ", cell[c], " twice"));
        return;
      }
    }
  });
  return status;
}

bool LiesInOneEndSlab(const SpaceTimeMesh& mesh, const Facet& facet) {
  const int64_t first_of_last = mesh.num_vertices() - mesh.num_last_vertices;
  const auto in_first = [&](int32_t v) { return v == kNone || v < mesh.num_first_vertices; };
  const auto in_last = [&](int32_t v) { return v == kNone || v >= first_of_last; };
  return std::all_of(facet.vertices.begin(), facet.vertices.end(), in_first) ||
         std::all_of(facet.vertices.begin(), facet.vertices.end(), in_last);
}

// Facets of all cells whose lowest vertex lies in [begin, end), sorted.
std::vector<Facet> SortedFacets(const SpaceTimeMesh& mesh, int64_t begin, int64_t end) {
  std::vector<Facet> facets;
  ForEachCell(mesh,
              [&](const char*, size_t, const auto& cell, const auto& corners, int32_t number) {
                for (const FacetCorners& facet_corners : corners) {
                  const auto facet = MakeFacet(cell, facet_corners, number);
                  if (!facet || facet->vertices[0] < begin || facet->vertices[0] >= end) continue;
                  if (!LiesInOneEndSlab(mesh, *facet)) facets.push_back(*facet);
                }
              });
  std::sort(facets.begin(), facets.end());
  return facets;
}

absl::Status CheckPairs(const SpaceTimeMesh& mesh, const std::vector<Facet>& facets) {
  for (size_t i = 0; i < facets.size();) {
    int num_forward = 0;
    int num_backward = 0;
    size_t j = i;
    for (; j < facets.size() && facets[j].vertices == facets[i].vertices; ++j) {
      ++(facets[j].direction > 0 ? num_forward : num_backward);
    }
    if (num_forward != num_backward) {
      const auto& vertices = facets[i].vertices;
      return absl::InvalidArgumentError(absl::StrCat(
          "facet (", absl::StrJoin(vertices.begin(), vertices.end() - (vertices[3] == kNone), " "),
          ") of ", NameOfCell(mesh, facets[i].cell), " is run through ", num_forward,
          " times in one direction and ", num_backward, " times in the other"));
    }
    i = j;
  }
  return absl::OkStatus();
}

// Checks facets in ranges of vertices with a bounded number of facets each, so that memory stays
// bounded too.
absl::Status CheckFacets(const SpaceTimeMesh& mesh) {
  std::vector<int64_t> num_facets(mesh.num_vertices(), 0);  // by lowest vertex
  ForEachCell(mesh,
              [&](const char*, size_t, const auto& cell, const auto& corners, int32_t number) {
                for (const FacetCorners& facet_corners : corners) {
                  const auto facet = MakeFacet(cell, facet_corners, number);
                  if (facet) ++num_facets[facet->vertices[0]];
                }
              });
  for (int64_t begin = 0; begin < mesh.num_vertices();) {
    int64_t end = begin;
    int64_t sum = 0;
    do {
      sum += num_facets[end++];
    } while (end < mesh.num_vertices() && sum + num_facets[end] <= kMaxFacetsAtOnce);
    LB_RETURN_IF_ERROR(CheckPairs(mesh, SortedFacets(mesh, begin, end)));
    begin = end;
  }
  return absl::OkStatus();
}

}  // namespace

std::vector<char> RigidVertices(const SpaceTimeMesh& mesh) {
  std::vector<char> rigid(mesh.num_vertices(), 0);
  for (const RigidPiece& piece : mesh.rigid_pieces) {
    std::fill_n(rigid.begin() + piece.first_vertex, piece.num_vertices, 1);
  }
  return rigid;
}

absl::Status Validate(const SpaceTimeMesh& mesh) {
  LB_RETURN_IF_ERROR(CheckNumbers(mesh));
  LB_RETURN_IF_ERROR(CheckColumns("normals", mesh.normals.cols(), mesh.num_vertices()));
  LB_RETURN_IF_ERROR(CheckColumns("velocities", mesh.velocities.cols(), mesh.num_vertices()));
  LB_RETURN_IF_ERROR(CheckColumns("flags of thin sheets", static_cast<int64_t>(mesh.thin.size()),
                                  mesh.num_vertices()));
  LB_RETURN_IF_ERROR(CheckFinite("vertex", mesh.vertices));
  LB_RETURN_IF_ERROR(CheckFinite("normal", mesh.normals));
  LB_RETURN_IF_ERROR(CheckFinite("velocity", mesh.velocities));
  LB_RETURN_IF_ERROR(CheckEndSlabs(mesh));
  LB_RETURN_IF_ERROR(CheckRigidPieces(mesh));
  LB_RETURN_IF_ERROR(CheckCorners(mesh));
  return CheckFacets(mesh);
}

}  // namespace liquidblend::mesh
