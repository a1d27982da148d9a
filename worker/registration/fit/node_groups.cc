#include "worker/registration/fit/node_groups.h"

#include <algorithm>
#include <numeric>
#include <utility>

namespace liquidblend::registration {
namespace {

using Indices = std::vector<int32_t>;

// Connected parts of the graph, by the lowest node.
std::vector<Indices> Parts(const NodeGraph& graph, int64_t num_nodes) {
  std::vector<int32_t> root(num_nodes);
  std::iota(root.begin(), root.end(), 0);
  const auto find = [&](int32_t n) {
    while (root[n] != n) n = root[n] = root[root[n]];
    return n;
  };
  for (const NodeGraph::Edge& edge : graph.edges()) {
    const auto [low, high] = std::minmax({find(edge.from), find(edge.to)});
    root[high] = low;
  }
  std::vector<Indices> parts(num_nodes);
  for (int32_t n = 0; n < num_nodes; ++n) parts[find(n)].push_back(n);
  std::erase_if(parts, [](const Indices& part) { return part.empty(); });
  return parts;
}

bool IsLess(const Indices& a, const Indices& b) { return a.size() < b.size(); }

// Leaves the lower half and returns the upper one.
Indices Halve(const DeformationNodes& nodes, Indices& group) {
  Eigen::Vector4f low = nodes.position(group[0]), high = low;
  for (const int32_t n : group) {
    low = low.cwiseMin(nodes.position(n));
    high = high.cwiseMax(nodes.position(n));
  }
  Eigen::Index axis = 0;
  (high - low).maxCoeff(&axis);
  const auto middle = group.begin() + static_cast<std::ptrdiff_t>(group.size() / 2);
  std::nth_element(group.begin(), middle, group.end(), [&](int32_t a, int32_t b) {
    return std::pair(nodes.position(a)[axis], a) < std::pair(nodes.position(b)[axis], b);
  });
  Indices upper(middle, group.end());
  group.erase(middle, group.end());
  return upper;
}

void Number(const DeformationNodes& nodes, NodeGroups& groups) {
  groups.of_node.assign(nodes.num_nodes(), -1);
  groups.offset.setZero(4, nodes.num_nodes());
  for (int64_t c = 0; c < groups.size(); ++c) {
    Indices& members = groups.nodes[c];
    std::sort(members.begin(), members.end());
    Eigen::Vector4d sum = Eigen::Vector4d::Zero();
    for (const int32_t n : members) sum += nodes.position(n).cast<double>();
    const Eigen::Vector4f centre = (sum / static_cast<double>(members.size())).cast<float>();
    for (const int32_t n : members) {
      groups.of_node[n] = static_cast<int32_t>(c);
      groups.offset.col(n) = nodes.position(n) - centre;
    }
  }
}

}  // namespace

NodeGroups GroupNodes(const DeformationNodes& nodes, const NodeGraph& graph,
                      const std::vector<char>& is_held, int count, int64_t fewest) {
  NodeGroups groups;
  groups.nodes = Parts(graph, nodes.num_nodes());
  std::erase_if(groups.nodes, [&](const Indices& part) {
    return static_cast<int64_t>(part.size()) < fewest ||
           std::none_of(part.begin(), part.end(), [&](int32_t n) { return is_held[n] != 0; });
  });
  std::stable_sort(groups.nodes.begin(), groups.nodes.end(),
                   [](const Indices& a, const Indices& b) { return IsLess(b, a); });
  if (groups.size() > count) groups.nodes.resize(count);
  while (!groups.nodes.empty() && groups.size() < count) {
    Indices& largest = *std::max_element(groups.nodes.begin(), groups.nodes.end(), IsLess);
    if (static_cast<int64_t>(largest.size()) < 2 * fewest) break;
    Indices upper = Halve(nodes, largest);
    groups.nodes.push_back(std::move(upper));
  }
  Number(nodes, groups);
  return groups;
}

}  // namespace liquidblend::registration
