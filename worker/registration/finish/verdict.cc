#include "worker/registration/finish/verdict.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <utility>

#include "absl/strings/str_format.h"
#include "core/mesh/slice_at.h"
#include "worker/registration/finish/relief.h"
#include "worker/registration/finish/residuals.h"
#include "worker/registration/surface/blend_figures.h"

namespace liquidblend::registration {
namespace {

// Limits of the sum over figures of (value / scale)^2: two animations that are not alike show it a
// little in many ways before one of them is beyond its own limit.
constexpr double kSumDoubtfulFrom = 2.6;
constexpr double kSumTooDifferentFrom = 4.3;

mesh::Grade GradeOf(double value, double doubtful_from, double too_different_from) {
  if (!(value < too_different_from)) return mesh::Grade::kTooDifferent;  // NaN too
  return value < doubtful_from ? mesh::Grade::kGood : mesh::Grade::kDoubtful;
}

// A figure, with the values from which it alone speaks against the registration.
struct Figure {
  double value;
  double scale;  // in the sum; infinity: not part of it
  double doubtful_from;
  double too_different_from;  // infinity: never
  double unit;                // factor of value and limits in messages
  const char* what;
  Eigen::Vector4d WorstPlaces::*place;

  mesh::Grade grade() const { return GradeOf(value, doubtful_from, too_different_from); }
  double severity() const { return value / doubtful_from; }
  double share_of_sum() const { return value * value / (scale * scale); }
  std::string Format() const {
    const std::string too_different =
        std::isinf(too_different_from)
            ? ""
            : absl::StrFormat(", too different from %.3g", unit * too_different_from);
    return absl::StrFormat("%.3g %s (good below %.3g%s)", unit * value, what, unit * doubtful_from,
                           too_different);
  }
};

double Mean(const std::vector<double>& values) {
  double sum = 0;
  for (const double value : values) sum += std::abs(value);
  return sum / static_cast<double>(std::max<size_t>(1, values.size()));
}

std::vector<Figure> Figures(const mesh::Verdict& verdict) {
  constexpr double kNotInSum = std::numeric_limits<double>::infinity();
  constexpr double kNever = std::numeric_limits<double>::infinity();
  constexpr double kPercent = 100;
  return {
      {1 - verdict.compatible_share, 0.025, 0.04, 0.15, kPercent,
       "% of the source has no counterpart near by that faces the same way",
       &WorstPlaces::unmatched},
      {1 - verdict.covered_share, 0.025, 0.04, 0.15, kPercent,
       "% of the target is not covered by the source", &WorstPlaces::unmatched},
      {verdict.unmatched_share, 0.065, 0.12, 0.3, kPercent,
       "% of one animation has no counterpart in the other for some time", &WorstPlaces::unmatched},
      {verdict.stretch, 0.15, 0.22, 0.5, kPercent,
       "% is the mean change of distances on the surface", &WorstPlaces::stretched},
      {Mean(verdict.volume_errors), 0.025, 0.05, 0.2, kPercent,
       "% is the half-way blend's volume off on average", &WorstPlaces::volume},
      {verdict.inverted_share, kNotInSum, 0.003, 0.03, kPercent, "% of the surface is inside out",
       &WorstPlaces::inverted},
      {verdict.component_error, kNotInSum, 0.4, 2.0, 1,
       "is the mean difference in the number of parts", &WorstPlaces::unmatched},
      {verdict.part_shift, kNotInSum, 0.5, kNever, 1,
       "diameters is how far a detached part is from half-way between its counterparts",
       &WorstPlaces::shifted_part},
      {verdict.part_volume_error, kNotInSum, 0.15, kNever, kPercent,
       "% is a detached part's volume off between both animations'",
       &WorstPlaces::part_of_other_volume},
      {verdict.part_fall_error, kNotInSum, 0.3, kNever, kPercent,
       "% is the acceleration of a falling part off", &WorstPlaces::falling_part},
      {verdict.relief_loss, kNotInSum, 0.25, 1.0, kPercent,
       "% of the relief (craters, jets, waves) is lost half-way", &WorstPlaces::relief}};
}

void SetHistogram(const std::vector<Sample>& samples, mesh::Verdict& verdict) {
  double from = 0.0;
  for (size_t bin = 0; bin < verdict.residual_histogram.size(); ++bin) {
    const double to = bin < verdict.kBinEnds.size() ? verdict.kBinEnds[bin] : kNoCounterpart;
    verdict.residual_histogram[bin] = ShareBetween(samples, from, to);
    from = to;
  }
  verdict.compatible_share = ShareBetween(samples, 0.0, kNoCounterpart);
}

// Where slices' volumes are furthest from what they should be: their middle.
Eigen::Vector4d PlaceOfLargest(const std::vector<double>& errors,
                               const std::vector<mesh::TriangleMesh>& slices,
                               const std::vector<double>& times) {
  size_t largest = 0;
  for (size_t n = 0; n < errors.size(); ++n) {
    if (std::abs(errors[n]) > std::abs(errors[largest])) largest = n;
  }
  Eigen::Vector4d place(0, 0, 0, times[largest]);
  const Eigen::Matrix3Xf& vertices = slices[largest].vertices;
  if (vertices.cols() > 0) place.head<3>() = vertices.rowwise().mean().cast<double>();
  return place;
}

Eigen::Vector4d PlaceOfRelief(const ReliefLoss& relief, const mesh::SpaceTimeMesh& mesh) {
  Eigen::Vector4d place;
  place << relief.source_m, SliceTimes(mesh)[relief.slice];
  return place;
}

Eigen::Vector4d InMetres(Eigen::Vector4d place, const mesh::SpaceTimeMesh& mesh) {
  place.head<3>() *= mesh.edge_length_m;
  place[3] = std::clamp(place[3], 0.0, mesh.num_frames - 1.0);
  return place;
}

// Per time, the parts of the pre-roll that still fall in the target. In a blend they fall beside
// those of the source.
std::vector<int> NumPreRollParts(const PartMotions& motions, const std::vector<double>& times) {
  std::vector<int> counts;
  for (const double time : times) {
    counts.push_back(static_cast<int>(
        std::count_if(motions.all().begin(), motions.all().end(), [time](const PartMotion& motion) {
          return motion.begins_in_pre_roll && time < motion.target.end_time;
        })));
  }
  return counts;
}

}  // namespace

mesh::Verdict Judge(const Surface& source, const PackedLists& neighbors, const Surface& target,
                    const ClosestPointSearch& target_search, const Points& displacement,
                    const std::vector<PartOfBoth>& parts, const PartMotions& motions,
                    TimesBlend times, const parallel::Arena& arena) {
  mesh::Verdict verdict;
  Regions unmatched, inverted, stretched;
  const Points moved = source.points + displacement;
  const auto of_source = SampleSource(source, moved, target, target_search, arena);
  const auto of_target = SampleTarget(source, moved, target, arena);
  AddDistances(of_source, unmatched);
  AddDistances(of_target, unmatched);
  SetHistogram(of_source, verdict);
  verdict.covered_share = ShareBetween(of_target, 0.0, kReachEdges);
  verdict.unmatched_share = std::max(LargestUnmatchedShare(of_source, source.mesh.num_frames),
                                     LargestUnmatchedShare(of_target, target.mesh.num_frames));
  verdict.stretch = MeanStretch(source, neighbors, moved, arena, stretched);

  std::vector<BlendSlices> blends;
  for (const float weight : kBlendWeights) {
    blends.push_back({weight, SliceBlend(source, displacement, weight, arena)});
  }
  const std::vector<mesh::TriangleMesh>& half_way = blends[1].slices;
  const auto whole = SliceBlend(source, displacement, 1.0f, arena);
  verdict.inverted_share = 0.5 * (InvertedShare(half_way, source.mesh, arena, inverted) +
                                  InvertedShare(whole, source.mesh, arena, inverted));
  const auto at_rest = mesh::SliceAt(source.mesh, SliceTimes(source.mesh), arena);
  const auto target_slices = SliceTarget(source.mesh, target.mesh, arena);
  verdict.component_error = ComponentError(whole, target_slices);
  const std::vector<int> more = NumPreRollParts(motions, SliceTimes(source.mesh));
  for (const BlendSlices& blend : blends) {
    verdict.component_error = std::max(
        verdict.component_error, ComponentErrorBetween(at_rest, target_slices, blend.slices, more));
  }
  verdict.volume_errors = VolumeErrors(at_rest, target_slices, half_way);
  const ReliefLoss relief = LossOfRelief(at_rest, target_slices, blends, source.mesh.up,
                                         source.mesh.edge_length_m, arena);
  verdict.relief_loss = relief.share;
  const PartErrors part = CompareParts(source, displacement, parts, arena);
  verdict.part_shift = part.shift.value;
  verdict.part_volume_error = part.volume.value;
  if (times == TimesBlend::kLinearly) verdict.part_fall_error = part.fall.value;
  const auto in_metres = [&](const Eigen::Vector4d& place) { return InMetres(place, source.mesh); };
  SetGrade({.unmatched = in_metres(unmatched.Worst()),
            .inverted = in_metres(inverted.Worst()),
            .volume = PlaceOfLargest(verdict.volume_errors, half_way, SliceTimes(source.mesh)),
            .stretched = in_metres(stretched.Worst()),
            .shifted_part = in_metres(part.shift.place),
            .part_of_other_volume = in_metres(part.volume.place),
            .falling_part = in_metres(part.fall.place),
            .relief = PlaceOfRelief(relief, source.mesh),
            .relief_of_target = relief.target_m},
           verdict);
  return verdict;
}

double CostOf(const mesh::Verdict& verdict) {
  double cost = 0;
  for (const Figure& figure : Figures(verdict)) cost += figure.severity() * figure.severity();
  return std::isnan(cost) ? std::numeric_limits<double>::infinity() : cost;
}

void SetGrade(const WorstPlaces& places, mesh::Verdict& verdict) {
  const std::vector<Figure> figures = Figures(verdict);
  const Figure* worst =
      &*std::max_element(figures.begin(), figures.end(), [](const Figure& a, const Figure& b) {
        return std::pair(a.grade(), a.severity()) < std::pair(b.grade(), b.severity());
      });
  verdict.grade = worst->grade();
  verdict.reason = worst->Format();
  double sum = 0;
  for (const Figure& figure : figures) sum += figure.share_of_sum();
  const mesh::Grade of_sum = GradeOf(sum, kSumDoubtfulFrom, kSumTooDifferentFrom);
  if (of_sum > verdict.grade) {
    worst = &*std::max_element(
        figures.begin(), figures.end(),
        [](const Figure& a, const Figure& b) { return a.share_of_sum() < b.share_of_sum(); });
    verdict.grade = of_sum;
    verdict.reason =
        absl::StrFormat("%.3g in sum (good below %.3g, too different from %.3g), most of it: %s",
                        sum, kSumDoubtfulFrom, kSumTooDifferentFrom, worst->Format());
  }
  if (worst->place == &WorstPlaces::relief) {
    const Eigen::Vector4d& a = places.relief;
    const Eigen::Vector3d& b = places.relief_of_target;
    absl::StrAppendFormat(&verdict.reason,
                          " (around (%.3g, %.3g, %.3g) m in the source, (%.3g, %.3g, %.3g) m in "
                          "the target)",
                          a[0], a[1], a[2], b[0], b[1], b[2]);
  }
  Eigen::Vector4d::Map(verdict.worst.data()) = places.*(worst->place);
}

}  // namespace liquidblend::registration
