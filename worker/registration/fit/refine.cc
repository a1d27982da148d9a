#include "worker/registration/fit/refine.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "core/base/status_macros.h"

namespace liquidblend::registration {
namespace {

constexpr double kMapDamping = 1e-2;  // of X, relative: along the normal nothing else holds it

NodeMap FitMap(const std::vector<GeodesicSearch::Reached>& around, const Points& rest,
               const Points& displacement, int32_t centre, float radius) {
  Eigen::Matrix<double, 5, 5> gram = Eigen::Matrix<double, 5, 5>::Zero();
  Eigen::Matrix<double, 4, 5> moment = Eigen::Matrix<double, 4, 5>::Zero();
  for (const GeodesicSearch::Reached& reached : around) {
    const double q = reached.distance / radius;
    Eigen::Matrix<double, 5, 1> c;
    c << (rest.col(reached.vertex) - rest.col(centre)).cast<double>(), 1.0;
    const Eigen::Matrix<double, 5, 1> weighted = (1 - q * q) * c;
    gram += weighted * c.transpose();
    moment += displacement.col(reached.vertex).cast<double>() * weighted.transpose();
  }
  gram.diagonal().head<4>().array() += kMapDamping * gram.trace();
  const Eigen::LDLT<Eigen::Matrix<double, 5, 5>> factor(gram);
  const Eigen::Matrix<double, 5, 4> solved = factor.solve(moment.transpose());
  return solved.transpose().cast<float>();
}

}  // namespace

std::vector<NodeMap> FitMaps(const DeformationNodes& nodes, const Points& rest,
                             const PackedLists& neighbors, const Points& displacement,
                             double radius, const parallel::Arena& arena) {
  constexpr int64_t kNodesPerTask = 128;
  const float reach = static_cast<float>(radius);
  std::vector<NodeMap> maps(nodes.num_nodes());
  arena.ForChunks(nodes.num_nodes(), kNodesPerTask, [&](int64_t, int64_t begin, int64_t end) {
    GeodesicSearch search(rest, neighbors);
    for (int64_t n = begin; n < end; ++n) {
      maps[n] =
          FitMap(search.From(nodes.vertex(n), reach), rest, displacement, nodes.vertex(n), reach);
    }
  });
  return maps;
}

absl::StatusOr<std::vector<Pin>> ChangedPins(const std::vector<Correspondence>& before,
                                             const std::vector<Correspondence>& now,
                                             const Surface& source, const Surface& target,
                                             const parallel::Arena& arena) {
  std::vector<Correspondence> changed = now, removed;
  for (const Correspondence& old : before) {
    const auto same =
        std::find_if(changed.begin(), changed.end(),
                     [&](const Correspondence& candidate) { return IsSame(old, candidate); });
    if (same == changed.end()) {
      removed.push_back(old);
    } else {
      changed.erase(same);
    }
  }
  changed.insert(changed.end(), removed.begin(), removed.end());
  return ExpandCorrespondences(changed, source, target, arena);
}

std::vector<float> ClosenessToPins(const DeformationNodes& nodes, const Points& rest,
                                   const std::vector<Pin>& pins, double radius) {
  std::vector<float> closeness(nodes.num_nodes(), 0.0f);
  for (int64_t n = 0; n < nodes.num_nodes(); ++n) {
    for (const Pin& pin : pins) {
      const double q = (nodes.position(n) - rest.col(pin.vertex)).norm() / radius;
      if (q < 1)
        closeness[n] = std::max(closeness[n], static_cast<float>((1 - q * q) * (1 - q * q)));
    }
  }
  return closeness;
}

}  // namespace liquidblend::registration
