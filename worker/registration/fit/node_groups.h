// Nodes next to one another, as if each group of them moved by one map. Internal to
// worker/registration.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "worker/registration/fit/deformation.h"
#include "worker/registration/fit/energy.h"

namespace liquidblend::registration {

struct NodeGroups {
  std::vector<int32_t> of_node;             // -1: in none
  std::vector<std::vector<int32_t>> nodes;  // per group, ascending
  Eigen::Matrix4Xf offset;                  // per node: from its group's centre

  int64_t size() const { return static_cast<int64_t>(nodes.size()); }
};

// The parts of the graph, as far as something holds them and they have at least `fewest` nodes, the
// largest `count` of them; then the largest group is halved along the longest side of the box
// around it, until there are `count`. A group never reaches from one part to another: it would take
// along what is held by hardly anything. Fewer groups if there are not so many nodes.
//   is_held  per node: whether a term asks for something there
NodeGroups GroupNodes(const DeformationNodes& nodes, const NodeGraph& graph,
                      const std::vector<char>& is_held, int count, int64_t fewest);

}  // namespace liquidblend::registration
