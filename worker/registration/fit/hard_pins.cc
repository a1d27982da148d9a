#include "worker/registration/fit/hard_pins.h"

#include <Eigen/SparseCholesky>
#include <Eigen/SparseCore>
#include <algorithm>
#include <set>
#include <string>

#include "absl/strings/str_cat.h"
#include "core/base/status_macros.h"

namespace liquidblend::registration {
namespace {

constexpr float kSamePlace = 1.0f;       // edges; nearer pins must go nearly the same way
constexpr float kMaxStretch = 2.0f;      // between those: difference of goals per distance
constexpr float kSameGoal = 1e-3f;       // edges
constexpr double kSpreadDamping = 1e-9;  // relative; keeps the spreading's system definite

// Distance of two pins' goals in the components that both constrain.
float GoalDifference(const Pin& a, const Pin& b) {
  const Eigen::Vector4f difference = a.goal - b.goal;
  return a.in_time && b.in_time ? difference.norm() : difference.head<3>().norm();
}

std::string PlaceOf(const Pin& pin, const Points& points, double edge_length_m) {
  const Eigen::Vector4f p = points.col(pin.vertex);
  const Eigen::Vector3d place = edge_length_m * p.head<3>().cast<double>();
  return absl::StrCat("(", place[0], ", ", place[1], ", ", place[2], ") m, frame ", p[3]);
}

// The nodes at the pins, by pin.
std::vector<int32_t> PinsOfNodes(const DeformationNodes& nodes, const std::vector<Pin>& pins) {
  std::vector<int32_t> pin_of_node(nodes.num_nodes(), -1);
  for (int32_t p = 0; p < static_cast<int32_t>(pins.size()); ++p) {
    for (const Influence& influence : nodes.influences(pins[p].vertex)) {
      if (nodes.vertex(influence.node) == pins[p].vertex) pin_of_node[influence.node] = p;
    }
  }
  return pin_of_node;
}

// Some components of the pins that hold all of them.
struct Components {
  int first, count;
  std::vector<int64_t> pins;
};

// The smallest moves (b alone) of the pins' nodes that bring the pins to their goals, into the
// components' columns of `moves`, which has a row per pin.
absl::Status SolveForMoves(const std::vector<Pin>& pins, const Components& components,
                           const DeformationNodes& nodes, const std::vector<int32_t>& pin_of_node,
                           const Points& displacement, Eigen::MatrixXf& moves) {
  const int64_t num_rows = static_cast<int64_t>(components.pins.size());
  if (num_rows == 0) return absl::OkStatus();
  std::vector<int64_t> row_of_pin(pins.size(), -1);
  for (int64_t row = 0; row < num_rows; ++row) row_of_pin[components.pins[row]] = row;
  Eigen::MatrixXd miss(num_rows, components.count);
  std::vector<Eigen::Triplet<double>> triplets;
  for (int64_t row = 0; row < num_rows; ++row) {
    const Pin& pin = pins[components.pins[row]];
    const Eigen::Vector4f whole = pin.goal - displacement.col(pin.vertex);
    miss.row(row) = whole.segment(components.first, components.count).cast<double>().transpose();
    for (const Influence& influence : nodes.influences(pin.vertex)) {
      const int32_t p = pin_of_node[influence.node];
      if (p >= 0 && row_of_pin[p] >= 0) {
        triplets.emplace_back(row, row_of_pin[p], influence.weight);
      }
    }
  }
  Eigen::SparseMatrix<double> weights(num_rows, num_rows);
  weights.setFromTriplets(triplets.begin(), triplets.end());
  Eigen::SparseMatrix<double> gram = weights * Eigen::SparseMatrix<double>(weights.transpose());
  for (Eigen::Index row = 0; row < num_rows; ++row) gram.coeffRef(row, row) *= 1 + kSpreadDamping;
  const Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>> factor(gram);
  if (factor.info() != Eigen::Success) {
    return absl::InternalError("hard correspondences are too close to one another to be held");
  }
  const Eigen::MatrixXd multipliers = factor.solve(miss);
  const Eigen::MatrixXd solved = weights.transpose() * multipliers;
  for (int64_t row = 0; row < num_rows; ++row) {
    moves.row(components.pins[row]).segment(components.first, components.count) =
        solved.row(row).cast<float>();
  }
  return absl::OkStatus();
}

}  // namespace

HardPins::HardPins(const DeformationNodes& nodes, const Points& rest,
                   const std::vector<Pin>& pins) {
  for (const Pin& pin : pins) {
    if (!pin.hard) continue;
    const auto same = std::find_if(pins_.begin(), pins_.end(),
                                   [&](const Pin& held) { return held.vertex == pin.vertex; });
    if (same == pins_.end()) {
      pins_.push_back(pin);
    } else if (pin.in_time && !same->in_time) {
      *same = pin;  // holds more
    }
  }
  for (const Pin& pin : pins_) {
    for (const Influence& influence : nodes.influences(pin.vertex)) {
      Entry entry{influence.node, {}};
      entry.coefficients << rest.col(pin.vertex) - nodes.position(influence.node), 1.0f;
      entry.coefficients *= influence.weight;
      entries_.push_back(entry);
    }
    begin_.push_back(static_cast<int64_t>(entries_.size()));
  }
}

Eigen::Vector4d HardPins::Mask(int64_t p) const {
  return {1.0, 1.0, 1.0, pins_[p].in_time ? 1.0 : 0.0};
}

Eigen::VectorXd HardPins::Apply(const std::vector<NodeMap>& x) const {
  Eigen::VectorXd result = Eigen::VectorXd::Zero(4 * num_pins());
  for (int64_t p = 0; p < num_pins(); ++p) {
    Eigen::Vector4d sum = Eigen::Vector4d::Zero();
    for (const Entry& entry : entries(p)) {
      sum += x[entry.node].cast<double>() * entry.coefficients.cast<double>();
    }
    result.segment<4>(4 * p) = sum.cwiseProduct(Mask(p));
  }
  return result;
}

Eigen::VectorXd HardPins::Miss(const std::vector<NodeMap>& x) const {
  Eigen::VectorXd miss = -Apply(x);
  for (int64_t p = 0; p < num_pins(); ++p) {
    miss.segment<4>(4 * p) += pins_[p].goal.cast<double>().cwiseProduct(Mask(p));
  }
  return miss;
}

void HardPins::AddTransposed(const Eigen::VectorXd& lambda, double factor,
                             std::vector<NodeMap>& x) const {
  for (int64_t p = 0; p < num_pins(); ++p) {
    const Eigen::Vector4d l = factor * lambda.segment<4>(4 * p).cwiseProduct(Mask(p));
    for (const Entry& entry : entries(p)) {
      x[entry.node] += (l * entry.coefficients.cast<double>().transpose()).cast<float>();
    }
  }
}

absl::Status HardPins::Restore(const DeformationNodes& nodes, const parallel::Arena& arena,
                               Points& displacement) const {
  if (empty()) return absl::OkStatus();
  const std::vector<int32_t> pin_of_node = PinsOfNodes(nodes, pins_);
  Components space{0, 3, {}}, time{3, 1, {}};  // apart, because not every pin holds both
  for (int64_t p = 0; p < num_pins(); ++p) {
    space.pins.push_back(p);
    if (pins_[p].in_time) time.pins.push_back(p);
  }
  Eigen::MatrixXf moves = Eigen::MatrixXf::Zero(num_pins(), 4);
  for (const Components* components : {&space, &time}) {
    LB_RETURN_IF_ERROR(SolveForMoves(pins_, *components, nodes, pin_of_node, displacement, moves));
  }
  arena.For(displacement.cols(), [&](int64_t v) {
    for (const Influence& influence : nodes.influences(v)) {
      const int32_t p = pin_of_node[influence.node];
      if (p >= 0) displacement.col(v) += influence.weight * moves.row(p).transpose();
    }
  });
  for (const Pin& pin : pins_) {  // but for rounding there already
    const int count = pin.in_time ? 4 : 3;
    displacement.col(pin.vertex).head(count) = pin.goal.head(count);
  }
  return absl::OkStatus();
}

absl::Status CheckContradictions(const std::vector<Pin>& pins, const Points& points,
                                 double edge_length_m) {
  for (size_t a = 0; a < pins.size(); ++a) {
    if (!pins[a].hard) continue;
    for (size_t b = a + 1; b < pins.size(); ++b) {
      if (!pins[b].hard) continue;
      const float distance = (points.col(pins[a].vertex) - points.col(pins[b].vertex)).norm();
      if (!(distance < kSamePlace)) continue;
      const float difference = GoalDifference(pins[a], pins[b]);
      if (difference <= kSameGoal + kMaxStretch * distance) continue;
      return absl::InvalidArgumentError(absl::StrCat(
          "correspondences ", pins[a].correspondence, " and ", pins[b].correspondence,
          " are both hard and contradict each other at ", PlaceOf(pins[a], points, edge_length_m),
          ": ", distance, " mean edges apart, their goals differ by ", difference,
          "; drop one of them or make it soft"));
    }
  }
  return absl::OkStatus();
}

}  // namespace liquidblend::registration
