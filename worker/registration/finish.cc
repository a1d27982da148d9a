#include "worker/registration/finish.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include "worker/registration/image_normals.h"

namespace liquidblend::registration {
namespace {

// A layer that faces against the target next to it, at most so far from it, is tucked this far
// beneath; those around it follow over a few sweeps.
constexpr float kAgainst = -0.2f;  // cosine of the angle between the normals
constexpr float kTuckReach = 2.5f;
constexpr float kTuckDepth = 0.3f;
constexpr int kTuckSweeps = 3;
constexpr int kTuckRounds = 2;

struct Residual {
  Eigen::Vector4f along_normal;  // to be added to the displacement
  float weight;
  float distance;
};

std::optional<Residual> ResidualAt(const Surface& source, const Points& normals,
                                   const ClosestPointSearch& target,
                                   const ProjectionOptions& options, const Points& displacement,
                                   int64_t v) {
  const Eigen::Vector4f p = source.points.col(v) + displacement.col(v);
  const Eigen::Vector4f image = normals.col(v);
  const bool at_end = source.InFirstSlab(v) || source.InLastSlab(v);
  const auto end =
      source.InFirstSlab(v) ? ClosestPointSearch::End::kFirst : ClosestPointSearch::End::kLast;
  auto match = at_end ? target.FindAtEnd(end, p, image) : target.Find(p, image);
  if (!match) return std::nullopt;
  Eigen::Vector4f offset = match->position - p;
  if (at_end) {
    offset[3] = 0;
    match->normal[3] = 0;
    match->normal.normalize();
  }
  const float distance = offset.norm();
  const float q = 1 - distance * distance / (options.max_distance * options.max_distance);
  if (!(q > 0)) return std::nullopt;
  return Residual{match->normal.dot(offset) * match->normal, q * q, distance};
}

// How far v is to be moved; nothing where its layer faces as the target does, or is beneath it.
std::optional<Eigen::Vector4f> TuckOf(const Surface& source, const Points& normals,
                                      const ClosestPointSearch& target, const Points& displacement,
                                      int64_t v) {
  if (source.rigid[v] || source.InFirstSlab(v) || source.InLastSlab(v)) return std::nullopt;
  const Eigen::Vector4f p = source.points.col(v) + displacement.col(v);
  const auto near = target.NearestVertex(p);
  if (!near || (p - near->position).norm() > kTuckReach) return std::nullopt;
  if (normals.col(v).dot(near->normal) > kAgainst) return std::nullopt;
  const float height = near->normal.dot(p - near->position);
  if (height < -kTuckDepth) return std::nullopt;
  return (-kTuckDepth - height) * near->normal;
}

}  // namespace

double ProjectOntoTarget(const Surface& source, const IndexLists& neighbors,
                         const ClosestPointSearch& target, const ProjectionOptions& options,
                         const parallel::Arena& arena, Points& displacement) {
  const int64_t count = source.points.cols();
  Points residual = Points::Zero(4, count);
  Eigen::VectorXf weight = Eigen::VectorXf::Zero(count);
  Eigen::VectorXf distance = Eigen::VectorXf::Constant(count, -1.0f);
  const Points normals = ImageNormals(source, neighbors, displacement, arena);
  arena.For(count, [&](int64_t v) {
    const auto found = ResidualAt(source, normals, target, options, displacement, v);
    if (!found) return;
    residual.col(v) = found->along_normal;
    weight[v] = options.stiffness * found->weight;
    distance[v] = found->distance;
  });
  Points correction = residual, next(4, count);
  for (int sweep = 0; sweep < options.sweeps; ++sweep) {
    arena.For(count, [&](int64_t v) {
      Eigen::Vector4f mean = Eigen::Vector4f::Zero();
      const auto around = neighbors[v];
      for (const int32_t w : around) mean += correction.col(w);
      if (!around.empty()) mean /= static_cast<float>(around.size());
      next.col(v) = (weight[v] * residual.col(v) + mean) / (weight[v] + 1);
    });
    correction.swap(next);
  }
  displacement += correction;
  const double found = arena.Sum(count, [&](int64_t v) { return distance[v] >= 0 ? 1.0 : 0.0; });
  return found > 0
             ? arena.Sum(count, [&](int64_t v) { return std::max(0.0f, distance[v]); }) / found
             : 0.0;
}

int64_t TuckTurnedLayers(const Surface& source, const IndexLists& neighbors,
                         const ClosestPointSearch& target, const parallel::Arena& arena,
                         Points& displacement) {
  const int64_t count = source.points.cols();
  double num_tucked = 0;
  for (int round = 0; round < kTuckRounds; ++round) {
    const Points normals = ImageNormals(source, neighbors, displacement, arena);
    Points moves = Points::Zero(4, count), next(4, count);
    std::vector<char> is_tucked(count, 0);
    arena.For(count, [&](int64_t v) {
      const auto move = TuckOf(source, normals, target, displacement, v);
      if (!move) return;
      moves.col(v) = *move;
      is_tucked[v] = 1;
    });
    for (int sweep = 0; sweep < kTuckSweeps; ++sweep) {
      arena.For(count, [&](int64_t v) {
        Eigen::Vector4f sum = Eigen::Vector4f::Zero();
        for (const int32_t w : neighbors[v]) sum += moves.col(w);
        const float num_around = static_cast<float>(std::max<size_t>(1, neighbors[v].size()));
        next.col(v) = is_tucked[v] ? moves.col(v) : Eigen::Vector4f(0.5f / num_around * sum);
      });
      moves.swap(next);
    }
    displacement += moves;
    num_tucked = arena.Sum(count, [&](int64_t v) { return is_tucked[v] ? 1.0 : 0.0; });
  }
  return static_cast<int64_t>(num_tucked);
}

Points Smooth(const Points& displacement, const IndexLists& neighbors, int sweeps,
              const parallel::Arena& arena) {
  Points smooth = displacement, next(4, displacement.cols());
  for (int sweep = 0; sweep < sweeps; ++sweep) {
    arena.For(smooth.cols(), [&](int64_t v) {
      Eigen::Vector4f sum = smooth.col(v);
      for (const int32_t w : neighbors[v]) sum += smooth.col(w);
      next.col(v) = sum / static_cast<float>(neighbors[v].size() + 1);
    });
    smooth.swap(next);
  }
  return smooth;
}

}  // namespace liquidblend::registration
