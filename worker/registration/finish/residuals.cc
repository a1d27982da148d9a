#include "worker/registration/finish/residuals.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "core/mesh/cross_product.h"
#include "worker/registration/fit/match.h"

namespace liquidblend::registration {
namespace {

constexpr int64_t kNumSamples = 20'000;  // about
constexpr int kNumSpans = 12;
constexpr float kFarEdges = 16.0f;  // off the box around the other animation: not searched for
constexpr float kLargestDistance = 8.0f;  // edges; what is further off counts no more in regions

// Points in the middle of nowhere would make the tree visit all of its leaves.
class TargetBox {
 public:
  explicit TargetBox(const Points& points)
      : low_(points.rowwise().minCoeff().array() - kFarEdges),
        high_(points.rowwise().maxCoeff().array() + kFarEdges) {}
  bool Has(const Eigen::Vector4f& p) const {
    return (p.array() >= low_.array()).all() && (p.array() <= high_.array()).all();
  }

 private:
  Eigen::Vector4f low_, high_;
};

std::vector<int32_t> ChooseSamples(const Surface& surface) {
  std::vector<int32_t> inner;
  for (const int32_t v : surface.FreeVertices()) {
    if (!surface.InFirstSlab(v) && !surface.InLastSlab(v)) inner.push_back(v);
  }
  const int64_t stride = 1 + static_cast<int64_t>(inner.size()) / kNumSamples;
  std::vector<int32_t> chosen;
  for (size_t n = 0; n < inner.size(); n += stride) chosen.push_back(inner[n]);
  return chosen;
}

// The edges e1, e2, e3 of a cell's orientation rule.
Eigen::Matrix<float, 4, 3> OrientedEdges(std::span<const int32_t> cell, const Points& points) {
  constexpr int kEnds[9][3] = {{}, {}, {}, {}, {1, 2, 3}, {1, 3, 4}, {1, 2, 3}, {}, {1, 2, 4}};
  Eigen::Matrix<float, 4, 3> edges;
  for (int k = 0; k < 3; ++k) {
    edges.col(k) = points.col(cell[kEnds[cell.size()][k]]) - points.col(cell[0]);
  }
  return edges;
}

// Of the moved surface around a vertex; zero where it has none.
Eigen::Vector4f NormalAt(const Surface& surface, const Points& moved, int64_t v) {
  Eigen::Vector4f sum = Eigen::Vector4f::Zero();
  for (const int32_t c : surface.cells_around[v]) {
    sum += mesh::CrossProduct(OrientedEdges(CornersOf(surface.mesh, c), moved));
  }
  const float length = sum.norm();
  return length > 0 ? Eigen::Vector4f(sum / length) : Eigen::Vector4f(Eigen::Vector4f::Zero());
}

}  // namespace

std::vector<Sample> SampleSource(const Surface& source, const Points& moved, const Surface& target,
                                 const ClosestPointSearch& target_search,
                                 const parallel::Arena& arena) {
  const TargetBox near_target(target.points);
  std::vector<int32_t> chosen = ChooseSamples(source);
  std::erase_if(chosen, [&](int32_t v) {
    return (source.IsOpen(v) || source.InPreRoll(v)) && IsBeforeTarget(source, v, moved.col(v));
  });
  std::vector<Sample> samples(chosen.size());
  arena.For(
      static_cast<int64_t>(chosen.size()),
      [&](int64_t n) {
        const Eigen::Vector4f p = moved.col(chosen[n]);
        samples[n] = {p, kNoCounterpart};
        if (!near_target.Has(p)) return;
        const auto found = target_search.Find(p, NormalAt(source, moved, chosen[n]));
        if (found) samples[n].distance = (found->position - p).norm();
      },
      64);
  return samples;
}

std::vector<Sample> SampleTarget(const Surface& source, const Points& moved, const Surface& target,
                                 const parallel::Arena& arena) {
  const PointTree tree(moved, source.FreeVertices(), arena);
  const TargetBox near_source(moved);
  const std::vector<int32_t> chosen = ChooseSamples(target);
  std::vector<Sample> samples(chosen.size());
  arena.For(
      static_cast<int64_t>(chosen.size()),
      [&](int64_t n) {
        const Eigen::Vector4f c = target.points.col(chosen[n]);
        samples[n] = {c, kNoCounterpart};
        if (!near_source.Has(c)) return;
        std::array<int32_t, PointTree::kNumCandidates> near;
        const size_t num_near = tree.Nearest(c, near);
        for (size_t k = 0; k < num_near; ++k) {
          const Eigen::Vector4f normal = NormalAt(source, moved, near[k]);
          if (normal.dot(target.mesh.normals.col(chosen[n])) < ClosestPointSearch::kMinCosine) {
            continue;
          }
          const Eigen::Vector4f offset = c - moved.col(near[k]);
          const float along = normal.dot(offset);
          const float across = (offset - along * normal).norm();
          samples[n].distance = std::min(samples[n].distance,
                                         std::hypot(along, std::max(0.0f, across - kReachEdges)));
        }
      },
      64);
  return samples;
}

double ShareBetween(const std::vector<Sample>& samples, double from, double to) {
  const auto count = std::count_if(samples.begin(), samples.end(), [&](const Sample& sample) {
    return sample.distance >= from && sample.distance < to;
  });
  return static_cast<double>(count) / static_cast<double>(std::max<size_t>(1, samples.size()));
}

double LargestUnmatchedShare(const std::vector<Sample>& samples, int num_frames) {
  std::array<int64_t, kNumSpans> count = {}, unmatched = {};
  for (const Sample& sample : samples) {
    const double frame = sample.position[3];
    const double span = frame * kNumSpans / std::max(1, num_frames - 1);
    const auto n = static_cast<size_t>(std::clamp(span, 0.0, kNumSpans - 1.0));
    ++count[n];
    unmatched[n] += sample.distance >= kReachEdges ? 1 : 0;
  }
  // Spans with few samples are judged with their neighbours' number.
  const double enough = 0.25 * static_cast<double>(samples.size()) / kNumSpans;
  double largest = 0;
  for (size_t n = 0; n < count.size(); ++n) {
    const double total = std::max({1.0, enough, static_cast<double>(count[n])});
    largest = std::max(largest, static_cast<double>(unmatched[n]) / total);
  }
  return largest;
}

void AddDistances(const std::vector<Sample>& samples, Regions& regions) {
  for (const Sample& sample : samples) {
    regions.Add(sample.position, std::min(sample.distance, kLargestDistance));
  }
}

double MeanStretch(const Surface& source, const PackedLists& neighbors, const Points& moved,
                   const parallel::Arena& arena, Regions& regions) {
  std::vector<int32_t> chosen = ChooseSamples(source);
  std::erase_if(chosen, [&](int32_t v) { return source.InPreRoll(v); });
  std::vector<double> change_share(chosen.size());
  arena.For(static_cast<int64_t>(chosen.size()), [&](int64_t n) {
    const int32_t v = chosen[n];
    double change = 0, total = 0;
    for (const int32_t w : neighbors[v]) {
      const double before = (source.points.col(w) - source.points.col(v)).norm();
      change += std::abs((moved.col(w) - moved.col(v)).norm() - before);
      total += before;
    }
    change_share[n] = total > 0 ? change / total : 0.0;
  });
  double sum = 0;
  for (size_t n = 0; n < chosen.size(); ++n) {
    sum += change_share[n];
    regions.Add(moved.col(chosen[n]), change_share[n]);
  }
  return sum / static_cast<double>(std::max<size_t>(1, chosen.size()));
}

}  // namespace liquidblend::registration
