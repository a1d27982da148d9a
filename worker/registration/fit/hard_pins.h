// Hard correspondences as equality constraints on the displacement of their vertices (paper,
// section 6). Internal to worker/registration.
#pragma once

#include <Eigen/Core>
#include <span>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "worker/registration/fit/deformation.h"
#include "worker/registration/fit/pins.h"

namespace liquidblend::registration {

// The constraints C x = d on the nodes' maps x: four rows per pin, one per component of u(v) =
// goal; the row of a free component is zero.  Threads: safe.
class HardPins {
 public:
  // Coefficients of one node's map in the displacement of a pin's vertex.
  struct Entry {
    int32_t node;
    Eigen::Matrix<float, 5, 1> coefficients;
  };

  HardPins() = default;  // no constraints
  // Takes the hard pins; of several at one vertex the first.
  // Requires: a node sits at each pin's vertex; CheckContradictions(pins).ok().
  HardPins(const DeformationNodes& nodes, const Points& rest, const std::vector<Pin>& pins);

  bool empty() const { return pins_.empty(); }
  int64_t num_pins() const { return static_cast<int64_t>(pins_.size()); }
  const Pin& pin(int64_t p) const { return pins_[p]; }
  std::span<const Entry> entries(int64_t p) const {
    return {entries_.data() + begin_[p], static_cast<size_t>(begin_[p + 1] - begin_[p])};
  }
  // 1 for constrained components, 0 for free ones.
  Eigen::Vector4d Mask(int64_t p) const;

  // C x.
  Eigen::VectorXd Apply(const std::vector<NodeMap>& x) const;
  // d - C x.
  Eigen::VectorXd Miss(const std::vector<NodeMap>& x) const;
  // x += factor C^T lambda.
  void AddTransposed(const Eigen::VectorXd& lambda, double factor, std::vector<NodeMap>& x) const;

  // Moves the pinned vertices of a displacement back to their goals, and their surroundings
  // smoothly with them, as far as the pins' nodes reach.
  // Errors: kInternal if the nodes cannot move the pins independently.
  absl::Status Restore(const DeformationNodes& nodes, const parallel::Arena& arena,
                       Points& displacement) const;

 private:
  std::vector<Pin> pins_;  // one per vertex
  std::vector<int64_t> begin_ = {0};
  std::vector<Entry> entries_;
};

// Checks that hard pins agree.  Errors: kInvalidArgument naming two hard correspondences at the
// same place, or less than an edge apart, with goals that differ by more than the surface between
// them can stretch.
//   points  of the source
absl::Status CheckContradictions(const std::vector<Pin>& pins, const Points& points,
                                 double edge_length_m);

}  // namespace liquidblend::registration
