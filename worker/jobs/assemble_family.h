// Registrations -> the family that the server blends.
#pragma once

#include <Eigen/Geometry>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "core/mesh/registered_family.h"
#include "core/mesh/space_time_mesh.h"
#include "worker/registration/register.h"

namespace liquidblend::jobs {

struct RegisteredTarget {
  std::string name;
  mesh::SpaceTimeReport space_time;
  registration::Registration registration;
};

// A coarser mesh of the source, with the targets' registrations transferred to it.
struct FamilyLevel {
  mesh::SpaceTimeMesh mesh;
  std::vector<registration::Registration> targets;  // as many as the family's
};

// How the times of a family blend.
struct TimeBlending {
  std::optional<double> rest_time_s;  // squares of the times since then; none: linearly
  std::string reason = {};            // why, if nobody asked for it; else empty
};

// The time blending of a family of these targets that nobody asks for. Squares if the registrations
// of all targets found that liquid falls from rest, since the same time within 1.5 frames.
TimeBlending ChooseTimeBlending(const std::vector<RegisteredTarget>& targets,
                                double frames_per_second);

struct FamilyContents {
  std::string name;
  std::string source_name;
  mesh::ParameterSpace parameter_space;  // or empty
  TimeBlending time_blending;
  mesh::SpaceTimeMesh source;
  mesh::SpaceTimeReport source_report;
  std::vector<RegisteredTarget> targets;
  std::vector<FamilyLevel> coarser_levels;  // the finest first
  Eigen::AlignedBox3f bounds;               // of all frames of source and targets
};

// A view of the target, as an element of a family.
mesh::FamilyTarget ViewOf(const RegisteredTarget& target);

// A matrix whose columns are the elements.
Eigen::Matrix4Xf MatrixOf(std::span<const mesh::Float4> elements);
// A view on the matrix.
std::span<const mesh::Float4> ColumnsOf(const Eigen::Matrix4Xf& matrix);

// Assembles the family, which owns the contents, whose times are in frames. Its domain is the
// bounds, one edge length larger on every side; the space-time mesh deviates from the surface by a
// fraction of that.
// Errors: kInternal if the result does not pass Validate(), with the element at fault.
absl::StatusOr<mesh::RegisteredFamily> AssembleFamily(FamilyContents contents);

}  // namespace liquidblend::jobs
