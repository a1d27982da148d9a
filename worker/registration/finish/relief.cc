#include "worker/registration/finish/relief.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>

#include "worker/registration/features/height_field.h"
#include "worker/registration/features/median.h"

namespace liquidblend::registration {
namespace {

constexpr double kMinRelief = 0.1;   // mean edges: flatter liquid has none
constexpr double kSeenShare = 0.25;  // of the liquid; smaller parts are not seen
constexpr double kMaxSteps = 512;    // of the grid of heights, along a side

// Box around all slices.
Eigen::AlignedBox3d BoundsOf(const std::vector<mesh::TriangleMesh>& slices) {
  Eigen::AlignedBox3d bounds;
  for (const mesh::TriangleMesh& slice : slices) {
    if (slice.num_vertices() == 0) continue;
    bounds.extend(slice.vertices.rowwise().minCoeff().cast<double>().eval());
    bounds.extend(slice.vertices.rowwise().maxCoeff().cast<double>().eval());
  }
  return bounds;
}

// The slice without bubbles and small parts.
mesh::TriangleMesh LargeParts(const mesh::TriangleMesh& slice) {
  const std::vector<int32_t> roots = mesh::ComponentRoots(slice);
  std::vector<double> volumes(roots.size(), 0.0);
  double total = 0;
  for (int64_t t = 0; t < slice.num_triangles(); ++t) {
    Eigen::Matrix3d corners;
    for (int k = 0; k < 3; ++k) {
      corners.col(k) = slice.vertices.col(slice.triangles(k, t)).cast<double>();
    }
    volumes[roots[slice.triangles(0, t)]] += corners.determinant() / 6;
    total += corners.determinant() / 6;
  }
  mesh::TriangleMesh large;
  large.vertices = slice.vertices;
  large.triangles.resize(3, slice.num_triangles());
  int64_t count = 0;
  for (int64_t t = 0; t < slice.num_triangles(); ++t) {
    if (volumes[roots[slice.triangles(0, t)]] < kSeenShare * total) continue;
    large.triangles.col(count++) = slice.triangles.col(t);
  }
  large.triangles.conservativeResize(3, count);
  return large;
}

// The view from above that all slices share: a grid over a box.
class View {
 public:
  View(const Eigen::AlignedBox3d& bounds, mesh::Up up, double edge_length_m)
      : up_(mesh::AxisOf(up)),
        low_(PlaceOf(bounds.min(), up_)),
        high_(PlaceOf(bounds.max(), up_)),
        spacing_(std::max(edge_length_m, (high_ - low_).maxCoeff() / kMaxSteps)) {}

  // Calls visit(place, height) for the grid points within the box; the height is NaN where there is
  // no liquid.
  template <typename Visit>
  void ForEachHeight(const mesh::TriangleMesh& slice, const Visit& visit) const {
    const double half_width = 0.5 * (high_ - low_).maxCoeff() + 0.5 * spacing_;
    const HeightField field(LargeParts(slice), up_, 0.5 * (low_ + high_), half_width, spacing_,
                            Seen::kAll);
    for (int j = 0; j < field.size(); ++j) {
      for (int i = 0; i < field.size(); ++i) {
        const Eigen::Vector2d place = field.PlaceOfPoint(i, j);
        const double inside = std::min((place - low_).minCoeff(), (high_ - place).minCoeff());
        if (inside >= spacing_) visit(place, field.At(i, j));
      }
    }
  }
  Eigen::Vector3d PointAt(const Eigen::Vector2d& place, double height) const {
    return registration::PointAt(place, height, up_);
  }

