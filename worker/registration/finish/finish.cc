#include "worker/registration/finish/finish.h"

#include <algorithm>
#include <optional>

#include "worker/registration/fit/match.h"
#include "worker/registration/surface/image_normals.h"

namespace liquidblend::registration {
namespace {

struct Residual {
  Eigen::Vector4f along_normal;  // to be added to the displacement
  float weight;
  float distance;
};

std::optional<Residual> ResidualAt(const Surface& source, const PackedLists& neighbors,
                                   const Surface& target, const ClosestPointSearch& target_search,
                                   const ProjectionOptions& options, const Points& displacement,
                                   int64_t v) {
  const Eigen::Vector4f p = source.points.col(v) + displacement.col(v);
  if (source.IsOpen(v) && IsBeforeTarget(source, v, p)) return std::nullopt;
  const Eigen::Vector4f image = ImageNormal(source, neighbors, displacement, 1, v);
  const bool at_first = source.InFirstSlab(v) || (source.InPreRoll(v) && p[3] < 0);
  const bool at_end = at_first || source.InLastSlab(v);
  const auto end = at_first ? ClosestPointSearch::End::kFirst : ClosestPointSearch::End::kLast;
  auto match = at_end ? target_search.FindAtEnd(end, p, image) : target_search.Find(p, image);
  if (!match || IsOpenMatch(source, target, v, match->vertex)) return std::nullopt;
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

}  // namespace

double ProjectOntoTarget(const Surface& source, const PackedLists& neighbors, const Surface& target,
                         const ClosestPointSearch& target_search, const ProjectionOptions& options,
                         const parallel::Arena& arena, Points& displacement) {
  const int64_t count = source.points.cols();
  Points residual = Points::Zero(4, count);
  Eigen::VectorXf weight = Eigen::VectorXf::Zero(count);
  Eigen::VectorXf distance = Eigen::VectorXf::Constant(count, -1.0f);
  arena.For((count + options.stride - 1) / options.stride, [&](int64_t n) {
    const int64_t v = n * options.stride;
    const auto found =
        ResidualAt(source, neighbors, target, target_search, options, displacement, v);
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

Points Smooth(const Points& displacement, const PackedLists& neighbors, int sweeps,
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
