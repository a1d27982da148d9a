#include "worker/registration/node_groups.h"

#include <algorithm>
#include <numeric>
#include <utility>

namespace liquidblend::registration {
namespace {

using Indices = std::vector<int32_t>;

std::pair<Indices, Indices> Halve(const DeformationNodes& nodes, Indices all) {
  Eigen::Vector4f low = nodes.position(all[0]), high = low;
  for (const int32_t n : all) {
    low = low.cwiseMin(nodes.position(n));
    high = high.cwiseMax(nodes.position(n));
  }
  Eigen::Index axis = 0;
  (high - low).maxCoeff(&axis);
  const auto middle = all.begin() + static_cast<std::ptrdiff_t>(all.size() / 2);
  std::nth_element(all.begin(), middle, all.end(), [&](int32_t a, int32_t b) {
    return std::pair(nodes.position(a)[axis], a) < std::pair(nodes.position(b)[axis], b);
  });
  return {Indices(all.begin(), middle), Indices(middle, all.end())};
}

}  // namespace

NodeGroups GroupNodes(const DeformationNodes& nodes, int count) {
  NodeGroups groups;
  Indices all(nodes.num_nodes());
  std::iota(all.begin(), all.end(), 0);
  groups.nodes.push_back(std::move(all));
  while (groups.size() < count) {
    std::vector<Indices> halves;
    for (Indices& group : groups.nodes) {
      auto [low, high] = Halve(nodes, std::move(group));
      halves.push_back(std::move(low));
      halves.push_back(std::move(high));
    }
    groups.nodes = std::move(halves);
  }
  groups.of_node.resize(nodes.num_nodes());
  groups.offset.resize(4, nodes.num_nodes());
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
  return groups;
}

}  // namespace liquidblend::registration
