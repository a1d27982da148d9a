#include "worker/registration/fit/deformation.h"

#include <algorithm>
#include <numeric>
#include <utility>

namespace liquidblend::registration {
namespace {

constexpr size_t kPlacedAtOnce = 4;  // nodes; each search keeps a number per vertex

uint16_t Quantize(float weight) { return static_cast<uint16_t>(weight * Influences::kOne + 0.5F); }

}  // namespace

DeformationNodes::DeformationNodes(const Points& rest, const PackedLists& neighbors, double spacing,
                                   std::span<const int32_t> first, uint64_t seed,
                                   const parallel::Arena& arena, std::vector<char> excluded) {
  PlaceNodes(rest, neighbors, static_cast<float>(spacing), first, std::move(excluded), seed, arena);
  ComputeInfluences(rest, neighbors, static_cast<float>(2 * spacing), arena);
}

void DeformationNodes::PlaceNodes(const Points& rest, const PackedLists& neighbors, float spacing,
                                  std::span<const int32_t> first, std::vector<char> covered,
                                  uint64_t seed, const parallel::Arena& arena) {
  std::vector<int32_t> order(rest.cols());
  std::iota(order.begin(), order.end(), 0);
  Random random(seed);
  for (int64_t n = rest.cols() - 1; n > 0; --n) std::swap(order[n], order[random.Below(n + 1)]);

  covered.resize(rest.cols(), 0);
  std::vector<GeodesicSearch> searches(kPlacedAtOnce, GeodesicSearch(rest, neighbors));
  const auto place = [&](int32_t v, const std::vector<GeodesicSearch::Reached>& around) {
    vertex_.push_back(v);
    for (const auto& reached : around) covered[reached.vertex] = 1;
  };
  for (const int32_t v : first) {
    if (std::find(vertex_.begin(), vertex_.end(), v) == vertex_.end()) {
      place(v, searches[0].From(v, spacing));
    }
  }
  // Several are looked at side by side, and those dropped that one before them has covered: it is
  // seldom that one does. So the nodes are those of a walk one by one.
  for (auto next = order.cbegin(); next != order.cend();) {
    std::vector<int32_t> open;
    for (; next != order.cend() && open.size() < searches.size(); ++next) {
      if (!covered[*next]) open.push_back(*next);
    }
    std::vector<const std::vector<GeodesicSearch::Reached>*> around(open.size());
    arena.Run(static_cast<int64_t>(open.size()),
              [&](int64_t n) { around[n] = &searches[n].From(open[n], spacing); });
    for (size_t n = 0; n < open.size(); ++n) {
      if (!covered[open[n]]) place(open[n], *around[n]);
    }
  }
  std::sort(vertex_.begin(), vertex_.end());
  position_.resize(4, num_nodes());
  for (int64_t n = 0; n < num_nodes(); ++n) position_.col(n) = rest.col(vertex_[n]);
}

void DeformationNodes::ComputeInfluences(const Points& rest, const PackedLists& neighbors,
                                         float radius, const parallel::Arena& arena) {
  constexpr int64_t kNodesPerTask = 64;
  const int64_t num_tasks = (num_nodes() + kNodesPerTask - 1) / kNodesPerTask;
  std::vector<std::vector<GeodesicSearch::Reached>> reached_in(num_tasks);
  std::vector<int64_t> num_reached(num_nodes());
  arena.ForChunks(num_nodes(), kNodesPerTask, [&](int64_t task, int64_t begin, int64_t end) {
    GeodesicSearch search(rest, neighbors);
    for (int64_t n = begin; n < end; ++n) {
      const auto& reached = search.From(vertex_[n], radius);
      num_reached[n] = static_cast<int64_t>(reached.size());
      reached_in[task].insert(reached_in[task].end(), reached.begin(), reached.end());
    }
    reached_in[task].shrink_to_fit();
  });
  begin_.assign(rest.cols() + 1, 0);
  for (const auto& list : reached_in) {
    for (const auto& reached : list) ++begin_[reached.vertex + 1];
  }
  std::partial_sum(begin_.begin(), begin_.end(), begin_.begin());
  influences_ = std::make_unique_for_overwrite<Influences::Packed[]>(begin_.back());
  if (num_nodes() > 1 << 16) {
    high_nodes_ = std::make_unique_for_overwrite<uint16_t[]>(begin_.back());
  }
  std::vector<int64_t> next(begin_.begin(), begin_.end() - 1);
  for (int64_t task = 0, n = 0; task < num_tasks; ++task) {
    auto reached = reached_in[task].cbegin();
    for (; reached != reached_in[task].cend(); ++n) {
      for (const auto last = reached + num_reached[n]; reached != last; ++reached) {
        const float q = reached->distance / radius, fall = 1 - q * q;
        const int64_t k = next[reached->vertex]++;
        // At least the least there is: a vertex may have no other.
        const uint16_t weight = std::max<uint16_t>(1, Quantize(fall * fall * fall));
        influences_[k] = {static_cast<uint16_t>(n & 0xFFFF), weight};
        if (high_nodes_ != nullptr) high_nodes_[k] = static_cast<uint16_t>(n >> 16);
      }
    }
    std::vector<GeodesicSearch::Reached>().swap(
        reached_in[task]);  // pages of the influences are touched about as fast as these go
  }
  arena.For(rest.cols(), [&](int64_t v) { Normalize(begin_[v], begin_[v + 1]); });
}

// Makes the weights add up to one exactly: what rounding leaves goes to the largest.
void DeformationNodes::Normalize(int64_t begin, int64_t end) {
  if (begin == end) return;
  const std::span<Influences::Packed> influences(&influences_[begin], end - begin);
  float sum = 0;
  for (const auto& influence : influences) sum += static_cast<float>(influence.weight);
  int rest = Influences::kOne;
  for (auto& influence : influences) {
    influence.weight = Quantize(static_cast<float>(influence.weight) / sum);
    rest -= influence.weight;
  }
  auto& largest =
      *std::max_element(influences.begin(), influences.end(),
                        [](const auto& a, const auto& b) { return a.weight < b.weight; });
  largest.weight = static_cast<uint16_t>(largest.weight + rest);
}

Eigen::Vector4f DisplacementOf(const DeformationNodes& nodes, const std::vector<NodeMap>& maps,
                               const Points& rest, int64_t v) {
  Eigen::Vector4f sum = Eigen::Vector4f::Zero();
  for (const Influence& influence : nodes.influences(v)) {
    const NodeMap& map = maps[influence.node];
    const Eigen::Vector4f offset =
        influence.weight * (rest.col(v) - nodes.position(influence.node));
    for (int a = 0; a < 4; ++a) sum += offset[a] * map.col(a);
    sum += influence.weight * map.col(4);
  }
  return sum;
}

Points Deform(const DeformationNodes& nodes, const std::vector<NodeMap>& maps, const Points& rest,
              const parallel::Arena& arena) {
  Points deformed(4, rest.cols());
  arena.For(rest.cols(), [&](int64_t v) {
    deformed.col(v) = rest.col(v) + DisplacementOf(nodes, maps, rest, v);
  });
  return deformed;
}

}  // namespace liquidblend::registration
