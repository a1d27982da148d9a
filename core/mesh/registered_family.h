// Registered family, the input of blending and slicing: one space-time mesh and a displacement of
// it per target.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "core/mesh/correspondence.h"
#include "core/mesh/parameter_space.h"
#include "core/mesh/space_time_mesh.h"
#include "core/mesh/space_time_report.h"
#include "core/mesh/time_axis.h"
#include "core/mesh/up.h"
#include "core/mesh/verdict.h"

namespace liquidblend::mesh {

// Coordinates of a family's vertices: three of space, or four of space-time.
using Float3 = std::array<float, 3>;
using Float4 = std::array<float, 4>;  // x, y, z in metres, t in ticks of the family's time axis

// Whether liquid that is detached in the first frames of both animations falls from rest, which
// decides how times blend unless the user does.
struct RestReport {
  bool is_from_rest = false;
  double time_frames = 0.0;  // when it was at rest, not positive; 0 if it does not fall from rest
  std::string reason = {};   // a clause: what shows it, or speaks against it; empty: not looked for
};

// Life of a part of the liquid that is detached in the target's first frame, and in the source's or
// in its pre-roll, to where it merges with the rest. Ends in frames since the first one; 0 for a
// part of the pre-roll.
struct PartLife {
  std::array<float, 3> source_start_m = {0, 0, 0};  // the part's centre in the first frame
  double source_end_frames = 0.0;
  double target_end_frames = 0.0;
};

// A way to pair the features of both animations that was tried.
struct Hypothesis {
  std::string pairing = {};  // a clause: what guided the registration
  // Loss of its blends at weights 0.25, 0.5, 0.75 and 1: the sum over the figures of the verdict of
  // their squares, each over its limit.
  double cost = 0.0;
  bool is_kept = false;
};

// Report of the registration of one target.
struct RegistrationReport {
  int num_nodes = 0;
  int num_iterations = 0;
  double mean_residual_edges = 0.0;  // mean distance of registered vertices to the target, in edges
  double inlier_share = 0.0;         // of the last iteration's samples
  double seconds = 0.0;
  std::vector<CorrespondenceReport> correspondences = {};  // one per correspondence, in their order
  Verdict verdict = {};
  RestReport rest = {};
  std::vector<PartLife> part_lives = {};
  std::vector<Hypothesis> hypotheses = {};  // in the order tried; none: there was no choice

  // Calls visit(name, figure) for each number, named as in both messages RegistrationReport.
  template <typename Self, typename Visit>
  static void ForEachFigure(Self& self, const Visit& visit) {
    visit("num_nodes", self.num_nodes);
    visit("num_iterations", self.num_iterations);
    visit("mean_residual_edges", self.mean_residual_edges);
    visit("inlier_share", self.inlier_share);
    visit("seconds", self.seconds);
  }
};

// One target of a family: its name, the displacement onto it, and the report of its registration.
// The displacement has one element per vertex of the family.
struct FamilyTarget {
  std::string name;
  // At weight w of this target a vertex moves by
  //   w * displacement                                  for 0 <= w <= 1
  //   displacement + (w - 1) * extrapolation            for w > 1
  //   w * extrapolation                                 for w < 0
  std::span<const Float4> displacement;
  std::span<const Float4> extrapolation;  // smoother; as many as displacement, or empty: the same
  RegistrationReport report;
};

// A read-only view of a registered family (equation 8), usually on a memory-mapped file.
// Threads: safe, immutable.
struct RegisteredFamily {
  std::shared_ptr<const void> storage;  // keeps alive what the spans view
  std::string name;
  int64_t version = 0;
  std::string source;
  std::span<const Float4> vertices;    // of the source's space-time mesh, in its order
  std::span<const Float3> velocities;  // of the source at its vertices, m/s; or empty: not known
  std::span<const Tetrahedron> tetrahedra;
  std::span<const Pyramid> pyramids;
  std::span<const Wedge> wedges;
  std::span<const Hexahedron> hexahedra;
  std::vector<FamilyTarget> targets;
  int64_t num_first_vertices = 0;  // as in SpaceTimeMesh: kept before frame 0 ...
  int64_t num_last_vertices = 0;   // ... and after the last frame, whatever the weights
  int num_frames = 0;
  int num_pre_roll = 0;  // frames made up before frame 0, which are never shown
  double frames_per_second = 24.0;
  Up up = Up::kUnknown;  // of the source
  // Times blend as squares of those since then, seconds since the first frame; none: linearly.
  std::optional<double> rest_time_s;
  std::string time_blending_reason;  // why, if the worker chose; empty: it was told
  double edge_length_m = 0.0;
  std::array<float, 3> domain_min = {0, 0, 0};  // blended vertices are clamped to this box
  std::array<float, 3> domain_max = {0, 0, 0};
  // Of the source's space-time mesh, then of each target's; or empty: not known.
  std::vector<SpaceTimeReport> space_time_reports;
  ParameterSpace parameter_space;  // or empty: the animations have no points
  // Coarser levels of detail, the finest first: the same animations, weights, frames and domain,
  // but fewer vertices and cells. Each without levels of its own; level of detail 0 is this family.
  std::vector<RegisteredFamily> coarser_levels;

  // The time from the first frame to the last one, seconds.
  double duration_s() const { return (num_frames - 1) / frames_per_second; }
  TimeAxis time_axis() const { return {rest_time_s, frames_per_second, num_frames, num_pre_roll}; }
  int64_t num_cells() const {
    return static_cast<int64_t>(tetrahedra.size() + pyramids.size() + wedges.size() +
                                hexahedra.size());
  }
};

// Checks the preconditions of the kernels: array sizes, indices in range, finite numbers, the end
// slabs' vertices outside of [0, num_frames - 1], a sane box, levels that belong to one another,
// points in parameter space. Errors: kInvalidArgument with the first offending element.  Cost:
// O(vertices + cells).
absl::Status Validate(const RegisteredFamily& family);

// A family without targets, which shows the source unchanged; `mesh` must outlive the view.
RegisteredFamily ViewOf(const SpaceTimeMesh& mesh);

}  // namespace liquidblend::mesh
