#include "worker/registration/finish/part_slip.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <vector>

#include "worker/registration/surface/image_normals.h"

namespace liquidblend::registration {
namespace {

constexpr double kKnotSpacing = 1.0;  // frames
constexpr double kMinVertices = 20;   // weight of those around a knot
constexpr double kFadeFrames = 2.0;   // before the part's end, where its surface joins the rest
constexpr float kMinNormal = 1e-6f;

// Where a part's centre goes, as the mean of its vertices' images has it: linear in time.
struct Knot {
  Eigen::Vector4d at;  // image of the centre at the knot's time
  Eigen::Vector4d per_frame;
};

// Sums of a fit of a line to images of the centre, weighted by their distance in time.
struct LineFit {
  double weight = 0, t = 0, tt = 0;
  Eigen::Vector4d x = Eigen::Vector4d::Zero(), tx = Eigen::Vector4d::Zero();

  void Add(double w, double time, const Eigen::Vector4d& image) {
    weight += w;
    t += w * time;
    tt += w * time * time;
    x += w * image;
    tx += w * time * image;
  }

  std::optional<Knot> Solve() const {
    const double determinant = weight * tt - t * t;
    if (weight < kMinVertices || !(determinant > 0)) return std::nullopt;
    return Knot{(tt * x - t * tx) / determinant, (weight * tx - t * x) / determinant};
  }
};

// The motion of one part's centre to the target.
class CentreMap {
 public:
  explicit CentreMap(const DetachedPart& part)
      : part_(part), fits_(1 + static_cast<size_t>(part.track.life() / kKnotSpacing) + 1) {}

  // Takes a vertex and its image.
  void Add(const Eigen::Vector4d& point, const Eigen::Vector4d& image) {
    Eigen::Vector4d centre = image;
    centre.head<3>() -= part_.scale * FromCentre(point);
    for (size_t k = 0; k < fits_.size(); ++k) {
      const double time = point[3] - TimeOf(k);
      const double weight = 1 - std::abs(time) / kKnotSpacing;
      if (weight > 0) fits_[k].Add(weight, time, centre);
    }
  }

  void Solve() {
    for (const LineFit& fit : fits_) knots_.push_back(fit.Solve());
  }

  // The centre's image and its velocity at a time; nothing without knots around.
  std::optional<Knot> At(double time) const {
    const double place = (time - part_.track.start_time) / kKnotSpacing;
    const size_t k = static_cast<size_t>(std::max(0.0, place));
    if (k + 1 >= knots_.size() || !knots_[k] || !knots_[k + 1]) return std::nullopt;
    const double f = std::clamp(place - static_cast<double>(k), 0.0, 1.0);
    const Knot &a = *knots_[k], &b = *knots_[k + 1];
    const double from_a = time - TimeOf(k), from_b = time - TimeOf(k + 1);
    return Knot{(1 - f) * (a.at + from_a * a.per_frame) + f * (b.at + from_b * b.per_frame),
                (1 - f) * a.per_frame + f * b.per_frame};
  }

  Eigen::Vector3d FromCentre(const Eigen::Vector4d& point) const {
    return (point - part_.track.At(point[3]).centre).head<3>();
  }

  // 1 but for the last frames of the part.
  double Share(double time) const {
    return std::clamp((part_.track.end_time - time) / kFadeFrames, 0.0, 1.0);
  }

 private:
  double TimeOf(size_t knot) const {
    return part_.track.start_time + kKnotSpacing * static_cast<double>(knot);
  }

  const DetachedPart& part_;
  std::vector<LineFit> fits_;
  std::vector<std::optional<Knot>> knots_;
};

std::vector<CentreMap> FitCentres(const Surface& source, const PartMotions& motions,
                                  const Points& displacement) {
  std::vector<CentreMap> maps;
  for (const DetachedPart& part : motions.parts()) maps.emplace_back(part);
  for (int64_t v = 0; v < displacement.cols(); ++v) {
    const int part = motions.PartOf(v);
    if (part < 0) continue;
    const Eigen::Vector4f image = source.points.col(v) + displacement.col(v);
    maps[part].Add(source.points.col(v).cast<double>(), image.cast<double>());
  }
  for (CentreMap& map : maps) map.Solve();
  return maps;
}

// Unit length, or zero. Exactly across the chord between two points of a ball that have these
// normals in space.
Eigen::Vector3d MeanNormal(const Eigen::Vector4f& a, const Eigen::Vector4f& b) {
  const auto in_space = [](const Eigen::Vector4f& normal) -> Eigen::Vector3d {
    return normal.head<3>().cast<double>() / std::max(normal.head<3>().norm(), kMinNormal);
  };
  const Eigen::Vector3d sum = in_space(a) + in_space(b);
  return sum / std::max<double>(sum.norm(), kMinNormal);
}

}  // namespace

void RemovePartSlip(const Surface& source, const PackedLists& neighbors, const PartMotions& motions,
                    const parallel::Arena& arena, Points& displacement) {
  if (motions.parts().empty()) return;
  const std::vector<CentreMap> maps = FitCentres(source, motions, displacement);
  Points correction = Points::Zero(4, displacement.cols());
  arena.For(displacement.cols(), [&](int64_t v) {
    const int part = motions.PartOf(v);
    if (part < 0) return;
    const Eigen::Vector4d point = source.points.col(v).cast<double>();
    const std::optional<Knot> centre = maps[part].At(point[3]);
    if (!centre || !(centre->per_frame[3] > 0)) return;
    const Eigen::Vector4d image = point + displacement.col(v).cast<double>();
    Eigen::Vector4d moved = image;
    if (!source.InFirstSlab(v) && !source.InLastSlab(v)) {
      moved -= (image[3] - centre->at[3]) / centre->per_frame[3] * centre->per_frame;
    }
    const Eigen::Vector3d expected =
        centre->at.head<3>() + motions.parts()[part].scale * maps[part].FromCentre(point);
    const Eigen::Vector3d normal =
        MeanNormal(source.mesh.normals.col(v), ImageNormal(source, neighbors, displacement, 1, v));
    moved.head<3>() = expected + normal.dot(moved.head<3>() - expected) * normal;
    correction.col(v) = (maps[part].Share(point[3]) * (moved - image)).cast<float>();
  });
  displacement += correction;
}

}  // namespace liquidblend::registration
