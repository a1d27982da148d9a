#include "tests/accuracy/report.h"

#include <algorithm>
#include <limits>
#include <string>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "tests/accuracy/count_events.h"
#include "tests/accuracy/distance_field_blend.h"
#include "tests/accuracy/measure.h"

namespace liquidblend::accuracy {
namespace {

constexpr double kFieldSpacing = 0.9;  // mean edges; the space-time mesh's own spacing
constexpr double kFoldWeights[] = {-0.25, 0.5, 0.75, 1.0, 1.25};

// What all tables of one scene need.
struct Context {
  const Scene& scene;
  const RegisteredScene& registered;
  Frames frames;
  Frames fold_frames;
  bool each_frame;
  const parallel::Arena& arena;
  std::ostream& out;

  double edge_length_m() const { return registered.family().edge_length_m; }
  size_t num_targets() const { return scene.inputs.size() - 1; }
  SurfaceAt BlendAt(const std::vector<double>& weights) const {
    return [this, weights](double frame) { return registered.Cut(weights, frame); };
  }
  SurfaceAt Input(size_t n) const {
    return [this, n](double frame) { return scene.inputs[n].frames[static_cast<size_t>(frame)]; };
  }
  // The family's weights with one target at w and the others at 0.
  std::vector<double> Only(size_t target, double w) const {
    std::vector<double> weights(num_targets(), 0.0);
    weights[target] = w;
    return weights;
  }
  // Requires: the scene has truths.
  const mesh::Animation& TruthOf(const Middle& middle) const { return scene.truths[middle.truth]; }
  std::vector<const mesh::Animation*> Inputs() const {
    std::vector<const mesh::Animation*> inputs;
    for (const mesh::Animation& input : scene.inputs) inputs.push_back(&input);
    return inputs;
  }
};

SurfaceAt BlendOfFields(const Context& context, const std::vector<double>& weights) {
  std::vector<double> of_inputs = {1.0};
  for (const double w : weights) {
    of_inputs[0] -= w;
    of_inputs.push_back(w);
  }
  std::vector<size_t> used;
  for (size_t n = 0; n < of_inputs.size(); ++n) {
    if (of_inputs[n] != 0) used.push_back(n);
  }
  return [&context, of_inputs, used](double frame) {
    std::vector<const mesh::TriangleMesh*> surfaces;
    std::vector<double> shares;
    for (const size_t n : used) {
      surfaces.push_back(&context.scene.inputs[n].frames[static_cast<size_t>(frame)]);
      shares.push_back(of_inputs[n]);
    }
    return BlendDistances(surfaces, shares, kFieldSpacing * context.edge_length_m());
  };
}

// A row of the table of distances.
struct Distance {
  std::string label;
  Means means;
};

Means PrintDistance(const Context& context, const std::string& label, const SurfaceAt& surface,
                    const mesh::Animation& truth, std::vector<Distance>& printed) {
  const Means means =
      MeanDistance(surface, truth, context.frames, context.edge_length_m(), context.arena);
  context.out << absl::StrFormat("| %s | %s | %.4f | %.4f |\n", label, truth.name, means.all,
                                 means.early)
              << std::flush;
  printed.push_back({label, means});
  return means;
}

void PrintEachFrame(const Context& context, const std::vector<Distance>& distances) {
  context.out << "\n| frame |";
  for (const Distance& distance : distances) context.out << " " << distance.label << " |";
  context.out << "\n| --- |";
  for (size_t n = 0; n < distances.size(); ++n) context.out << " --- |";
  for (size_t n = 0; n < distances[0].means.of_frames.size(); ++n) {
    context.out << "\n| " << n * context.frames.step + 1 << " |";
    for (const Distance& distance : distances) {
      context.out << absl::StrFormat(" %.4f |", distance.means.of_frames[n]);
    }
  }
  context.out << "\n";
}

Comparison PrintDistances(const Context& context) {
  const Scene& scene = context.scene;
  context.out << absl::StrFormat(
      "| distance in mean edges (%.4f m) | against | all frames | frames 1 to %d |\n"
      "| --- | --- | --- | --- |\n",
      context.edge_length_m(), context.frames.num_early);
  std::vector<Distance> rows;
  PrintDistance(context, "weight 0", context.BlendAt(context.Only(0, 0.0)), scene.inputs[0], rows);
  for (size_t k = 0; k < context.num_targets(); ++k) {
    PrintDistance(context, "weight 1", context.BlendAt(context.Only(k, 1.0)), scene.inputs[k + 1],
                  rows);
  }
  if (scene.truths.empty()) {
    if (context.each_frame) PrintEachFrame(context, rows);
    return {};
  }
  constexpr double kFar = std::numeric_limits<double>::infinity();
  Comparison result{.best_middle = kFar, .best_baseline = kFar};
  for (const Middle& middle : scene.middles) {
    const Means means = PrintDistance(context, middle.label, context.BlendAt(middle.weights),
                                      context.TruthOf(middle), rows);
    result.best_middle = std::min(result.best_middle, means.early);
  }
  for (const mesh::Animation& truth : scene.truths) {
    for (size_t n = 0; n < scene.inputs.size(); ++n) {
      const Means means =
          PrintDistance(context, absl::StrCat("baseline: input ", scene.inputs[n].name),
                        context.Input(n), truth, rows);
      result.best_baseline = std::min(result.best_baseline, means.early);
    }
  }
  for (const Middle& middle : scene.middles) {
    const Means means =
        PrintDistance(context, absl::StrCat("baseline: distance fields, ", middle.label),
                      BlendOfFields(context, middle.weights), context.TruthOf(middle), rows);
    result.best_baseline = std::min(result.best_baseline, means.early);
  }
  if (context.each_frame) PrintEachFrame(context, rows);
  return result;
}

double PrintFoldRow(const Context& context, const std::string& label,
                    const std::function<std::vector<double>(double)>& weights_at) {
  double sum = 0;
  context.out << "| " << label;
  for (const double w : kFoldWeights) {
    const double share = InvertedShare(context.BlendAt(weights_at(w)), context.fold_frames,
                                       context.edge_length_m(), context.arena);
    if (w >= 0.5) sum += share / 4;
    context.out << absl::StrFormat(" | %.4f", 100 * share) << std::flush;
  }
  context.out << absl::StrFormat(" | %.4f |\n", 100 * sum);
  return sum;
}

void PrintFolds(const Context& context) {
  context.out << "\n| inverted, % of crossings | -0.25 | 0.5 | 0.75 | 1 | 1.25 | mean 0.5 to 1.25 "
                 "|\n| --- | --- | --- | --- | --- | --- | --- |\n";
  for (size_t k = 0; k < context.num_targets(); ++k) {
    PrintFoldRow(
        context,
        absl::StrCat(context.scene.inputs[0].name, " to ", context.scene.inputs[k + 1].name),
        [&](double w) { return context.Only(k, w); });
  }
  for (const Middle& middle : context.scene.middles) {
    context.out << absl::StrFormat(
        "| %s | | %.4f | | | | |\n", middle.label,
        100 * InvertedShare(context.BlendAt(middle.weights), context.fold_frames,
                            context.edge_length_m(), context.arena));
  }
}

// Parts are compared with the middle simulation's, or with all inputs'.
void PrintVolumes(const Context& context) {
  const auto inputs = context.Inputs();
  const bool has_truth = !context.scene.truths.empty();
  const std::string name = has_truth ? "the simulation" : "the inputs";
  context.out << absl::StrFormat(
      "\n| volume and parts | volume against the inputs' mean: mean, largest | as many parts as "
      "in %s | largest error of a falling part | parts, mean: blend, %s |\n"
      "| --- | --- | --- | --- | --- |\n",
      name, name);
  for (const Middle& middle : context.scene.middles) {
    const SurfaceAt surface = context.BlendAt(middle.weights);
    const auto others =
        has_truth ? std::vector<const mesh::Animation*>{&context.TruthOf(middle)} : inputs;
    const VolumeError volume = CompareVolumes(surface, inputs, context.frames, context.arena);
    const ComponentErrors parts = CompareComponents(surface, others, context.frames, context.arena);
    context.out << absl::StrFormat(
        "| %s | %.2f %%, %.2f %% (frame %d) | %d of %d frames | %.2f %% | %.2f, %.2f |\n",
        middle.label, 100 * volume.mean, 100 * volume.largest, volume.largest_at + 1,
        parts.num_alike, parts.num_frames, 100 * parts.largest_error, parts.mean_components,
        parts.mean_components_others);
  }
}

// Of the inputs, the truths and each target's blends.
void PrintEvents(const Context& context) {
  const auto print = [&](const std::string& label, const SurfaceAt& surface) {
    const EventCounts counts = CountEvents(surface, context.frames, context.registered.family().up,
                                           context.edge_length_m(), context.arena);
    context.out << absl::StrFormat("| %s | %d | %d |\n", label, counts.craters, counts.jets);
  };
  const auto frames_of = [](const mesh::Animation& animation) -> SurfaceAt {
    return [&animation](double frame) { return animation.frames[static_cast<size_t>(frame)]; };
  };
  context.out << absl::StrFormat(
      "\n| at once, frames 1 to %d | craters | jets |\n| --- | --- | --- |\n",
      context.frames.num_early);
  for (const mesh::Animation& input : context.scene.inputs) print(input.name, frames_of(input));
  for (const mesh::Animation& truth : context.scene.truths) print(truth.name, frames_of(truth));
  for (size_t k = 0; k < context.num_targets(); ++k) {
    for (const double weight : {0.25, 0.5, 0.75}) {
      print(absl::StrFormat("%s at %g", context.scene.inputs[k + 1].name, weight),
            context.BlendAt(context.Only(k, weight)));
    }
  }
}

const char* NameOf(mesh::Grade grade) {
  switch (grade) {
    case mesh::Grade::kGood:
      return "good";
    case mesh::Grade::kDoubtful:
      return "doubtful";
    case mesh::Grade::kTooDifferent:
      return "too different";
    case mesh::Grade::kUnknown:
      break;
  }
  return "not graded";
}

void PrintCosts(const Context& context) {
  const Costs& costs = context.registered.costs();
  context.out << absl::StrFormat(
      "\n| cost | space-time meshes (s) | registration (s) | peak (MB) | nodes |\n"
      "| --- | --- | --- | --- | --- |\n| %d threads | %.1f | ",
      context.arena.num_threads(), costs.build_s);
  for (size_t k = 0; k < costs.registration_s.size(); ++k) {
    context.out << absl::StrFormat("%s%.1f", k == 0 ? "" : ", ", costs.registration_s[k]);
  }
  context.out << absl::StrFormat(" | %.0f |", costs.peak_mb);
  for (const mesh::FamilyTarget& target : context.registered.family().targets) {
    context.out << absl::StrFormat(" %d", target.report.num_nodes);
  }
  context.out << " |\n\n";
  for (const mesh::FamilyTarget& target : context.registered.family().targets) {
    const mesh::Verdict& verdict = target.report.verdict;
    context.out << absl::StrFormat(
        "%s to %s is %s: %s; worst at (%.2f, %.2f, %.2f) m, frame %.0f\n\n",
        context.scene.inputs[0].name, target.name, NameOf(verdict.grade), verdict.reason,
        verdict.worst[0], verdict.worst[1], verdict.worst[2], verdict.worst[3] + 1);
    context.out << absl::StrFormat(
        "Relief lost between: %.1f %%. Detached parts between: %.2f diameters off, volumes %.1f "
        "%%, "
        "falls %.1f %%. Components: %.2f.\n\n",
        100 * verdict.relief_loss, verdict.part_shift, 100 * verdict.part_volume_error,
        100 * verdict.part_fall_error, verdict.component_error);
  }
  for (const mesh::FamilyTarget& target : context.registered.family().targets) {
    for (const mesh::Hypothesis& tried : target.report.hypotheses) {
      context.out << absl::StrFormat("%s: tried %s: cost %.2f%s.\n\n", target.name, tried.pairing,
                                     tried.cost, tried.is_kept ? ", kept" : "");
    }
  }
  const mesh::RegisteredFamily& family = context.registered.family();
  context.out << "Times blend " << (family.rest_time_s ? "as squares" : "linearly")
              << (family.time_blending_reason.empty() ? "" : ": " + family.time_blending_reason)
              << ".\n\n";
}

}  // namespace

Comparison PrintReport(const Scene& scene, const RegisteredScene& registered,
                       const ReportOptions& options, const parallel::Arena& arena,
                       std::ostream& out) {
  const int num_frames = registered.family().num_frames;
  const Context context{scene,
                        registered,
                        {num_frames, scene.num_early_frames, options.distance_step},
                        {num_frames, scene.num_early_frames, options.fold_step},
                        options.each_frame,
                        arena,
                        out};
  out << "### " << scene.name << "\n";
  PrintCosts(context);
  const Comparison comparison = PrintDistances(context);
  PrintFolds(context);
  PrintVolumes(context);
  PrintEvents(context);
  out << "\n";
  return comparison;
}

}  // namespace liquidblend::accuracy
