// Transfer of displacements from one space-time mesh of an animation to another one, such as a
// coarser level of detail.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <memory>
#include <vector>

#include "core/mesh/space_time_mesh.h"
#include "core/parallel/arena.h"

namespace liquidblend::registration {

// The source mesh of one or several transfers. The mesh must outlive it.  Threads: safe.
class TransferSource {
 public:
  // Prepares the mesh for transfers.  Requires: the mesh has normals, and vertices outside of rigid
  // pieces. Cost: O(vertices log vertices).
  TransferSource(const mesh::SpaceTimeMesh& mesh, const parallel::Arena& arena);
  ~TransferSource();

 private:
  friend class Transfer;
  struct Impl;
  std::unique_ptr<const Impl> impl_;
};

// For each vertex of a mesh, weights of the nearest vertices of another one.
class Transfer {
 public:
  // Finds the weights for the vertices of `to`. Vertices of the source count by their closeness,
  // with a frame of time as long as a mean edge, and by how much their normals agree, so that the
  // two sides of a thin sheet do not mix. Where no normal near by agrees, the nearest vertex alone
  // counts. A rigid piece moves as the same one of the source if both meshes have as many, else as
  // its first vertex. Requires: `to` has normals. Threads: same bytes for any thread count.  Cost:
  // O(vertices log vertices).
  Transfer(const TransferSource& source, const mesh::SpaceTimeMesh& to,
           const parallel::Arena& arena);

  // Weighted means of the columns of `values`, one per vertex of `from`; no columns if `values` has
  // none.
  Eigen::Matrix4Xf Apply(const Eigen::Matrix4Xf& values, const parallel::Arena& arena) const;

 private:
  void CopyRigidPieces(const mesh::SpaceTimeMesh& from, const mesh::SpaceTimeMesh& to);

  Eigen::MatrixXi neighbors_;  // a column per vertex of `to`; vertices of `from`
  Eigen::MatrixXf weights_;    // likewise; columns add up to 1
};

}  // namespace liquidblend::registration
