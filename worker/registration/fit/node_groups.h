// Groups of neighbouring nodes that move by one map. Internal to worker/registration.
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

// Starts from the connected parts of the graph that have held nodes and at least `fewest` nodes,
// the largest `count` of them; then halves the largest group along the longest side of its box
// until there are `count`. A group never spans two parts, as it would move weakly held nodes along.
// There are fewer groups if there are too few nodes.
//   is_held  per node: whether a term constrains it
NodeGroups GroupNodes(const DeformationNodes& nodes, const NodeGraph& graph,
                      const std::vector<char>& is_held, int count, int64_t fewest);

}  // namespace liquidblend::registration
