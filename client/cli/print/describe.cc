#include "client/cli/print/describe.h"

#include <string>
#include <vector>

#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "absl/strings/str_join.h"
#include "absl/strings/str_replace.h"
#include "client/cli/files/correspondences.h"
#include "client/cli/flags/clean_text.h"
#include "client/cli/print/json.h"
#include "client/cli/print/progress_bar.h"
#include "client/cli/print/wait.h"

namespace liquidblend::cli {
namespace {

std::string Describe(const Bounds& bounds) {
  return absl::StrFormat("(%.4g, %.4g, %.4g) to (%.4g, %.4g, %.4g) m", bounds.min.x, bounds.min.y,
                         bounds.min.z, bounds.max.x, bounds.max.y, bounds.max.z);
}

std::string DescribeNames(const std::vector<std::string>& names) {
  return CleanLine(absl::StrJoin(names, ", "));
}

std::string DescribeUp(Up up) { return up == Up::kUnknown ? "z (assumed)" : NameOf(up); }

// The kinds that there are, e.g. "1200 wedges, 40 pyramids".
std::string DescribeCells(const SpaceTimeReport& report) {
  std::vector<std::string> kinds;
  const auto add = [&](int64_t count, const char* kind) {
    if (count > 0) kinds.push_back(absl::StrCat(count, " ", kind));
  };
  add(report.num_hexahedra, "hexahedra");
  add(report.num_wedges, "wedges");
  add(report.num_pyramids, "pyramids");
  add(report.num_tetrahedra, "tetrahedra");
  return absl::StrJoin(kinds, ", ");
}

std::string Describe(const SpaceTimeReport& report) {
  std::string text =
      absl::StrFormat("%s: %s", CleanLine(report.animation), ConnectivityName(report.connectivity));
  if (report.grid_spacing_m > 0) {
    absl::StrAppendFormat(&text, " on a grid of %.4g m (%.3g mean edges)", report.grid_spacing_m,
                          report.grid_spacing_edges);
  }
  absl::StrAppendFormat(&text, ", %d vertices, %s, %d droplets in %d pieces, %.1f %% thin",
                        report.num_vertices, DescribeCells(report), report.num_droplets,
                        report.num_rigid_pieces, 100.0 * report.thin_share);
  const Fidelity& fidelity = report.fidelity;
  absl::StrAppendFormat(
      &text,
      "\n    %d frames: distance %.4f mean edges, %.3f at most; volume within %.3f %%; "
      "%d components of %d, %d apart at most",
      fidelity.num_frames, fidelity.mean_distance_edges, fidelity.max_distance_edges,
      100.0 * fidelity.max_volume_error, fidelity.num_components_shown, fidelity.num_components,
      fidelity.max_component_error);
  return text;
}

std::string Describe(size_t index, const CorrespondenceReport& report) {
  const Correspondence& c = report.correspondence;
  const Vector3& at = c.source.position;
  std::string text = absl::StrFormat(
      "%d: %s %s at (%.4g, %.4g, %.4g) m, %.4g s: %s, residual %.4g m, %.3f frames, %d nodes",
      index, c.hard ? "hard" : "soft", KindName(c.kind), at.x, at.y, at.z, c.source.time_s,
      report.kept ? "kept" : "overruled", report.residual_m, report.residual_frames,
      report.num_nodes);
  if (report.automatic) absl::StrAppendFormat(&text, ", automatic (%.2f)", report.confidence);
  return text;
}

// "covered share 93 %", "component error 0.5"
std::string DescribeFigure(const std::string& name, double value) {
  const bool is_share = absl::EndsWith(name, "_share");
  return absl::StrFormat("%s %.3g%s", absl::StrReplaceAll(name, {{"_", " "}}),
                         is_share ? 100.0 * value : value, is_share ? " %" : "");
}

// Without the lists of figures, which --json prints.
std::string Describe(const Verdict& verdict) {
  const Event& worst = verdict.worst;
  std::vector<std::string> figures;
  for (const auto& [name, value] : verdict.figures) figures.push_back(DescribeFigure(name, value));
  return absl::StrFormat("%s: %s; worst near (%.3g, %.3g, %.3g) m at %.3g s\n    %s",
                         GradeName(verdict.grade), CleanLine(verdict.reason), worst.position.x,
                         worst.position.y, worst.position.z, worst.time_s,
                         absl::StrJoin(figures, ", "));
}

std::string Describe(const Hypothesis& tried) {
  return absl::StrFormat("tried %s: cost %.3g%s", CleanLine(tried.pairing), tried.cost,
                         tried.is_kept ? ", kept" : "");
}

// A line for each animation, if there are points in parameter space, and one if weights between
// them are smooth.
std::string DescribePoints(const Family& family) {
  const ParameterSpace& space = family.parameter_space;
  std::string text;
  for (size_t k = 0; k < space.points.size() && k <= family.targets.size(); ++k) {
    absl::StrAppend(&text, "\n  ", CleanLine(k == 0 ? family.source : family.targets[k - 1]),
                    " at");
    for (size_t i = 0; i < space.names.size() && i < space.points[k].size(); ++i) {
      absl::StrAppend(&text, i == 0 ? " " : ", ", CleanLine(space.names[i]), " ",
                      space.points[k][i]);
    }
  }
  if (space.interpolation == Interpolation::kSmooth) {
    absl::StrAppend(&text, "\n  weights between these points are interpolated smoothly");
  }
  return text;
}

// A line on how times blend, unless they do linearly because somebody asked for it.
std::string DescribeTimes(const TimeBlending& times) {
  const bool in_squares = times.kind == TimeBlending::Kind::kSquares;
  if (!in_squares && times.reason.empty()) return "";
  const std::string reason =
      times.reason.empty() ? "" : absl::StrCat(" (", CleanLine(times.reason), ")");
  if (!in_squares) return absl::StrCat("\n  times blend linearly", reason);
  return absl::StrFormat("\n  times blend as squares of those since %.4g s%s", times.rest_time_s,
                         reason);
}

// "cancelled at 2026-01-31T12:00:00Z", "failed at 2026-01-31T12:00:00Z: the reason"
std::string Describe(const FailedRegistration& failed) {
  const std::string time = FormatUtc(failed.end_time);
  if (absl::IsCancelled(failed.error)) return absl::StrCat("cancelled at ", time);
  return absl::StrCat("failed at ", time, ": ", CleanLine(failed.error.message()));
}

std::string DescribeUnpublished(const Family& family) {
  const std::string name = CleanLine(family.name);
  if (!family.failed_registration) return absl::StrCat(name, ": no version is finished yet");
  return absl::StrCat(name, ": no version; its registration ",
                      Describe(*family.failed_registration), "\n  ",
                      CleanLine(family.failed_registration->operation));
}

// Start, duration, worker and outcome of an operation that is done.
std::string DescribeCourse(const Operation& operation) {
  const Progress& progress = operation.progress;
  std::string text;
  if (progress.start_time && progress.end_time) {
    const double seconds = absl::ToDoubleSeconds(*progress.end_time - *progress.start_time);
    absl::StrAppendFormat(&text, ", began at %s, took %.1f s", FormatUtc(*progress.start_time),
                          seconds);
  } else if (progress.end_time) {
    absl::StrAppend(&text, ", ended at ", FormatUtc(*progress.end_time));
  }
  if (!progress.worker.empty()) absl::StrAppend(&text, ", worker ", progress.worker);
  if (operation.version > 0) absl::StrAppend(&text, ", version ", operation.version);
  if (operation.grade != Grade::kUnknown) {
    absl::StrAppend(&text, ", verdict ", GradeName(operation.grade));
  }
  return text;
}

}  // namespace

std::string Describe(const Animation& animation) {
  std::string text = absl::StrCat(CleanLine(animation.name), ": ", StateName(animation.state));
  if (!animation.error.ok()) absl::StrAppend(&text, ": ", CleanLine(animation.error.message()));
  if (animation.state != AnimationState::kReady) return text;
  absl::StrAppendFormat(
      &text,
      "\n  %d frames from number %d at %.4g per second"
      "\n  %d vertices, %d triangles, mean edge %.4g m"
      "\n  bounds %s, %s up"
      "\n  %s stored",
      animation.num_frames, animation.first_frame_number, animation.frames_per_second,
      animation.num_vertices, animation.num_triangles, animation.mean_edge_length_m,
      Describe(animation.bounds), DescribeUp(animation.up), FormatBytes(animation.size_bytes));
  for (const std::string& note : animation.notes)
    absl::StrAppend(&text, "\n  note: ", CleanLine(note));
  return text;
}

std::string Describe(const Family& family) {
  if (family.version == 0) return DescribeUnpublished(family);
  std::string text = absl::StrFormat(
      "%s: version %d%s\n  source %s\n  targets %s"
      "\n  %.4g s at %.4g frames per second"
      "\n  %d space-time vertices, %d cells"
      "\n  bounds %s, %s up"
      "\n  %s stored",
      CleanLine(family.name), family.version,
      family.restored_version == 0
          ? ""
          : absl::StrCat(", which is version ", family.restored_version, " again"),
      CleanLine(family.source), DescribeNames(family.targets), family.duration_s,
      family.frames_per_second, family.num_vertices, family.num_cells, Describe(family.bounds),
      DescribeUp(family.up), FormatBytes(family.size_bytes));
  if (family.failed_registration) {
    absl::StrAppend(&text, "\n  a newer registration ", Describe(*family.failed_registration), " (",
                    CleanLine(family.failed_registration->operation), ")");
  }
  for (const FamilyVersion& version : family.kept_versions) {
    absl::StrAppendFormat(&text, "\n  version %d is kept: %s -> %s, of %s, %s", version.version,
                          CleanLine(version.source), DescribeNames(version.targets),
                          FormatUtc(version.publish_time), FormatBytes(version.size_bytes));
  }
  for (size_t k = 0; k < family.coarser_levels.size(); ++k) {
    absl::StrAppendFormat(&text, "\n  level of detail %d: %d vertices, %d cells", k + 1,
                          family.coarser_levels[k].num_vertices,
                          family.coarser_levels[k].num_cells);
  }
  absl::StrAppend(&text, "\n  velocities ",
                  family.has_velocities ? "of the simulation" : "from the surface's motion only");
  absl::StrAppend(&text, DescribePoints(family));
  absl::StrAppend(&text, DescribeTimes(family.time_blending));
  for (const SpaceTimeReport& report : family.space_time_reports) {
    absl::StrAppend(&text, "\n  ", Describe(report));
  }
  for (const RegistrationReport& report : family.reports) {
    absl::StrAppendFormat(
        &text, "\n  %s: %d nodes, %d iterations, residual %.3f mean edges, inliers %.0f %%, %.1f s",
        CleanLine(report.target), report.num_nodes, report.num_iterations,
        report.mean_residual_edges, 100.0 * report.inlier_share, report.seconds);
    for (size_t n = 0; n < report.correspondences.size(); ++n) {
      absl::StrAppend(&text, "\n    ", Describe(n, report.correspondences[n]));
    }
    for (const Hypothesis& tried : report.hypotheses) {
      absl::StrAppend(&text, "\n    ", Describe(tried));
    }
    if (report.verdict.grade != Grade::kUnknown) {
      absl::StrAppend(&text, "\n    ", Describe(report.verdict));
    }
  }
  return text;
}

std::string Describe(const MeshStats& stats) {
  std::string text = absl::StrFormat("  %d vertices, %d triangles, %d components, mean edge %.4g m",
                                     stats.num_vertices, stats.num_triangles, stats.num_components,
                                     stats.mean_edge_length_m);
  if (stats.closed()) {
    absl::StrAppendFormat(&text, "\n  closed and oriented; volume %.6g m^3, area %.6g m^2",
                          stats.volume_m3, stats.area_m2);
  } else {
    absl::StrAppendFormat(&text, "\n  NOT closed: %d odd edges, %d misoriented edges",
                          stats.num_odd_edges, stats.num_misoriented_edges);
  }
  return absl::StrCat(text, "\n  bounds ", Describe(stats.bounds));
}

std::string Summarize(const Animation& animation) {
  if (animation.state != AnimationState::kReady) {
    return absl::StrFormat("%-32s %s", CleanLine(animation.name), StateName(animation.state));
  }
  return absl::StrFormat("%-32s %d frames at %.4g per second, %d triangles, %s",
                         CleanLine(animation.name), animation.num_frames,
                         animation.frames_per_second, animation.num_triangles,
                         FormatBytes(animation.size_bytes));
}

std::string Summarize(const Family& family) {
  const std::string failed =
      family.failed_registration ? Describe(*family.failed_registration) : "";
  if (family.version == 0) {
    return absl::StrFormat("%-32s %s", CleanLine(family.name),
                           failed.empty() ? "no version is finished yet" : failed);
  }
  return absl::StrFormat("%-32s version %d, %s -> %s, %.4g s, %s%s", CleanLine(family.name),
                         family.version, CleanLine(family.source), DescribeNames(family.targets),
                         family.duration_s, FormatBytes(family.size_bytes),
                         failed.empty() ? "" : absl::StrCat("; a newer registration ", failed));
}

std::string Summarize(const Operation& operation) {
  std::string text =
      absl::StrFormat("%-32s %-9s %s", operation.name, StateName(operation), operation.subject);
  if (!operation.done) {
    absl::StrAppendFormat(&text, ", %.0f %%, %s", 100.0 * operation.progress.fraction,
                          DescribeProgress(operation.progress));
  }
  if (operation.done) absl::StrAppend(&text, DescribeCourse(operation));
  if (!operation.result.ok()) absl::StrAppend(&text, ": ", operation.result.message());
  return CleanLine(text);
}

}  // namespace liquidblend::cli
