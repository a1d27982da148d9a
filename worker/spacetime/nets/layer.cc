#include "worker/spacetime/nets/layer.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <utility>

#include "worker/spacetime/field/inside.h"

namespace liquidblend::spacetime {
namespace {

constexpr float kTiny = 1e-6f;       // no grid point lies exactly on the surface
constexpr float kOnSurface = 1e-3f;  // nearer than this the triangle's normal is the gradient

Eigen::Matrix3f CornersOf(const GridSurface& surface, int32_t t) {
  Eigen::Matrix3f corners;
  for (int c = 0; c < 3; ++c) corners.col(c) = surface.vertices.col(surface.triangles(c, t));
  return corners;
}

Eigen::Vector3f UnitNormal(const GridSurface& surface, int32_t t) {
  const Eigen::Matrix3f corners = CornersOf(surface, t);
  return (corners.col(1) - corners.col(0))
      .cross(corners.col(2) - corners.col(0))
      .stableNormalized();
}

float Signed(float distance, bool is_inside) {
  return is_inside ? -std::max(kTiny, distance) : std::max(kTiny, distance);
}

float NotZero(float distance) {
  return distance < 0 ? std::min(-kTiny, distance) : std::max(kTiny, distance);
}

Eigen::Vector3f BarycentricOn(const Eigen::Matrix3f& corners, const Eigen::Vector3f& p) {
  return ClosestBarycentric(p, corners.col(0), corners.col(1), corners.col(2));
}

}  // namespace

LayerSource::LayerSource(const Grid& grid, GridSurface surface, std::optional<float> sheet_motion) {
  InsideBits inside = ComputeInside(grid, surface);
  views.push_back({std::move(surface), std::move(inside), 1.0f});
  if (sheet_motion) sheet_points = FindSheetPoints(grid, views[0].surface, *sheet_motion);
}

LayerSource::LayerSource(const Grid& grid, GridSurface forward, GridSurface backward, float share,
                         std::optional<float> sheet_motion)
    : LayerSource(grid, std::move(forward)) {
  views[0].weight = 1.0f - share;
  InsideBits inside = ComputeInside(grid, backward);
  views.push_back({std::move(backward), std::move(inside), share});
  if (!sheet_motion) return;
  sheet_points = FindSheetPoints(grid, views[share > 0.5f ? 1 : 0].surface, *sheet_motion);
}

InsideBits LayerSource::AroundSheets(const Grid& grid) const {
  constexpr int kReach = 2;  // of the points that AddToInside may add
  if (sheet_points.empty()) return {};
  InsideBits around = views[0].inside;
  for (const SheetPoint& p : sheet_points) {
    for (int k = std::max(0, p.k - kReach); k <= std::min(grid.dims[2] - 1, p.k + kReach); ++k) {
      for (int j = std::max(0, p.j - kReach); j <= std::min(grid.dims[1] - 1, p.j + kReach); ++j) {
        const int end = std::min(grid.dims[0] - 1, p.i + kReach);
        for (int i = std::max(0, p.i - kReach); i <= end; ++i) around.Set(grid, i, j, k);
      }
    }
  }
  return around;
}

Layer::Part::Part(const Grid& grid, LayerSource::View v, const PointBits* needed)
    : view(std::move(v)), band(grid, view.surface, needed) {}

float Layer::Part::Distance(int i, int j, int k) const {
  return Signed(band.Distance(i, j, k), view.inside.At(i, j, k));
}

Eigen::Vector3f Layer::Part::Gradient(const DistanceBand::Entry& entry, bool is_inside) const {
  if (entry.triangle < 0) return Eigen::Vector3f::Zero();
  if (entry.distance > kOnSurface) {
    return (is_inside ? -1 / entry.distance : 1 / entry.distance) * entry.offset;
  }
  return UnitNormal(view.surface, entry.triangle);
}

Layer::Layer(const Grid& grid, LayerSource source, const PointBits* needed) {
  parts_.reserve(source.views.size());
  for (LayerSource::View& view : source.views) parts_.emplace_back(grid, std::move(view), needed);
  inside_ = parts_[0].view.inside;
  if (parts_.size() > 1) BlendInside(grid);
  sheet_points_ = std::move(source.sheet_points);
  if (sheet_points_.empty()) return;
  AddToInside(
      grid, [&](int i, int j, int k) { return Distance(i, j, k); }, sheet_points_, inside_);
}

// Where both parts agree so does their mean.
void Layer::BlendInside(const Grid& grid) {
  std::vector<uint64_t> differ(grid.words_per_row());
  for (int k = 0; k < grid.dims[2]; ++k) {
    for (int j = 0; j < grid.dims[1]; ++j) {
      const uint64_t* other = parts_[1].view.inside.Row(j, k);
      uint64_t* row = inside_.MutableRow(grid.Row(j, k));
      for (int w = 0; w < grid.words_per_row(); ++w) differ[w] = row[w] ^ other[w];
      ForEachBit(differ.data(), grid.words_per_row(), [&](int i) {
        const float mean = parts_[0].view.weight * parts_[0].Distance(i, j, k) +
                           parts_[1].view.weight * parts_[1].Distance(i, j, k);
        const uint64_t bit = uint64_t{1} << (i & 63);
        row[i >> 6] = mean < 0 ? row[i >> 6] | bit : row[i >> 6] & ~bit;
      });
    }
  }
}

float Layer::SheetThickness(int i, int j, int k) const {
  if (sheet_points_.empty()) return 0;
  const auto found = std::lower_bound(sheet_points_.begin(), sheet_points_.end(),
                                      SheetPoint{i, j, k, 0}, Precedes);
  const bool is_there =
      found != sheet_points_.end() && found->i == i && found->j == j && found->k == k;
  return is_there ? found->thickness : 0;
}

bool Layer::HasSheetPoints(int j, int k) const {
  for (const int plane : {k, k + 1}) {
    const auto found = std::lower_bound(sheet_points_.begin(), sheet_points_.end(),
                                        SheetPoint{0, j, plane, 0}, Precedes);
    if (found != sheet_points_.end() && found->k == plane && found->j <= j + 1) return true;
  }
  return false;
}

bool Layer::has_velocities() const {
  return std::all_of(parts_.begin(), parts_.end(), [](const Part& part) {
    return part.view.surface.velocities.cols() > 0 || part.view.surface.vertices.cols() == 0;
  });
}

// Points where the parts cancel out are outside, as in BlendInside.
float Layer::Distance(int i, int j, int k) const {
  float sum = 0;
  for (const Part& part : parts_) sum += part.view.weight * part.Distance(i, j, k);
  return NotZero(sum);
}

Eigen::Vector3f Layer::Gradient(int i, int j, int k) const {
  Eigen::Vector3f sum = Eigen::Vector3f::Zero();
  for (const Part& part : parts_) {
    sum += part.view.weight * part.Gradient(part.band.At(i, j, k), part.view.inside.At(i, j, k));
  }
  return sum;
}

Layer::Corners Layer::AtCorners(int i, int j, int k) const {
  Corners corners(*this);
  for (size_t n = 0; n < parts_.size(); ++n) {
    corners.parts_[n] = {parts_[n].band.AtCorners(i, j, k),
                         parts_[n].view.inside.AtCorners(i, j, k)};
  }
  for (int c = 0; c < 8; ++c) {
    float sum = 0;
    for (size_t n = 0; n < parts_.size(); ++n) {
      const Corners::OfPart& part = corners.parts_[n];
      sum += parts_[n].view.weight * Signed(part.entries[c]->distance, (part.inside >> c & 1) != 0);
    }
    corners.distance_[c] = NotZero(sum);
  }
  return corners;
}

Eigen::Vector3f Layer::Corners::Gradient(int c) const {
  Eigen::Vector3f sum = Eigen::Vector3f::Zero();
  for (size_t n = 0; n < layer_->parts_.size(); ++n) {
    const Part& part = layer_->parts_[n];
    sum +=
        part.view.weight * part.Gradient(*parts_[n].entries[c], (parts_[n].inside >> c & 1) != 0);
  }
  return sum;
}

// Of the triangle that is nearest to a corner.
Eigen::Vector3f Layer::Corners::Velocity(const Eigen::Vector3f& p) const {
  return layer_->MeanVelocity(p, [&](const Part& part) {
    const OfPart& corners = parts_[&part - layer_->parts_.data()];
    float best = DistanceBand::kBandWidth;
    int32_t t = -1;
    for (const DistanceBand::Entry* entry : corners.entries) {
      if (entry->distance >= best) continue;
      best = entry->distance;
      t = entry->triangle;
    }
    return t;
  });
}

Eigen::Vector3f Layer::SurfaceVelocity(int i, int j, int k) const {
  return MeanVelocity(Eigen::Vector3i(i, j, k).cast<float>(),
                      [&](const Part& part) { return part.band.Triangle(i, j, k); });
}

template <typename TriangleOf>
Eigen::Vector3f Layer::MeanVelocity(const Eigen::Vector3f& p, TriangleOf&& triangle_of) const {
  Eigen::Vector3f sum = Eigen::Vector3f::Zero();
  float total = 0;
  for (const Part& part : parts_) {
    const int32_t t = triangle_of(part);
    if (t < 0) continue;
    const Eigen::Vector3f w = BarycentricOn(CornersOf(part.view.surface, t), p);
    for (int c = 0; c < 3; ++c) {
      sum += part.view.weight * w[c] *
             part.view.surface.velocities.col(part.view.surface.triangles(c, t));
    }
    total += part.view.weight;
  }
  return total > 0 ? Eigen::Vector3f(sum / total) : sum;
}

}  // namespace liquidblend::spacetime
