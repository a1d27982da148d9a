#include "worker/ingest/clean/clean.h"

#include <algorithm>
#include <array>
#include <bit>
#include <numeric>
#include <utility>

#include "absl/strings/str_cat.h"
#include "core/base/status_macros.h"
#include "worker/ingest/clean/non_manifold.h"
#include "worker/ingest/clean/outward.h"
#include "worker/ingest/clean/slivers.h"

namespace liquidblend::ingest {
namespace {

// Triangles with a corner twice bound nothing: their other two sides cancel.
int64_t DropRepeatedCorners(mesh::TriangleMesh& mesh) {
  int64_t kept = 0;
  for (int64_t t = 0; t < mesh.num_triangles(); ++t) {
    const Eigen::Vector3i c = mesh.triangles.col(t);
    if (c[0] == c[1] || c[1] == c[2] || c[2] == c[0]) continue;
    mesh.triangles.col(kept++) = c;
  }
  const int64_t num_dropped = mesh.num_triangles() - kept;
  if (num_dropped > 0) mesh.triangles.conservativeResize(3, kept);
  return num_dropped;
}

// Bits that sort equal positions together; both zeros are equal.
std::array<uint32_t, 3> PositionKey(const mesh::TriangleMesh& mesh, int32_t v) {
  std::array<uint32_t, 3> key;
  for (int axis = 0; axis < 3; ++axis) {
    key[axis] = std::bit_cast<uint32_t>(mesh.vertices(axis, v) + 0.0f);
  }
  return key;
}

// Merges vertices on open edges that lie exactly on one another into the one with the lowest index.
int64_t WeldOpenVertices(mesh::TriangleMesh& mesh) {
  const std::vector<bool> is_open = FindOpenVertices(mesh);
  std::vector<int32_t> order;
  for (int32_t v = 0; v < mesh.num_vertices(); ++v) {
    if (is_open[v]) order.push_back(v);
  }
  std::stable_sort(order.begin(), order.end(), [&](int32_t a, int32_t b) {
    return PositionKey(mesh, a) < PositionKey(mesh, b);
  });
  std::vector<int32_t> merged(mesh.num_vertices());
  std::iota(merged.begin(), merged.end(), 0);
  int64_t num_welded = 0;
  for (size_t i = 1; i < order.size(); ++i) {
    if (PositionKey(mesh, order[i]) != PositionKey(mesh, order[i - 1])) continue;
    merged[order[i]] = merged[order[i - 1]];
    ++num_welded;
  }
  if (num_welded > 0) mesh.triangles = mesh.triangles.unaryExpr([&](int v) { return merged[v]; });
  return num_welded;
}

absl::StatusOr<Pairing> CloseMesh(mesh::TriangleMesh& mesh, VertexNumbers numbers,
                                  CleanCounts& counts) {
  counts.num_repeated = DropRepeatedCorners(mesh);
  absl::StatusOr<Pairing> pairing = FindNeighbours(mesh, numbers);
  if (pairing.ok()) return pairing;
  counts.num_welded = WeldOpenVertices(mesh);
  if (counts.num_welded == 0) return pairing;
  counts.num_repeated += DropRepeatedCorners(mesh);
  pairing = FindNeighbours(mesh, numbers);
  if (pairing.ok()) return pairing;
  return absl::InvalidArgumentError(absl::StrCat(std::string(pairing.status().message()),
                                                 " (after welding ", counts.num_welded,
                                                 " vertices on open edges that lie on others)"));
}

absl::Status CheckDensity(const mesh::TriangleMesh& mesh) {
  if (mesh.num_triangles() <= kMaxTrianglesPerVertex * mesh.num_vertices()) {
    return absl::OkStatus();
  }
  return absl::InvalidArgumentError(absl::StrCat(
      mesh.num_triangles(), " triangles on ", mesh.num_vertices(), " vertices, more than ",
      kMaxTrianglesPerVertex, " a vertex, where edges have four triangles or more"));
}

// Closes the mesh and takes it apart where parts of it touch; no two edges or vertices of the
// surface are one in the mesh then.
absl::StatusOr<Neighbours> MakeManifold(mesh::TriangleMesh& mesh, VertexNumbers numbers,
                                        CleanCounts& counts) {
  LB_ASSIGN_OR_RETURN(Pairing pairing, CloseMesh(mesh, numbers, counts));
  if (pairing.num_non_manifold > 0) {
    LB_RETURN_IF_ERROR(CheckDensity(mesh));
    counts.num_back_to_back = DropBackToBack(mesh);
  }
  if (counts.num_back_to_back > 0) {
    LB_ASSIGN_OR_RETURN(pairing, FindNeighbours(mesh));
  }
  counts.num_non_manifold = pairing.num_non_manifold;
  counts.num_split = SplitPinchedVertices(pairing.neighbours, mesh);
  if (counts.num_non_manifold > 0) {
    LB_ASSIGN_OR_RETURN(counts.num_halved, HalveSharedEdges(pairing.neighbours, mesh));
  }
  if (counts.num_halved > 0) {
    pairing = {};
    LB_ASSIGN_OR_RETURN(pairing, FindNeighbours(mesh));
  }
  return std::move(pairing.neighbours);
}

int64_t DropUnusedVertices(mesh::TriangleMesh& mesh) {
  std::vector<int32_t> new_index(mesh.num_vertices(), -1);
  for (const int32_t v : mesh.triangles.reshaped()) new_index[v] = 0;
  int32_t kept = 0;
  const bool has_velocities = mesh.velocities.cols() > 0;
  for (int32_t v = 0; v < mesh.num_vertices(); ++v) {
    if (new_index[v] < 0) continue;
    mesh.vertices.col(kept) = mesh.vertices.col(v);
    if (has_velocities) mesh.velocities.col(kept) = mesh.velocities.col(v);
    new_index[v] = kept++;
  }
  const int64_t num_dropped = mesh.num_vertices() - kept;
  if (num_dropped == 0) return 0;
  mesh.vertices.conservativeResize(3, kept);
  if (has_velocities) mesh.velocities.conservativeResize(3, kept);
  for (int32_t& v : mesh.triangles.reshaped()) v = new_index[v];
  return num_dropped;
}

struct NoteKind {
  int64_t CleanCounts::*count;
  const char* before;  // the number
  const char* after;
  Eigen::Vector3f CleanCounts::*place = nullptr;  // of the first, for the note
};
constexpr NoteKind kNoteKinds[] = {
    {&CleanCounts::num_repeated, "Dropped ", " triangles that have a corner twice"},
    {&CleanCounts::num_welded, "Welded ", " vertices of open edges that lay on others"},
    {&CleanCounts::num_back_to_back, "Dropped ",
     " triangles that lay back to back on others, walls between parts of the liquid"},
    {&CleanCounts::num_non_manifold, "Took the surface apart at ",
     " edges with four triangles or more, where parts of it touch"},
    {&CleanCounts::num_halved, "Put a vertex half-way on ",
     " edges that share both ends with others"},
    {&CleanCounts::num_split, "Split pinched vertices into ", " more"},
    {&CleanCounts::num_specks, "Dropped ", " parts without extent or volume"},
    {&CleanCounts::num_slivers, "Removed ", " zero-area triangles and slivers"},
    {&CleanCounts::num_slivers_left, "Left ", " slivers that hold the surface's topology"},
    {&CleanCounts::num_unused, "Dropped ", " vertices that no triangle uses any more"},
    {&CleanCounts::num_turned, "Turned ", " parts outward that were inside out",
     &CleanCounts::first_turned}};

std::string PlaceOf(const Eigen::Vector3f& p) {
  return absl::StrCat(" at (", p.x(), ", ", p.y(), ", ", p.z(), ") m");
}

}  // namespace

absl::StatusOr<CleanCounts> Clean(mesh::TriangleMesh& mesh, VertexNumbers numbers) {
  CleanCounts counts;
  LB_ASSIGN_OR_RETURN(Neighbours neighbours, MakeManifold(mesh, numbers, counts));
  const SliverCounts slivers = RemoveSlivers(std::move(neighbours), mesh);
  counts.num_slivers = slivers.num_removed;
  counts.num_slivers_left = slivers.num_left;
  counts.num_specks = slivers.num_specks;
  counts.num_unused = DropUnusedVertices(mesh);
  LB_RETURN_IF_ERROR(CheckOutward(mesh));
  LB_ASSIGN_OR_RETURN(const TurnedParts turned, TurnPartsOutward(mesh));
  counts.num_turned = turned.count;
  counts.first_turned = turned.first;
  return counts;
}

std::vector<std::string> Notes(std::span<const CleanCounts> frames,
                               std::span<const std::string> names) {
  std::vector<std::string> notes;
  for (const NoteKind& kind : kNoteKinds) {
    int64_t total = 0;
    int64_t num_frames = 0;
    size_t first = frames.size();
    for (size_t k = 0; k < frames.size(); ++k) {
      const int64_t count = frames[k].*kind.count;
      if (count == 0) continue;
      first = std::min(first, k);
      total += count;
      ++num_frames;
    }
    if (total == 0) continue;
    notes.push_back(absl::StrCat(kind.before, total, kind.after, ", in ", num_frames, " of ",
                                 frames.size(), " frames, first in frame ", names[first],
                                 kind.place == nullptr ? "" : PlaceOf(frames[first].*kind.place),
                                 "."));
  }
  return notes;
}

}  // namespace liquidblend::ingest
