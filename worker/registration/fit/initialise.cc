#include "worker/registration/fit/initialise.h"

#include <algorithm>

namespace liquidblend::registration {
namespace {

// Initial state of the heat equation: a move per node, and its fixed components.
struct Heat {
  Points move;                           // a column per node
  std::vector<Eigen::Vector4f> is_free;  // 1 or 0 per component
};

Heat InitialHeat(const DeformationNodes& nodes, const Surface& source, const std::vector<Pin>& pins,
                 const std::vector<NodeMap>& maps) {
  Heat heat{Points::Zero(4, nodes.num_nodes()),
            std::vector<Eigen::Vector4f>(nodes.num_nodes(), Eigen::Vector4f::Ones())};
  std::vector<int32_t> vertices(nodes.num_nodes());
  for (int64_t n = 0; n < nodes.num_nodes(); ++n) {
    vertices[n] = nodes.vertex(n);
    const bool is_held = source.InFirstSlab(vertices[n]) && !source.InPreRoll(vertices[n]);
    if (is_held || source.InLastSlab(vertices[n])) heat.is_free[n][3] = 0;
  }
  const auto fix = [&](const Pin& pin) {
    const auto found = std::lower_bound(vertices.begin(), vertices.end(), pin.vertex);
    const int64_t n = found - vertices.begin();
    const Eigen::Vector4f miss = pin.goal - DisplacementOf(nodes, maps, source.points, pin.vertex);
    const int count = pin.in_time ? 4 : 3;
    heat.move.col(n).head(count) = miss.head(count);
    heat.is_free[n].head(count).setZero();
  };
  for (const bool hard : {false, true}) {  // where both are, the hard one is obeyed
    for (const Pin& pin : pins) {
      if (pin.hard == hard) fix(pin);
    }
  }
  return heat;
}

}  // namespace

void DiffusePins(const DeformationNodes& nodes, const NodeGraph& graph, const Surface& source,
                 const std::vector<Pin>& pins, int passes, const parallel::Arena& arena,
                 std::vector<NodeMap>& maps) {
  if (pins.empty()) return;
  Heat heat = InitialHeat(nodes, source, pins, maps);
  Points next = heat.move;
  for (int pass = 0; pass < passes; ++pass) {
    arena.For(
        nodes.num_nodes(),
        [&](int64_t n) {
          if (graph.leaving()[n].empty()) return;
          Eigen::Vector4f mean = Eigen::Vector4f::Zero();  // the weights add up to 1
          for (const int32_t e : graph.leaving()[n]) {
            mean += graph.edges()[e].weight * heat.move.col(graph.edges()[e].to);
          }
          next.col(n) = heat.move.col(n) + heat.is_free[n].cwiseProduct(mean - heat.move.col(n));
        },
        64);
    heat.move.swap(next);
  }
  for (int64_t n = 0; n < nodes.num_nodes(); ++n) maps[n].col(4) += heat.move.col(n);
}

}  // namespace liquidblend::registration
