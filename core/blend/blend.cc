#include "core/blend/blend.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <cstring>
#include <limits>

#include "absl/strings/str_cat.h"
#include "core/base/prefetch.h"

namespace liquidblend::blend {
namespace {

using mesh::Float4;

// Four numbers in one register of any machine. Fused multiply-add is not used, even if a machine
// has it, so that all machines give the same bytes.
using Vector = float __attribute__((vector_size(16)));

Vector Load(const Float4& from) {
  Vector v;
  std::memcpy(&v, from.data(), sizeof(v));
  return v;
}

// Maximum and minimum per number, as std::max and std::min: where a comparison fails for NaN, the
// first one counts.
Vector Max(Vector a, Vector b) { return a < b ? b : a; }
Vector Min(Vector a, Vector b) { return b < a ? b : a; }

}  // namespace

absl::Status CheckWeights(const mesh::RegisteredFamily& family, std::span<const double> weights) {
  if (weights.size() != family.targets.size()) {
    return absl::InvalidArgumentError(
        absl::StrCat("family ", family.name, " has ", family.targets.size(),
                     " targets and needs as many weights, got ", weights.size()));
  }
  for (size_t k = 0; k < weights.size(); ++k) {
    if (!(weights[k] >= kMinWeight && weights[k] <= kMaxWeight)) {  // NaN too
      return absl::InvalidArgumentError(absl::StrCat("weights[", k, "] (", family.targets[k].name,
                                                     ") is ", weights[k], ", not in [", kMinWeight,
                                                     ", ", kMaxWeight, "]"));
    }
  }
  return absl::OkStatus();
}

Blender::Blender(const mesh::RegisteredFamily& family, std::span<const double> weights)
    : family_(&family), num_vertices_(static_cast<int64_t>(family.vertices.size())) {
  assert(CheckWeights(family, weights).ok());
  const auto add = [this](float factor, std::span<const Float4> field) {
    if (factor != 0.0F) terms_.push_back({factor, field.data()});
  };
  for (size_t k = 0; k < weights.size(); ++k) {
    const mesh::TargetMotion motion = mesh::MotionAt(family.targets[k], weights[k]);
    add(motion.displacement_factor, family.targets[k].displacement);
    add(motion.extrapolation_factor, family.targets[k].extrapolation);
  }
  // Times just outside of [0, num_frames - 1].
  before_ = -std::numeric_limits<float>::min();
  after_ = std::nextafter(static_cast<float>(family.num_frames - 1),
                          std::numeric_limits<float>::infinity());
}

void Blender::Place(std::span<const int32_t> vertices, Float4* positions) const {
  constexpr float kMost = std::numeric_limits<float>::max();
  const auto& low = family_->domain_min;
  const auto& high = family_->domain_max;
  const Vector min = {low[0], low[1], low[2], -kMost};
  const Vector max = {high[0], high[1], high[2], kMost};
  const int64_t first_end = family_->num_first_vertices;
  const int64_t last_begin = num_vertices_ - family_->num_last_vertices;
  const Float4* const sources = family_->vertices.data();
  const std::span<const Term> terms = terms_;
  for (size_t i = 0; i < vertices.size(); ++i) {
    const int32_t v = vertices[i];
    const Vector source = Load(sources[v]);
    Vector sum = source;
    for (const Term& term : terms) sum += term.factor * Load(term.field[v]);
    // Clamps to the domain, widened to the source's own place. Sums that overflowed become finite
    // again.
    const Vector placed = Min(Max(max, source), Max(Min(min, source), sum));
    std::memcpy(&positions[i], &placed, sizeof(placed));
    if (v < first_end) positions[i][3] = std::min(positions[i][3], before_);
    if (v >= last_begin) positions[i][3] = std::max(positions[i][3], after_);
  }
}

void Blender::Prefetch(std::span<const int32_t> vertices) const {
  for (const int32_t v : vertices) {
    base::PrefetchIntoL2(&family_->vertices[v]);
    for (const Term& term : terms_) base::PrefetchIntoL2(&term.field[v]);
  }
}

}  // namespace liquidblend::blend
