// Closest points on a space-time mesh with compatible normals (paper, section 5.2). Internal to
// worker/registration.
#pragma once

#include <Eigen/Core>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "absl/functional/function_ref.h"
#include "core/parallel/arena.h"
#include "worker/registration/surface/cell_graph.h"

namespace liquidblend::registration {

struct SurfacePoint {
  Eigen::Vector4f position;
  Eigen::Vector4f normal;  // unit length
  int32_t vertex = -1;     // the mesh vertex next to it
};

// The points with time set to zero.
Points Flatten(Points points);

// Nearest neighbours among some columns of `points` (nanoflann). Large sets are cut into parts of
// columns that follow one another, so mostly are of one time, with a tree each.
// Threads: same bytes for any thread count; safe once it is made.
class PointTree {
 public:
  static constexpr size_t kNumCandidates = 12;            // of NearestIf()
  static constexpr size_t kPartPoints = size_t{1} << 18;  // the most that a part has

  // `indices`: the columns to search, ascending. Keeps a copy of them.
  PointTree(const Points& points, const std::vector<int32_t>& indices,
            const parallel::Arena& arena);
  ~PointTree();
  PointTree(PointTree&&) noexcept;

  // The nearest columns, nearest first; at most found.size() and 64, none if the query is not
  // finite. Returns how many.
  size_t Nearest(const Eigen::Vector4f& query, std::span<int32_t> found) const;
  // Of the kNumCandidates nearest columns, the nearest one that is accepted; -1: none.
  int32_t NearestIf(const Eigen::Vector4f& query, absl::FunctionRef<bool(int32_t)> accept) const;
  bool empty() const { return parts_.empty(); }
  size_t size() const;

 private:
  static constexpr size_t kFirstCandidates = 3;  // tried first: mostly one of them will do

  struct Part;
  std::vector<std::unique_ptr<Part>> parts_;
};

// A mesh to find closest points on.  Threads: safe.
class ClosestPointSearch {
 public:
  static constexpr float kMinCosine = 0.3f;  // of the angle between compatible normals

  // All arguments must outlive the search.
  ClosestPointSearch(const mesh::SpaceTimeMesh& mesh, const Points& points,
                     const PackedLists& cells_around, const parallel::Arena& arena);

  // The point closest to p on the cells around the nearest vertex whose normal is compatible.
  std::optional<SurfacePoint> Find(const Eigen::Vector4f& p, const Eigen::Vector4f& normal) const;

  // The vertex nearest to p, whatever its normal.
  std::optional<SurfacePoint> NearestVertex(const Eigen::Vector4f& p) const;

  // As Find() among the vertices of the first (last) slab only, nearest in space; a vertex itself.
  enum class End { kFirst, kLast };
  std::optional<SurfacePoint> FindAtEnd(End end, const Eigen::Vector4f& p,
                                        const Eigen::Vector4f& normal) const;

 private:
  SurfacePoint ProjectOnCells(int32_t vertex, const Eigen::Vector4f& p) const;

  const mesh::SpaceTimeMesh& mesh_;
  const Points& points_;
  const PackedLists& cells_around_;
  PointTree tree_;
  PointTree first_tree_;  // of the end slabs, time set to zero
  PointTree last_tree_;
};

}  // namespace liquidblend::registration
