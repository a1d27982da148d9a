#include "server/blend/blend.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>

#include "absl/strings/str_cat.h"

namespace liquidblend::blend {
namespace {

using mesh::Float4;

constexpr int kBatch = 256;  // vertices moved at a time, so that the sum stays in the first cache

// out += factor * field, as flat arrays that the compiler turns into vector code.
void AddScaled(float factor, const Float4* field, int count, Float4* out) {
  if (factor == 0.0F) return;
  const float* in = field->data();
  float* sum = out->data();
  for (int i = 0; i < 4 * count; ++i) sum[i] += factor * in[i];
}

// The domain, widened to the source's own place of each vertex. Whatever overflowed on the way
// comes back to finite numbers (std::max(low, NaN) is low).
void ClampToDomain(const mesh::RegisteredFamily& family, const Float4* source, int count,
                   Float4* out) {
  constexpr float kMost = std::numeric_limits<float>::max();
  const auto& low = family.domain_min;
  const auto& high = family.domain_max;
  const Float4 min = {low[0], low[1], low[2], -kMost};
  const Float4 max = {high[0], high[1], high[2], kMost};
  for (int v = 0; v < count; ++v) {
    for (int k = 0; k < 4; ++k) {
      const float lowest = std::min(min[k], source[v][k]);
      const float highest = std::max(max[k], source[v][k]);
      out[v][k] = std::min(highest, std::max(lowest, out[v][k]));
    }
  }
}

// Keeps the end slabs on their sides of [0, num_frames - 1], by the least that a float can express.
void ClampEndSlabs(const mesh::RegisteredFamily& family, mesh::VertexRange range, Float4* out) {
  const float last_frame = static_cast<float>(family.num_frames - 1);
  const float before = -std::numeric_limits<float>::min();
  const float after = std::nextafter(last_frame, std::numeric_limits<float>::infinity());
  const int64_t first_end = std::min<int64_t>(range[1], family.num_first_vertices);
  for (int64_t v = range[0]; v < first_end; ++v) {
    out[v - range[0]][3] = std::min(out[v - range[0]][3], before);
  }
  const auto num_vertices = static_cast<int64_t>(family.vertices.size());
  const int64_t last_begin = std::max<int64_t>(range[0], num_vertices - family.num_last_vertices);
  for (int64_t v = last_begin; v < range[1]; ++v) {
    out[v - range[0]][3] = std::max(out[v - range[0]][3], after);
  }
}

void BlendBatch(const mesh::RegisteredFamily& family, std::span<const double> weights,
                mesh::VertexRange range, Float4* out) {
  const int count = range[1] - range[0];
  const Float4* source = &family.vertices[range[0]];
  std::copy_n(source, count, out);
  for (size_t k = 0; k < weights.size(); ++k) {
    if (weights[k] == 0.0) continue;
    const mesh::FamilyTarget& target = family.targets[k];
    const mesh::TargetMotion motion = mesh::MotionAt(target, weights[k]);
    AddScaled(motion.displacement_factor, &target.displacement[range[0]], count, out);
    if (motion.extrapolation_factor != 0.0F) {
      AddScaled(motion.extrapolation_factor, &target.extrapolation[range[0]], count, out);
    }
  }
  ClampToDomain(family, source, count, out);
  ClampEndSlabs(family, range, out);
}

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

void BlendVertices(const mesh::RegisteredFamily& family, std::span<const double> weights,
                   std::span<const mesh::VertexRange> ranges, std::vector<Float4>& positions) {
  assert(CheckWeights(family, weights).ok());
  size_t num_vertices = 0;
  for (const mesh::VertexRange& range : ranges) num_vertices += range[1] - range[0];
  if (positions.size() < num_vertices) positions.resize(num_vertices);
  Float4* out = positions.data();
  for (const mesh::VertexRange& range : ranges) {
    for (int32_t begin = range[0]; begin < range[1]; begin += kBatch) {
      const int32_t end = std::min(range[1], begin + kBatch);
      BlendBatch(family, weights, {begin, end}, out);
      out += end - begin;
    }
  }
}

}  // namespace liquidblend::blend
