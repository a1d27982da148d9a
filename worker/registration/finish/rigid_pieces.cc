#include "worker/registration/finish/rigid_pieces.h"

#include <algorithm>
#include <array>

#include "worker/registration/surface/closest_point.h"

namespace liquidblend::registration {
namespace {

constexpr size_t kNumNearest = 24;      // vertices that say how a droplet moves
constexpr float kMinDistance = 2.0f;    // edges; nearer than this their distance does not count
constexpr int kSmoothingPasses = 4;     // along a droplet
constexpr float kMinPaceOfTime = 0.2f;  // of the source's, along a droplet

Eigen::Vector4f MeanMoveAround(const Eigen::Vector4f& centre, const PointTree& tree,
                               const Points& points, const Points& displacement) {
  std::array<int32_t, kNumNearest> nearest;
  const size_t count = tree.Nearest(centre, nearest);
  Eigen::Vector4f sum = Eigen::Vector4f::Zero();
  float total = 0;
  for (size_t n = 0; n < count; ++n) {
    const float distance_sq = (points.col(nearest[n]) - centre).squaredNorm();
    const float weight = 1 / (distance_sq + kMinDistance * kMinDistance);
    sum += weight * displacement.col(nearest[n]);
    total += weight;
  }
  return total > 0 ? Eigen::Vector4f(sum / total) : sum;
}

// Of the pieces of one droplet, in the order of time.
void SmoothAlong(Eigen::Ref<Points> moves) {
  for (int pass = 0; pass < kSmoothingPasses; ++pass) {
    const Points before = moves;
    for (int64_t n = 1; n + 1 < moves.cols(); ++n) {
      moves.col(n) = 0.25f * (before.col(n - 1) + 2 * before.col(n) + before.col(n + 1));
    }
  }
}

void KeepTimeGoingOn(const Points& centres, int64_t begin, Eigen::Ref<Points> moves) {
  for (int64_t n = 1; n < moves.cols(); ++n) {
    const float gap = centres(3, begin + n) - centres(3, begin + n - 1);
    moves(3, n) = std::max(moves(3, n), moves(3, n - 1) - (1 - kMinPaceOfTime) * gap);
  }
}

}  // namespace

void CarryRigidPieces(const Surface& surface, const parallel::Arena& arena, Points& displacement) {
  const auto& pieces = surface.mesh.rigid_pieces;
  const int64_t count = static_cast<int64_t>(pieces.size());
  if (count == 0) return;
  const PointTree tree(surface.points, surface.FreeVertices(), arena);
  Points centres(4, count), moves(4, count);
  arena.For(
      count,
      [&](int64_t n) {
        centres.col(n) = surface.points.middleCols(pieces[n].first_vertex, pieces[n].num_vertices)
                             .rowwise()
                             .mean();
        moves.col(n) = MeanMoveAround(centres.col(n), tree, surface.points, displacement);
      },
      16);
  for (int64_t begin = 0, end = 0; begin < count; begin = end) {
    while (end < count && pieces[end].droplet == pieces[begin].droplet) ++end;
    SmoothAlong(moves.middleCols(begin, end - begin));
    KeepTimeGoingOn(centres, begin, moves.middleCols(begin, end - begin));
  }
  for (int64_t n = 0; n < count; ++n) {
    displacement.middleCols(pieces[n].first_vertex, pieces[n].num_vertices).colwise() =
        Eigen::Vector4f(moves.col(n));
  }
}

}  // namespace liquidblend::registration
