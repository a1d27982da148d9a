#include "worker/registration/finish/folds.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <optional>

#include "worker/registration/surface/image_normals.h"

namespace liquidblend::registration {
namespace {

constexpr int kMaxRelaxRounds = 8;
constexpr int kRelaxSweeps = 3;    // of the averaging inside a folded region
constexpr float kSameSide = 0.3f;  // cosine: neighbours that belong to the same sheet
constexpr float kTurned = -0.1f;   // cosine: turned against each other
constexpr double kMaxTurnedShare = 0.125;

// A layer that faces against the target next to it, at most so far from it, is tucked this far
// beneath; those around it follow over a few sweeps.
constexpr float kAgainst = -0.2f;     // cosine of the angle between the normals
constexpr float kOffsetReach = 2.5f;  // edges
constexpr float kOffsetDepth = 0.3f;  // edges
constexpr int kOffsetSweeps = 3;
constexpr int kOffsetRounds = 2;

bool IsTurned(const Surface& source, const PackedLists& neighbors, const Points& normals,
              int64_t v) {
  int num_same = 0, num_turned = 0;
  for (const int32_t w : neighbors[v]) {
    if (source.mesh.normals.col(v).dot(source.mesh.normals.col(w)) < kSameSide) continue;
    ++num_same;
    num_turned += normals.col(v).dot(normals.col(w)) < kTurned ? 1 : 0;
  }
  return num_turned > kMaxTurnedShare * num_same;
}

// Those flagged, ascending.
std::vector<int32_t> Flagged(const std::vector<char>& flags) {
  std::vector<int32_t> flagged;
  for (size_t v = 0; v < flags.size(); ++v) {
    if (flags[v] != 0) flagged.push_back(static_cast<int32_t>(v));
  }
  return flagged;
}

// The vertices and their neighbours, ascending.
std::vector<int32_t> WithRing(const std::vector<int32_t>& vertices, const PackedLists& neighbors) {
  std::vector<char> flags(neighbors.num_rows(), 0);
  for (const int32_t v : vertices) {
    flags[v] = 1;
    for (const int32_t w : neighbors[v]) flags[w] = 1;
  }
  return Flagged(flags);
}

// Inverse-distance averaging of the displacements inside a region; outside they stay.
void AverageInside(const Surface& source, const PackedLists& neighbors,
                   const std::vector<int32_t>& region, const parallel::Arena& arena,
                   Points& displacement) {
  const int64_t count = static_cast<int64_t>(region.size());
  Points next(4, count);
  for (int sweep = 0; sweep < kRelaxSweeps; ++sweep) {
    arena.For(count, [&](int64_t n) {
      const int32_t v = region[n];
      Eigen::Vector4f sum = Eigen::Vector4f::Zero();
      float total = 0;
      for (const int32_t w : neighbors[v]) {
        const float weight =
            1.0f / std::max(1e-3f, (source.points.col(w) - source.points.col(v)).norm());
        sum += weight * displacement.col(w);
        total += weight;
      }
      next.col(n) = total > 0 ? Eigen::Vector4f(sum / total) : Eigen::Vector4f(displacement.col(v));
    });
    for (int64_t n = 0; n < count; ++n) displacement.col(region[n]) = next.col(n);
  }
}

// Offset of v that brings it beneath the target; nothing if its layer faces as the target does or
// is beneath it already.
std::optional<Eigen::Vector4f> InvertedOffset(const Surface& source, const Points& normals,
                                              const ClosestPointSearch& target,
                                              const Points& displacement, int64_t v) {
  if (source.rigid[v] || source.InFirstSlab(v) || source.InLastSlab(v)) return std::nullopt;
  const Eigen::Vector4f p = source.points.col(v) + displacement.col(v);
  const auto near = target.NearestVertex(p);
  if (!near || (p - near->position).norm() > kOffsetReach) return std::nullopt;
  if (normals.col(v).dot(near->normal) > kAgainst) return std::nullopt;
  const float height = near->normal.dot(p - near->position);
  if (height < -kOffsetDepth) return std::nullopt;
  return (-kOffsetDepth - height) * near->normal;
}

// Offsets the inverted vertices of the region, and their surroundings with them. Sets `region` to
// all vertices that moved. Returns the number of inverted ones.
int64_t OffsetRound(const Surface& source, const PackedLists& neighbors, const Points& normals,
                    const ClosestPointSearch& target, const parallel::Arena& arena,
                    std::vector<int32_t>& region, Points& displacement) {
  Points moves = Points::Zero(4, source.points.cols());
  std::vector<char> is_moved(source.points.cols(), 0);
  arena.For(static_cast<int64_t>(region.size()), [&](int64_t n) {
    const auto move = InvertedOffset(source, normals, target, displacement, region[n]);
    if (!move) return;
    moves.col(region[n]) = *move;
    is_moved[region[n]] = 1;
  });
  region = Flagged(is_moved);
  const int64_t num_moved = static_cast<int64_t>(region.size());
  for (int sweep = 0; sweep < kOffsetSweeps; ++sweep) {
    region = WithRing(region, neighbors);
    Points next(4, static_cast<int64_t>(region.size()));
    arena.For(next.cols(), [&](int64_t n) {
      const int32_t v = region[n];
      Eigen::Vector4f sum = Eigen::Vector4f::Zero();
      for (const int32_t w : neighbors[v]) sum += moves.col(w);
      const float num_around = static_cast<float>(std::max<size_t>(1, neighbors[v].size()));
      next.col(n) = is_moved[v] ? moves.col(v) : Eigen::Vector4f(0.5f / num_around * sum);
    });
    for (int64_t n = 0; n < next.cols(); ++n) moves.col(region[n]) = next.col(n);
  }
  for (const int32_t v : region) displacement.col(v) += moves.col(v);
  return num_moved;
}

}  // namespace

int64_t RelaxFolds(const Surface& source, const PackedLists& neighbors, float weight,
                   const parallel::Arena& arena, Points& displacement) {
  const int64_t count = source.points.cols();
  Points normals = ImageNormals(source, neighbors, displacement, weight, arena);
  std::vector<char> turned(count, 0);
  arena.For(count, [&](int64_t v) { turned[v] = IsTurned(source, neighbors, normals, v); });
  for (int round = 0;; ++round) {
    const std::vector<int32_t> bad = Flagged(turned);
    if (bad.empty() || round == kMaxRelaxRounds) return static_cast<int64_t>(bad.size());
    const std::vector<int32_t> region = WithRing(bad, neighbors);
    AverageInside(source, neighbors, region, arena, displacement);
    const std::vector<int32_t> changed = WithRing(region, neighbors);
    const int64_t num_changed = static_cast<int64_t>(changed.size());
    arena.For(num_changed, [&](int64_t n) {
      normals.col(changed[n]) = ImageNormal(source, neighbors, displacement, weight, changed[n]);
    });
    const std::vector<int32_t> affected = WithRing(changed, neighbors);
    arena.For(static_cast<int64_t>(affected.size()), [&](int64_t n) {
      turned[affected[n]] = IsTurned(source, neighbors, normals, affected[n]);
    });
  }
}

int64_t OffsetInvertedLayers(const Surface& source, const PackedLists& neighbors,
                             const ClosestPointSearch& target, const parallel::Arena& arena,
                             Points& displacement) {
  Points normals = ImageNormals(source, neighbors, displacement, 1, arena);
  std::vector<int32_t> region(source.points.cols());
  std::iota(region.begin(), region.end(), 0);
  int64_t num_moved = 0;
  for (int round = 0; round < kOffsetRounds; ++round) {
    if (round > 0) {  // elsewhere nothing has changed
      region = WithRing(region, neighbors);
      arena.For(static_cast<int64_t>(region.size()), [&](int64_t n) {
        const int32_t v = region[n];
        normals.col(v) = ImageNormal(source, neighbors, displacement, 1, v);
      });
    }
    num_moved = OffsetRound(source, neighbors, normals, target, arena, region, displacement);
  }
  return num_moved;
}

}  // namespace liquidblend::registration
