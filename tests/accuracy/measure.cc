#include "tests/accuracy/measure.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "tests/synthetic/inverted_share.h"
#include "tests/synthetic/surface_distance.h"

namespace liquidblend::accuracy {
namespace {

constexpr double kSmallestPart = 1e-3;  // of the liquid's volume

int NumMeasured(const Frames& frames) { return (frames.num + frames.step - 1) / frames.step; }

// One value per measured frame, in their order.
template <typename Value, typename Function>
std::vector<Value> PerFrame(const Frames& frames, const parallel::Arena& arena,
                            const Function& function) {
  std::vector<Value> values(NumMeasured(frames));
  arena.For(
      static_cast<int64_t>(values.size()),
      [&](int64_t n) { values[n] = function(static_cast<int>(n) * frames.step); }, 1);
  return values;
}

std::vector<double> Parts(const mesh::TriangleMesh& surface) {
  std::vector<double> volumes = mesh::ComponentVolumes(surface);
  const double total = std::accumulate(volumes.begin(), volumes.end(), 0.0);
  std::erase_if(volumes, [&](double volume) { return std::abs(volume) < kSmallestPart * total; });
  return volumes;
}

}  // namespace

Means MeanDistance(const SurfaceAt& surface, const mesh::Animation& truth, const Frames& frames,
                   double edge_length_m, const parallel::Arena& arena) {
  const auto distances = PerFrame<double>(frames, arena, [&](int frame) {
    return synthetic::MeanSymmetricDistance(surface(frame), truth.frames[frame]) / edge_length_m;
  });
  Means means;
  int num_early = 0;
  for (size_t n = 0; n < distances.size(); ++n) {
    means.all += distances[n] / static_cast<double>(distances.size());
    if (static_cast<int>(n) * frames.step >= frames.num_early) continue;
    means.early += distances[n];
    ++num_early;
  }
  means.early /= std::max(1, num_early);
  means.of_frames = distances;
  return means;
}

double InvertedShare(const SurfaceAt& surface, const Frames& frames, double edge_length_m,
                     const parallel::Arena& arena) {
  const auto counts = PerFrame<synthetic::CrossingCount>(frames, arena, [&](int frame) {
    const double between = std::min(frame + 0.5 * (frame / frames.step % 2), frames.num - 1.0);
    return synthetic::CountInverted(surface(between), 0.5 * edge_length_m);
  });
  synthetic::CrossingCount total;
  for (const auto& count : counts) total += count;
  return total.inverted_share();
}

VolumeError CompareVolumes(const SurfaceAt& surface,
                           const std::vector<const mesh::Animation*>& inputs, const Frames& frames,
                           const parallel::Arena& arena) {
  const auto errors = PerFrame<double>(frames, arena, [&](int frame) {
    double mean = 0;
    for (const auto* input : inputs) {
      mean += mesh::Volume(input->frames[frame]) / static_cast<double>(inputs.size());
    }
    return std::abs(mesh::Volume(surface(frame)) / mean - 1);
  });
  VolumeError result;
  for (size_t n = 0; n < errors.size(); ++n) {
    result.mean += errors[n] / static_cast<double>(errors.size());
    if (errors[n] <= result.largest) continue;
    result.largest = errors[n];
    result.largest_at = static_cast<int>(n) * frames.step;
  }
  return result;
}

ComponentErrors CompareComponents(const SurfaceAt& surface,
                                  const std::vector<const mesh::Animation*>& others,
                                  const Frames& frames, const parallel::Arena& arena) {
  const auto of_blend = PerFrame<std::vector<double>>(
      frames, arena, [&](int frame) { return Parts(surface(frame)); });
  ComponentErrors errors;
  const double count = static_cast<double>(of_blend.size());
  bool is_falling = true;
  for (size_t n = 0; n < of_blend.size(); ++n) {
    errors.mean_components += static_cast<double>(of_blend[n].size()) / count;
    std::vector<double> mean;
    bool alike = true;
    for (const auto* other : others) {
      const auto parts = Parts(other->frames[n * frames.step]);
      errors.mean_components_others +=
          static_cast<double>(parts.size()) / count / static_cast<double>(others.size());
      if (mean.empty()) mean.resize(parts.size());
      alike = alike && parts.size() == mean.size();
      for (size_t k = 0; alike && k < parts.size(); ++k) {
        mean[k] += parts[k] / static_cast<double>(others.size());
      }
    }
    const bool matches = alike && of_blend[n].size() == mean.size();
    is_falling = is_falling && matches && of_blend[n].size() == of_blend[0].size();
    if (!alike || mean.size() < 2) continue;
    ++errors.num_frames;
    if (!matches) continue;
    ++errors.num_alike;
    for (size_t k = 0; is_falling && k < mean.size(); ++k) {
      errors.largest_error = std::max(errors.largest_error, std::abs(of_blend[n][k] / mean[k] - 1));
    }
  }
  return errors;
}

}  // namespace liquidblend::accuracy
