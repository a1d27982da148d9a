#include "tests/accuracy/count_events.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <vector>

#include "worker/registration/features/height_field.h"
#include "worker/registration/features/median.h"

namespace liquidblend::accuracy {
namespace {

constexpr double kMinHeight = 2.0;  // edges
constexpr double kBorder = 2.0;     // edges; meniscuses
constexpr int kMinPoints = 4;       // of a region; fewer are noise

// Heights over the median, mean edges, on a square grid; NaN: not seen.
struct Relief {
  int size = 0;
  std::vector<double> heights;
  double At(int i, int j) const { return heights[static_cast<size_t>(j) * size + i]; }
};

Relief ReliefOf(const mesh::TriangleMesh& surface, mesh::Up up, double edge_length_m) {
  Relief relief;
  if (surface.num_vertices() == 0) return relief;
  const mesh::HeightAxis axis = mesh::AxisOf(up);
  const Eigen::Vector3d low3 = surface.vertices.rowwise().minCoeff().cast<double>();
  const Eigen::Vector3d high3 = surface.vertices.rowwise().maxCoeff().cast<double>();
  const Eigen::Vector2d low = registration::PlaceOf(low3, axis);
  const Eigen::Vector2d high = registration::PlaceOf(high3, axis);
  const registration::HeightField field(surface, axis, 0.5 * (low + high),
                                        0.5 * (high - low).maxCoeff(), edge_length_m,
                                        registration::Seen::kLargestPart);
  relief.size = field.size();
  std::vector<double> seen;
  for (int j = 0; j < field.size(); ++j) {
    for (int i = 0; i < field.size(); ++i) {
      const Eigen::Vector2d place = field.PlaceOfPoint(i, j);
      const double inside = std::min((place - low).minCoeff(), (high - place).minCoeff());
      const double height = inside < kBorder * edge_length_m ? NAN : field.At(i, j);
      relief.heights.push_back(height / edge_length_m);
      if (!std::isnan(height)) seen.push_back(height / edge_length_m);
    }
  }
  if (seen.empty()) return relief;
  const double median = registration::Median(seen);
  for (double& height : relief.heights) height -= median;
  return relief;
}

// Connected regions of the grid in which the predicate holds of the height.
int CountRegions(const Relief& relief, const std::function<bool(double)>& is_inside) {
  std::vector<char> visited(relief.heights.size(), 0);
  int count = 0;
  for (size_t first = 0; first < visited.size(); ++first) {
    std::vector<size_t> region;
    const auto visit = [&](size_t point) {
      if (visited[point] != 0 || !is_inside(relief.heights[point])) return;
      visited[point] = 1;
      region.push_back(point);
    };
    visit(first);
    for (size_t n = 0; n < region.size(); ++n) {
      const size_t size = relief.size, i = region[n] % size, j = region[n] / size;
      if (i > 0) visit(region[n] - 1);
      if (i + 1 < size) visit(region[n] + 1);
      if (j > 0) visit(region[n] - size);
      if (j + 1 < size) visit(region[n] + size);
    }
    if (region.size() >= kMinPoints) ++count;
  }
  return count;
}

}  // namespace

EventCounts CountEvents(const SurfaceAt& surface, const Frames& frames, mesh::Up up,
                        double edge_length_m, const parallel::Arena& arena) {
  std::vector<Relief> reliefs((std::min(frames.num, frames.num_early) + frames.step - 1) /
                              frames.step);
  arena.Run(static_cast<int64_t>(reliefs.size()), [&](int64_t n) {
    const double frame = static_cast<double>(n * frames.step);
    reliefs[n] = ReliefOf(surface(frame), up, edge_length_m);
  });
  double deepest = 0, highest = 0;
  for (const Relief& relief : reliefs) {
    for (const double height : relief.heights) {
      deepest = std::max(deepest, -height);  // NaN changes neither
      highest = std::max(highest, height);
    }
  }
  EventCounts most;
  for (const Relief& relief : reliefs) {
    if (deepest >= kMinHeight) {
      most.craters = std::max(most.craters,
                              CountRegions(relief, [&](double h) { return h <= -0.5 * deepest; }));
    }
    if (highest >= kMinHeight) {
      most.jets =
          std::max(most.jets, CountRegions(relief, [&](double h) { return h >= 0.5 * highest; }));
    }
  }
  return most;
}

}  // namespace liquidblend::accuracy
