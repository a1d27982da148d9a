#include "worker/registration/fit/match.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <numeric>
#include <optional>
#include <utility>

#include "absl/strings/str_cat.h"
#include "worker/registration/features/part_motions.h"

namespace liquidblend::registration {
namespace {

constexpr float kEndTimeWeight = 10.0f;    // holds the end slabs' vertices in time
constexpr float kMaxTangentOffset = 0.8f;  // edges; below it a match only pulls along the normal
// A target sample far from the nearest source vertex along the surface belongs to a part that the
// source does not reach yet, a jet's tip say: it pulls as a point.
constexpr float kMissedPointWeight = 1.0f;
constexpr float kHeldWeight = 1.0f;    // of a vertex at an edge of the container, in space
constexpr float kMotionWeight = 1.0f;  // of a part's motion, in space and time
constexpr int kTreeStride = 4;         // of the deformed source's vertices in the search tree

std::vector<int32_t> Iota(int64_t count) {
  std::vector<int32_t> values(count);
  std::iota(values.begin(), values.end(), 0);
  return values;
}

// Moves `count` random values to the front (Fisher-Yates).
void DrawToFront(std::vector<int32_t>& values, int64_t count, Random& random) {
  const int64_t size = static_cast<int64_t>(values.size());
  for (int64_t n = 0; n < count; ++n) std::swap(values[n], values[n + random.Below(size - n)]);
}

bool IsCount(int32_t count, const std::vector<int32_t>& values) {
  return count >= 0 && static_cast<size_t>(count) <= values.size();
}

// 1 - d^2 / dm^2, squared: zero beyond dm.
float Closeness(float distance_sq, const MatchOptions& options) {
  const double q = 1 - distance_sq / (options.max_distance * options.max_distance);
  return q > 0 ? static_cast<float>(q * q) : 0.0f;
}

// A match at the ends of time: the spatial part of normal and goal, the vertex held in time. Before
// the first frame a pre-roll may take any time.
std::optional<FitTerm> EndTerm(const Surface& source, int32_t v, const Eigen::Vector4f& deformed,
                               const Eigen::Vector4f& goal, const Eigen::Vector4f& normal,
                               const MatchOptions& options) {
  const Eigen::Vector3f space = normal.head<3>();
  const float length = space.norm();
  const float weight = Closeness((goal - deformed).head<3>().squaredNorm(), options);
  if (!(length > 0) || !(weight > 0)) return std::nullopt;
  FitTerm term{v, goal - source.points.col(v), Eigen::Matrix4f::Zero()};
  term.goal[3] = 0;
  const Eigen::Vector3f n = space / length;
  term.metric.topLeftCorner<3, 3>() =
      weight * (static_cast<float>(options.point_weight) * Eigen::Matrix3f::Identity() +
                static_cast<float>(options.plane_weight) * n * n.transpose());
  if (!source.InPreRoll(v)) term.metric(3, 3) = kEndTimeWeight;
  return term;
}

// For a vertex of a part's motion at the ends of time: the goal is the expected point itself,
// brought into the plane of its match.
void HoldAsPoint(const Surface& source, const Eigen::Vector4f& expected,
                 const Eigen::Vector4f& normal, FitTerm& term) {
  const Eigen::Vector3f n = normal.head<3>().normalized();
  const Eigen::Vector3f from = expected.head<3>() - source.points.col(term.vertex).head<3>();
  term.goal.head<3>() = from + n.dot(term.goal.head<3>() - from) * n;
  term.metric.topLeftCorner<3, 3>() = kMotionWeight * Eigen::Matrix3f::Identity();
  if (!source.InPreRoll(term.vertex)) return;
  term.goal[3] = expected[3] - source.points(3, term.vertex);
  term.metric(3, 3) = kMotionWeight;
}

std::vector<int32_t> Inner(const Surface& source) {
  std::vector<int32_t> vertices;
  for (int32_t v = 0; v < source.points.cols(); v += kTreeStride) {
    if (source.rigid[v] || source.InFirstSlab(v) || source.InLastSlab(v)) continue;
    vertices.push_back(v);
  }
  return vertices;
}

std::vector<int32_t> EndSlab(const Surface& source, bool (Surface::*contains)(int64_t) const) {
  std::vector<int32_t> vertices;
  for (int32_t v = 0; v < source.points.cols(); ++v) {
    if (!source.rigid[v] && (source.*contains)(v)) vertices.push_back(v);
  }
  return vertices;
}

void AppendFound(const std::vector<std::optional<FitTerm>>& found, Matches& matches) {
  for (const auto& term : found) {
    if (!term) continue;
    matches.terms.push_back(*term);
    ++matches.num_matched;
  }
  matches.num_samples += static_cast<int64_t>(found.size());
}

// Of the samples at edges of the container, across these; at whatever time.
void AppendHeld(const Surface& source, const std::vector<int32_t>& samples, Matches& matches) {
  if (source.held.empty()) return;
  for (const int32_t v : samples) {
    const auto found = source.held.find(v);
    if (found == source.held.end()) continue;
    FitTerm term{v, Eigen::Vector4f::Zero(), Eigen::Matrix4f::Zero()};
    term.metric.topLeftCorner<3, 3>() = kHeldWeight * found->second;
    matches.terms.push_back(term);
  }
}

// Of a part that is joined with the rest in the target: there is no closest point to it there.
FitTerm TermAtStart(const Surface& source, int32_t v, const PartMotion& motion) {
  const Eigen::Vector4f p = source.points.col(v);
  const Expected expected = ExpectedOn(motion, p, source.mesh.normals.col(v));
  FitTerm term{v, expected.point - p, kMotionWeight * Eigen::Matrix4f::Identity()};
  if (source.InFirstSlab(v)) {  // it stays before the first frame
    term.goal[3] = 0;
    term.metric(3, 3) = 0;
  }
  return term;
}

}  // namespace

bool IsBeforeTarget(const Surface& source, int64_t v, const Eigen::Vector4f& moved) {
  return source.InFirstSlab(v) || moved[3] < 0;
}

bool IsOpenMatch(const Surface& source, const Surface& target, int64_t v, int64_t t) {
  return source.IsOpen(v) && target.InFirstSlab(t);
}

Eigen::Vector4f DeformedNormal(const DeformationNodes& nodes, const std::vector<NodeMap>& maps,
                               const Surface& source, int64_t v) {
  Eigen::Matrix4f jacobian = Eigen::Matrix4f::Identity();
  for (const Influence& influence : nodes.influences(v)) {
    jacobian += influence.weight * maps[influence.node].leftCols<4>();
  }
  const Eigen::Vector4f rest = source.mesh.normals.col(v);
  const float determinant = jacobian.determinant();
  if (!(std::abs(determinant) > 1e-6f)) return rest;
  const Eigen::Vector4f image = jacobian.inverse().transpose() * rest;
  const float length = image.norm();
  return length > 0 ? Eigen::Vector4f(std::copysign(1.0f / length, determinant) * image) : rest;
}

Eigen::Matrix4f MatchMetric(double weight, const Eigen::Vector4f& normal,
                            const MatchOptions& options) {
  return static_cast<float>(weight) *
         (static_cast<float>(options.point_weight) * Eigen::Matrix4f::Identity() +
          static_cast<float>(options.plane_weight) * normal * normal.transpose());
}

// The nodes' maps and what they make of the source.
struct Matcher::DeformedState {
  const DeformationNodes& nodes;
  const std::vector<NodeMap>& maps;
  Points points;
};

// Some of the deformed source's vertices, and those of its end slabs with their time set to zero.
struct Matcher::DeformedTrees {
  DeformedTrees(const Surface& source, const Points& deformed, const parallel::Arena& arena)
      : inner(deformed, Inner(source), arena),
        first(Flatten(deformed), EndSlab(source, &Surface::InFirstSlab), arena),
        last(Flatten(deformed), EndSlab(source, &Surface::InLastSlab), arena) {}
  PointTree inner, first, last;
};

Matcher::Matcher(const Surface& source, const PackedLists& source_neighbors, const Surface& target,
                 const ClosestPointSearch& target_search, const PartMotions& motions, uint64_t seed,
                 std::vector<int32_t> target_vertices)
    : source_(source),
      source_neighbors_(source_neighbors),
      target_(target),
      target_search_(target_search),
      motions_(motions),
      random_(seed),
      source_order_(source.FreeVertices()),
      target_order_(std::move(target_vertices)) {
  // Vertices of a motion are matched from the source only.
  std::erase_if(target_order_, [&](int32_t t) { return motions.HasTarget(t); });
}

Matches Matcher::Match(const DeformationNodes& nodes, const std::vector<NodeMap>& maps,
                       const MatchOptions& options, const parallel::Arena& arena) {
  const std::vector<int32_t> source_samples = DrawSource(options);
  const std::vector<int32_t> target_samples = DrawTarget(options);
  const DeformedState state{nodes, maps, Deform(nodes, maps, source_.points, arena)};
  Matches matches;
  std::optional<DeformedTrees> trees;
  arena.Run(2, [&](int64_t n) {
    if (n == 0) {
      MatchSource(state, source_samples, options, arena, matches);
    } else {
      trees.emplace(source_, state.points, arena);
    }
  });
  MatchTarget(state, *trees, target_samples, options, arena, matches);
  // So that sums over a node's terms go through memory in order.
  std::stable_sort(matches.terms.begin(), matches.terms.end(),
                   [](const FitTerm& a, const FitTerm& b) { return a.vertex < b.vertex; });
  return matches;
}

// Random vertices and the worst of the iteration before (section 6.2), ascending.
std::vector<int32_t> Matcher::DrawSource(const MatchOptions& options) {
  const double wanted = options.drawn_share * static_cast<double>(source_order_.size());
  const int64_t count =
      std::clamp<int64_t>(std::llround(wanted), 1, static_cast<int64_t>(source_order_.size()));
  const int64_t num_kept =
      std::min<int64_t>(std::llround(options.kept_share * static_cast<double>(count)),
                        static_cast<int64_t>(worst_.size()));
  std::vector<int32_t> samples(worst_.begin(), worst_.begin() + num_kept);
  draws_.push_back({.num_source = static_cast<int32_t>(count - num_kept)});
  DrawToFront(source_order_, count - num_kept, random_);
  samples.insert(samples.end(), source_order_.begin(), source_order_.begin() + (count - num_kept));
  std::sort(samples.begin(), samples.end());
  samples.erase(std::unique(samples.begin(), samples.end()), samples.end());
  return samples;
}

std::vector<int32_t> Matcher::DrawTarget(const MatchOptions& options) {
  const int64_t count = std::min<int64_t>(static_cast<int64_t>(target_order_.size()),
                                          std::llround(options.target_share * options.drawn_share *
                                                       static_cast<double>(source_order_.size())));
  draws_.back().num_target = static_cast<int32_t>(count);
  DrawToFront(target_order_, count, random_);
  std::vector<int32_t> samples(target_order_.begin(), target_order_.begin() + count);
  std::sort(samples.begin(), samples.end());
  return samples;
}

absl::Status Matcher::Resume(const std::vector<SampleDraw>& draws,
                             const std::vector<int32_t>& worst) {
  for (const SampleDraw& draw : draws) {
    if (!IsCount(draw.num_source, source_order_) || !IsCount(draw.num_target, target_order_)) {
      return absl::FailedPreconditionError(absl::StrCat(
          "the state to go on from drew ", draw.num_source, " and ", draw.num_target,
          " samples of ", source_order_.size(), " and ", target_order_.size(), " vertices"));
    }
    DrawToFront(source_order_, draw.num_source, random_);
    DrawToFront(target_order_, draw.num_target, random_);
  }
  for (const int32_t v : worst) {
    if (v < 0 || v >= source_.points.cols() || source_.rigid[v]) {
      return absl::FailedPreconditionError(absl::StrCat(
          "the state to go on from has a sample at vertex ", v, ", where none can be"));
    }
  }
  draws_ = draws;
  worst_ = worst;
  return absl::OkStatus();
}

void Matcher::MatchSource(const DeformedState& state, const std::vector<int32_t>& samples,
                          const MatchOptions& options, const parallel::Arena& arena,
                          Matches& matches) {
  const int64_t count = static_cast<int64_t>(samples.size());
  std::vector<std::optional<FitTerm>> found(count);
  std::vector<float> distance_sq(count, 0.0f);
  arena.For(
      count,
      [&](int64_t s) {
        const int32_t v = samples[s];
        if (!options.match_thin && source_.IsThin(v)) return;
        Eigen::Vector4f p = state.points.col(v);
        const PartMotion* const motion = motions_.Of(v);
        if (motion != nullptr && motion->ends_at_start) {
          found[s] = TermAtStart(source_, v, *motion);
          return;
        }
        if (source_.IsOpen(v) && IsBeforeTarget(source_, v, p)) return;
        Eigen::Vector4f n = DeformedNormal(state.nodes, state.maps, source_, v);
        if (motion != nullptr) {
          const Expected expected =
              ExpectedOn(*motion, source_.points.col(v), source_.mesh.normals.col(v));
          p = expected.point;
          n = expected.normal;
        }
        const bool at_first =
            source_.InFirstSlab(v) || (source_.InPreRoll(v) && motion == nullptr && p[3] < 0);
        const bool at_end = at_first || source_.InLastSlab(v);
        const auto end =
            at_first ? ClosestPointSearch::End::kFirst : ClosestPointSearch::End::kLast;
        const auto match = at_end ? target_search_.FindAtEnd(end, p, n) : target_search_.Find(p, n);
        if (!match || IsOpenMatch(source_, target_, v, match->vertex)) return;
        if (at_end) {
          found[s] = EndTerm(source_, v, p, match->position, match->normal, options);
          if (found[s] && motion != nullptr) HoldAsPoint(source_, p, match->normal, *found[s]);
          return;
        }
        // The distance from the expected point keeps parts of another shape among the worst
        // samples: measured from the present point, falling drops' volumes half-way are 1.2 % off
        // instead of 0.8.
        distance_sq[s] = (match->position - p).squaredNorm();
        const float weight = Closeness(distance_sq[s], options);
        if (!(weight > 0)) return;
        found[s] =
            FitTerm{v, match->position - source_.points.col(v),
                    motion != nullptr
                        ? Eigen::Matrix4f(weight * kMotionWeight * Eigen::Matrix4f::Identity())
                        : MatchMetric(weight, match->normal, options)};
      },
      64);
  AppendFound(found, matches);
  AppendHeld(source_, samples, matches);

  std::vector<int32_t> order = Iota(count);
  std::stable_sort(order.begin(), order.end(),
                   [&](int32_t a, int32_t b) { return distance_sq[a] > distance_sq[b]; });
  worst_.clear();
  for (const int32_t s : order) worst_.push_back(samples[s]);
}

void Matcher::MatchTarget(const DeformedState& state, const DeformedTrees& trees,
                          const std::vector<int32_t>& samples, const MatchOptions& options,
                          const parallel::Arena& arena, Matches& matches) const {
  const Points& deformed = state.points;
  const int64_t count = static_cast<int64_t>(samples.size());
  std::vector<std::optional<FitTerm>> found(count);
  arena.For(
      count,
      [&](int64_t s) {
        const int32_t t = samples[s];
        if (!options.match_thin && target_.IsThin(t)) return;
        const bool at_end = target_.InFirstSlab(t) || target_.InLastSlab(t);
        const PointTree& near = target_.InFirstSlab(t)  ? trees.first
                                : target_.InLastSlab(t) ? trees.last
                                                        : trees.inner;
        const Eigen::Vector4f c = target_.points.col(t), n = target_.mesh.normals.col(t);
        Eigen::Vector4f query = c;
        if (at_end) query[3] = 0;
        int32_t best = near.NearestIf(query, [&](int32_t v) {
          return DeformedNormal(state.nodes, state.maps, source_, v).dot(n) >
                 ClosestPointSearch::kMinCosine;
        });
        if (best < 0 || (at_end && source_.IsOpen(best))) return;
        if (at_end) {
          found[s] = EndTerm(source_, best, deformed.col(best), c, n, options);
          return;
        }
        for (const int32_t w : source_neighbors_[best]) {  // the tree holds only some vertices
          if ((deformed.col(w) - c).squaredNorm() < (deformed.col(best) - c).squaredNorm() &&
              DeformedNormal(state.nodes, state.maps, source_, w).dot(n) >
                  ClosestPointSearch::kMinCosine &&
              !source_.InFirstSlab(w) && !source_.InLastSlab(w)) {
            best = w;
          }
        }
        const Eigen::Vector4f offset = c - deformed.col(best);
        const float weight = Closeness(offset.squaredNorm(), options);
        if (!(weight > 0)) return;
        const Eigen::Vector4f along = n.dot(offset) * n;
        const bool near_foot = (offset - along).norm() <= kMaxTangentOffset;
        if (!near_foot && source_.IsOpen(best)) return;
        const Eigen::Vector4f goal =
            deformed.col(best) + (near_foot ? along : offset) - source_.points.col(best);
        const Eigen::Matrix4f metric =
            near_foot ? MatchMetric(weight, n, options)
                      : Eigen::Matrix4f(weight * kMissedPointWeight * Eigen::Matrix4f::Identity());
        found[s] = FitTerm{best, goal, metric};
      },
      64);
  AppendFound(found, matches);
}

}  // namespace liquidblend::registration