 private:
  mesh::HeightAxis up_;
  Eigen::Vector2d low_, high_;
  double spacing_;
};

// Heights of a slice on the grid.
struct Heights {
  std::vector<Eigen::Vector2d> places;
  std::vector<double> heights;  // NaN: no liquid
  double lowest = std::numeric_limits<double>::infinity();
};

std::vector<Heights> HeightsOf(const std::vector<mesh::TriangleMesh>& slices, const View& view,
                               const parallel::Arena& arena) {
  std::vector<Heights> all(slices.size());
  arena.Run(static_cast<int64_t>(slices.size()), [&](int64_t n) {
    Heights& seen = all[n];
    view.ForEachHeight(slices[n], [&](const Eigen::Vector2d& place, double height) {
      seen.places.push_back(place);
      seen.heights.push_back(height);
      if (height < seen.lowest) seen.lowest = height;
    });
  });
  return all;
}

struct Relief {
  double square = 0.0;  // mean over the places
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();
};

//   floor  height where there is no liquid
Relief ReliefOf(Heights seen, double floor, const View& view) {
  Relief relief;
  if (seen.heights.empty()) return relief;
  for (double& height : seen.heights) height = std::isnan(height) ? floor : height;
  const double median = Median(seen.heights);
  double sum = 0;
  Eigen::Vector2d moment = Eigen::Vector2d::Zero();
  for (size_t n = 0; n < seen.heights.size(); ++n) {
    const double square = (seen.heights[n] - median) * (seen.heights[n] - median);
    sum += square;
    moment += square * seen.places[n];
  }
  relief.square = sum / static_cast<double>(seen.heights.size());
  if (sum > 0) relief.centre = view.PointAt(moment / sum, median);
  return relief;
}

// Reliefs of an animation's slices, and their root mean square.
struct Reliefs {
  std::vector<Relief> of_slices;
  double all = 0.0;
};

Reliefs ReliefsOf(const std::vector<Heights>& seen, double floor, const View& view) {
  Reliefs reliefs;
  double sum = 0;
  for (const Heights& heights : seen) {
    reliefs.of_slices.push_back(ReliefOf(heights, floor, view));
    sum += reliefs.of_slices.back().square;
  }
  reliefs.all = std::sqrt(sum / static_cast<double>(std::max<size_t>(1, seen.size())));
  return reliefs;
}

ReliefLoss LossOf(const Reliefs& source, const Reliefs& target, const Reliefs& blend, double weight,
                  double edge_length_m) {
  ReliefLoss loss;
  const auto mean = [&](double a, double b) { return (1 - weight) * a + weight * b; };
  const double of_both = mean(source.all, target.all);
  if (!(of_both >= kMinRelief * edge_length_m)) return loss;
  loss.share = std::max(0.0, 1 - blend.all / of_both);
  double most = 0;
  for (size_t n = 0; n < source.of_slices.size(); ++n) {
    const Relief &a = source.of_slices[n], &b = target.of_slices[n];
    const double lost = mean(a.square, b.square) - blend.of_slices[n].square;
    if (lost <= most) continue;
    most = lost;
    loss.slice = static_cast<int>(n);
    loss.source_m = a.centre;
    loss.target_m = b.centre;
  }
  return loss;
}

}  // namespace

ReliefLoss LossOfRelief(const std::vector<mesh::TriangleMesh>& source,
                        const std::vector<mesh::TriangleMesh>& target,
                        const std::vector<BlendSlices>& blends, mesh::Up up, double edge_length_m,
                        const parallel::Arena& arena) {
  ReliefLoss most;
  Eigen::AlignedBox3d bounds = BoundsOf(source);
  bounds.extend(BoundsOf(target));
  if (bounds.isEmpty()) return most;
  const View view(bounds, up, edge_length_m);
  const std::vector<Heights> of_source = HeightsOf(source, view, arena),
                             of_target = HeightsOf(target, view, arena);
  double floor = std::numeric_limits<double>::infinity();
  for (size_t n = 0; n < source.size(); ++n) {
    floor = std::min({floor, of_source[n].lowest, of_target[n].lowest});
  }
  const Reliefs a = ReliefsOf(of_source, floor, view), b = ReliefsOf(of_target, floor, view);
  for (const BlendSlices& blend : blends) {
    const Reliefs between = ReliefsOf(HeightsOf(blend.slices, view, arena), floor, view);
    const ReliefLoss loss = LossOf(a, b, between, blend.weight, edge_length_m);
    if (loss.share > most.share) most = loss;
  }
  return most;
}

}  // namespace liquidblend::registration
