// Nodes next to one another, as if each group of them moved by one map. Internal to
// worker/registration.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "worker/registration/deformation.h"

namespace liquidblend::registration {

struct NodeGroups {
  std::vector<int32_t> of_node;
  std::vector<std::vector<int32_t>> nodes;  // per group, ascending
  Eigen::Matrix4Xf offset;                  // per node: from its group's centre

  int64_t size() const { return static_cast<int64_t>(nodes.size()); }
};

// Halves the nodes along the longest side of the box around them, and the halves likewise, until
// there are `count` groups.  Requires: count is a power of 2 and at most the number of nodes.
NodeGroups GroupNodes(const DeformationNodes& nodes, int count);

}  // namespace liquidblend::registration
