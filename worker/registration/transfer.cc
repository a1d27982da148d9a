#include "worker/registration/transfer.h"

#include <algorithm>
#include <array>
#include <cassert>
#include <span>
#include <utility>
#include <vector>

#include "worker/registration/surface/closest_point.h"

namespace liquidblend::registration {
namespace {

constexpr int kNumNeighbors = 12;
constexpr float kMinAgreement = 0.3F;  // cosine between normals
constexpr float kMinDistanceSq =
    0.01F;  // squared edges: keeps the weight of a vertex met exactly finite

}  // namespace

struct TransferSource::Impl {
  Impl(const mesh::SpaceTimeMesh& from, const parallel::Arena& arena)
      : mesh(from),
        points(InEdgeUnits(from.vertices, from.edge_length_m)),
        tree(points, FreeVertices(from, 0, from.num_vertices()), arena) {}
  const mesh::SpaceTimeMesh& mesh;
  Points points;
  PointTree tree;
};

TransferSource::TransferSource(const mesh::SpaceTimeMesh& mesh, const parallel::Arena& arena)
    : impl_(std::make_unique<Impl>(mesh, arena)) {
  assert(!impl_->tree.empty());
  assert(mesh.normals.cols() == mesh.num_vertices());
}
TransferSource::~TransferSource() = default;

Transfer::Transfer(const TransferSource& source, const mesh::SpaceTimeMesh& to,
                   const parallel::Arena& arena) {
  assert(to.normals.cols() == to.num_vertices());
  const mesh::SpaceTimeMesh& from = source.impl_->mesh;
  const Points& from_points = source.impl_->points;
  const PointTree& tree = source.impl_->tree;
  const Points to_points = InEdgeUnits(to.vertices, from.edge_length_m);
  const auto count = static_cast<int>(std::min<size_t>(kNumNeighbors, tree.size()));
  neighbors_.setZero(count, to.num_vertices());
  weights_.setZero(count, to.num_vertices());
  arena.For(to.num_vertices(), [&](int64_t v) {
    std::array<int32_t, kNumNeighbors> found = {};
    tree.Nearest(to_points.col(v), std::span(found).first(static_cast<size_t>(count)));
    for (int n = 0; n < count; ++n) {
      neighbors_(n, v) = found[n];
      const float agreement = from.normals.col(found[n]).dot(to.normals.col(v));
      if (agreement < kMinAgreement) continue;
      const float distance_sq = (from_points.col(found[n]) - to_points.col(v)).squaredNorm();
      weights_(n, v) = agreement * agreement / (distance_sq + kMinDistanceSq);
    }
    const float sum = weights_.col(v).sum();
    if (sum > 0.0F) {
      weights_.col(v) /= sum;
    } else {
      weights_(0, v) = 1.0F;
    }
  });
  CopyRigidPieces(from, to);
}

void Transfer::CopyRigidPieces(const mesh::SpaceTimeMesh& from, const mesh::SpaceTimeMesh& to) {
  const bool same = from.rigid_pieces.size() == to.rigid_pieces.size();
  for (size_t n = 0; n < to.rigid_pieces.size(); ++n) {
    const mesh::RigidPiece& piece = to.rigid_pieces[n];
    if (same) {
      neighbors_.col(piece.first_vertex).setConstant(from.rigid_pieces[n].first_vertex);
      weights_.col(piece.first_vertex) = Eigen::VectorXf::Unit(weights_.rows(), 0);
    }
    for (int32_t k = 1; k < piece.num_vertices; ++k) {
      neighbors_.col(piece.first_vertex + k) = neighbors_.col(piece.first_vertex);
      weights_.col(piece.first_vertex + k) = weights_.col(piece.first_vertex);
    }
  }
}

Eigen::Matrix4Xf Transfer::Apply(const Eigen::Matrix4Xf& values,
                                 const parallel::Arena& arena) const {
  if (values.cols() == 0) return values;
  Eigen::Matrix4Xf result(4, neighbors_.cols());
  arena.For(neighbors_.cols(), [&](int64_t v) {
    Eigen::Vector4f sum = Eigen::Vector4f::Zero();
    for (Eigen::Index n = 0; n < neighbors_.rows(); ++n) {
      sum += weights_(n, v) * values.col(neighbors_(n, v));
    }
    result.col(v) = sum;
  });
  return result;
}

}  // namespace liquidblend::registration
