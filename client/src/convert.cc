#include "client/src/convert.h"

#include <google/protobuf/reflection.h>
#include <google/protobuf/util/json_util.h>

#include <cmath>
#include <string>
#include <utility>

#include "absl/strings/str_cat.h"
#include "client/src/reason.h"
#include "client/src/status.h"
#include "client/src/status_macros.h"
#include "google/rpc/error_details.pb.h"

namespace liquidblend::client {
namespace {

// Drops the details of other types than our servers send: they may hold others in turn, without
// end, and protobuf's JSON writer calls itself for each.
void KeepOwnDetails(google::rpc::Status* error) {
  google::protobuf::RepeatedPtrField<google::protobuf::Any> kept;
  for (const google::protobuf::Any& detail : error->details()) {
    if (detail.Is<google::rpc::ErrorInfo>() || detail.Is<google::rpc::BadRequest>() ||
        detail.Is<google::rpc::RetryInfo>()) {
      *kept.Add() = detail;
    }
  }
  error->mutable_details()->Swap(&kept);
}

// An object without fields if protobuf cannot write it.
std::string JsonOf(const google::protobuf::Message& proto) {
  std::string json;
  const auto status = google::protobuf::util::MessageToJsonString(proto, &json);
  return status.ok() ? json : "{}";
}

Vector3 ToVector(const v1::Vector3& proto) { return {proto.x(), proto.y(), proto.z()}; }

Bounds ToBounds(const v1::Bounds& proto) { return {ToVector(proto.min()), ToVector(proto.max())}; }

absl::Time ToTime(const google::protobuf::Timestamp& proto) {
  return absl::FromUnixSeconds(proto.seconds()) + absl::Nanoseconds(proto.nanos());
}

AnimationState ToState(v1::Animation::State state) {
  switch (state) {
    case v1::Animation::IMPORTING:
      return AnimationState::kImporting;
    case v1::Animation::READY:
      return AnimationState::kReady;
    case v1::Animation::FAILED:
      return AnimationState::kFailed;
    default:
      return AnimationState::kUnknown;
  }
}

Progress ToProgress(const v1::Progress& proto) {
  Progress progress;
  progress.stage = proto.stage();
  progress.fraction = proto.fraction();
  progress.target_index = proto.target_index();
  progress.iteration = proto.iteration();
  progress.num_iterations = proto.num_iterations();
  progress.fit_energy = proto.fit_energy();
  progress.smoothness_energy = proto.smoothness_energy();
  progress.num_inliers = proto.num_inliers();
  progress.num_samples = proto.num_samples();
  progress.seconds_elapsed = proto.seconds_elapsed();
  progress.seconds_left = proto.seconds_left();
  progress.attempt = proto.attempt();
  progress.worker = proto.worker();
  progress.priority = proto.priority();
  progress.waiting_for = proto.waiting_for();
  progress.memory_bytes = proto.memory_bytes();
  progress.handed_back = proto.handed_back();
  if (proto.has_next_attempt_time()) progress.next_attempt_time = ToTime(proto.next_attempt_time());
  if (proto.has_start_time()) progress.start_time = ToTime(proto.start_time());
  if (proto.has_end_time()) progress.end_time = ToTime(proto.end_time());
  if (proto.has_last_failure()) progress.last_failure = FromProto(proto.last_failure());
  progress.trace_id = proto.trace_id();
  return progress;
}

CorrespondenceKind ToKind(v1::Correspondence::Kind kind) {
  switch (kind) {
    case v1::Correspondence::TRAJECTORY:
      return CorrespondenceKind::kTrajectory;
    case v1::Correspondence::SPACE:
      return CorrespondenceKind::kSpace;
    default:
      return CorrespondenceKind::kPoint;
  }
}

CorrespondenceReport ToReport(const v1::CorrespondenceReport& proto) {
  CorrespondenceReport report;
  const v1::Correspondence& from = proto.correspondence();
  report.correspondence.kind = ToKind(from.kind());
  report.correspondence.hard = from.hard();
  report.correspondence.source = {ToVector(from.source().position()), from.source().time_s()};
  report.correspondence.target = {ToVector(from.target().position()), from.target().time_s()};
  report.correspondence.length_s = from.length_s();
  report.kept = proto.outcome() != v1::CorrespondenceReport::OVERRULED;
  report.residual_m = proto.residual_m();
  report.residual_frames = proto.residual_frames();
  report.num_nodes = proto.num_nodes();
  report.automatic = proto.automatic();
  if (report.automatic) report.confidence = proto.confidence();
  return report;
}

Grade ToGrade(v1::Verdict::Grade proto) {
  switch (proto) {
    case v1::Verdict::GOOD:
      return Grade::kGood;
    case v1::Verdict::DOUBTFUL:
      return Grade::kDoubtful;
    case v1::Verdict::TOO_DIFFERENT:
      return Grade::kTooDifferent;
    default:
      return Grade::kUnknown;
  }
}

// All fields that are numbers, so that a new figure needs no change here.
void ReadFigures(const v1::Verdict& proto, Verdict& verdict) {
  const google::protobuf::Reflection& reflection = *proto.GetReflection();
  for (int n = 0; n < proto.GetDescriptor()->field_count(); ++n) {
    const google::protobuf::FieldDescriptor* field = proto.GetDescriptor()->field(n);
    if (field->cpp_type() != google::protobuf::FieldDescriptor::CPPTYPE_DOUBLE) continue;
    if (field->is_repeated()) {
      const auto list = reflection.GetRepeatedFieldRef<double>(proto, field);
      verdict.lists[field->name()].assign(list.begin(), list.end());
    } else {
      verdict.figures[field->name()] = reflection.GetDouble(proto, field);
    }
  }
}

Verdict ToVerdict(const v1::Verdict& proto) {
  Verdict verdict;
  verdict.grade = ToGrade(proto.grade());
  verdict.reason = proto.reason();
  verdict.worst.position = ToVector(proto.worst().position());
  verdict.worst.time_s = proto.worst().time_s();
  ReadFigures(proto, verdict);
  return verdict;
}

RegistrationReport ToReport(const v1::RegistrationReport& proto) {
  RegistrationReport report;
  report.target = proto.target();
  report.num_nodes = proto.num_nodes();
  report.num_iterations = proto.num_iterations();
  report.mean_residual_edges = proto.mean_residual_edges();
  report.inlier_share = proto.inlier_share();
  report.seconds = proto.seconds();
  for (const v1::CorrespondenceReport& correspondence : proto.correspondences()) {
    report.correspondences.push_back(ToReport(correspondence));
  }
  if (proto.has_verdict()) report.verdict = ToVerdict(proto.verdict());
  for (const v1::Hypothesis& tried : proto.hypotheses()) {
    report.hypotheses.push_back({tried.pairing(), tried.cost(), tried.is_kept()});
  }
  return report;
}

Connectivity ToConnectivity(v1::Connectivity proto) {
  if (proto == v1::TRACKED) return Connectivity::kTracked;
  return proto == v1::REBUILT ? Connectivity::kRebuilt : Connectivity::kAuto;
}

Fidelity ToFidelity(const v1::Fidelity& proto) {
  Fidelity fidelity;
  fidelity.num_frames = proto.num_frames();
  fidelity.mean_distance_edges = proto.mean_distance_edges();
  fidelity.max_distance_edges = proto.max_distance_edges();
  fidelity.max_volume_error = proto.max_volume_error();
  fidelity.num_components = proto.num_components();
  fidelity.num_components_shown = proto.num_components_shown();
  fidelity.max_component_error = proto.max_component_error();
  return fidelity;
}

SpaceTimeReport ToReport(const v1::SpaceTimeReport& proto) {
  SpaceTimeReport report;
  report.animation = proto.animation();
  report.connectivity = ToConnectivity(proto.connectivity());
  report.grid_spacing_m = proto.grid_spacing_m();
  report.grid_spacing_edges = proto.grid_spacing_edges();
  report.edge_length_m = proto.edge_length_m();
  report.num_vertices = proto.num_vertices();
  report.num_tetrahedra = proto.num_tetrahedra();
  report.num_pyramids = proto.num_pyramids();
  report.num_wedges = proto.num_wedges();
  report.num_hexahedra = proto.num_hexahedra();
  report.num_droplets = proto.num_droplets();
  report.num_rigid_pieces = proto.num_rigid_pieces();
  report.thin_share = proto.thin_share();
  report.fidelity = ToFidelity(proto.fidelity());
  return report;
}

void ReadMetadata(const google::protobuf::Any& metadata, Operation* operation) {
  v1::ImportAnimationMetadata import;
  v1::RegisterFamilyMetadata registration;
  if (metadata.UnpackTo(&import)) {
    operation->subject = import.animation();
    operation->progress = ToProgress(import.progress());
  } else if (metadata.UnpackTo(&registration)) {
    operation->subject = registration.family();
    operation->version = registration.version();
    operation->grade = static_cast<Grade>(registration.grade());  // the same numbers
    operation->progress = ToProgress(registration.progress());
  }
}

absl::Status ReadResponse(const google::protobuf::Any& response, Operation* operation) {
  v1::Animation animation;
  v1::Family family;
  if (response.UnpackTo(&animation)) {
    LBC_ASSIGN_OR_RETURN(operation->animation, FromProto(animation));
  } else if (response.UnpackTo(&family)) {
    LBC_ASSIGN_OR_RETURN(operation->family, FromProto(family));
  }
  return absl::OkStatus();
}

// A number that loops and clocks count on: finite and not negative.
absl::Status CheckNumber(const std::string& resource, const char* what, double value) {
  if (std::isfinite(value) && value >= 0.0) return absl::OkStatus();
  return absl::DataLossError(
      absl::StrCat("the server's answer about ", resource, " has a ", what, " of ", value));
}

// Callers index points by animation and values by name.
absl::Status CheckPoints(const v1::Family& family) {
  const v1::ParameterSpace& space = family.parameter_space();
  if (space.points().empty() && space.names().empty()) return absl::OkStatus();
  const auto invalid = [&](int found, const char* what, int expected) {
    return absl::DataLossError(absl::StrCat("the server's answer about family '", family.name(),
                                            "' has ", found, what, expected));
  };
  if (space.points_size() != 1 + family.targets_size()) {
    return invalid(space.points_size(), " points, and its animations are ",
                   1 + family.targets_size());
  }
  for (const v1::ParameterPoint& point : space.points()) {
    if (point.values_size() == space.names_size()) continue;
    return invalid(point.values_size(), " values at a point, and its parameters are ",
                   space.names_size());
  }
  return absl::OkStatus();
}

ParameterSpace ToParameterSpace(const v1::ParameterSpace& proto) {
  ParameterSpace space;
  space.names.assign(proto.names().begin(), proto.names().end());
  for (const v1::ParameterPoint& point : proto.points()) {
    space.points.emplace_back(point.values().begin(), point.values().end());
  }
  if (v1::ParameterSpace::Interpolation_IsValid(proto.interpolation())) {
    space.interpolation = static_cast<Interpolation>(proto.interpolation());  // the same numbers
  }
  return space;
}

TimeBlending ToTimeBlending(const v1::TimeBlending& proto) {
  TimeBlending blending;
  if (v1::TimeBlending::Kind_IsValid(proto.kind())) {
    blending.kind = static_cast<TimeBlending::Kind>(proto.kind());  // the same numbers
  }
  blending.rest_time_s = proto.rest_time_s();
  blending.reason = proto.reason();
  return blending;
}

Up ToUp(v1::Up up) {
  return v1::Up_IsValid(up) ? static_cast<Up>(up) : Up::kUnknown;  // the same numbers
}

}  // namespace

absl::StatusOr<Animation> FromProto(const v1::Animation& proto) {
  LBC_RETURN_IF_ERROR(CheckNumber(proto.name(), "frame rate", proto.frames_per_second()));
  Animation animation;
  animation.name = proto.name();
  animation.state = ToState(proto.state());
  animation.error = FromProto(proto.error());
  animation.num_frames = proto.num_frames();
  animation.first_frame_number = proto.first_frame_number();
  animation.frames_per_second = proto.frames_per_second();
  animation.up = ToUp(proto.up());
  animation.mean_edge_length_m = proto.mean_edge_length_m();
  animation.num_vertices = proto.num_vertices();
  animation.num_triangles = proto.num_triangles();
  animation.bounds = ToBounds(proto.bounds());
  animation.size_bytes = proto.size_bytes();
  animation.notes.assign(proto.notes().begin(), proto.notes().end());
  animation.create_time = ToTime(proto.create_time());
  v1::Animation shown = proto;
  if (shown.has_error()) KeepOwnDetails(shown.mutable_error());
  animation.json = JsonOf(shown);
  return animation;
}

absl::StatusOr<Family> FromProto(const v1::Family& proto) {
  LBC_RETURN_IF_ERROR(CheckPoints(proto));
  LBC_RETURN_IF_ERROR(CheckNumber(proto.name(), "duration", proto.duration_s()));
  LBC_RETURN_IF_ERROR(CheckNumber(proto.name(), "frame rate", proto.frames_per_second()));
  Family family;
  family.name = proto.name();
  family.version = proto.version();
  family.source = proto.source();
  family.targets.assign(proto.targets().begin(), proto.targets().end());
  family.duration_s = proto.duration_s();
  family.frames_per_second = proto.frames_per_second();
  family.up = ToUp(proto.up());
  family.bounds = ToBounds(proto.bounds());
  family.num_vertices = proto.num_vertices();
  family.num_cells = proto.num_cells();
  for (const v1::LevelOfDetail& level : proto.coarser_levels()) {
    family.coarser_levels.push_back({level.num_vertices(), level.num_cells()});
  }
  family.has_velocities = proto.has_velocities();
  for (const v1::RegistrationReport& report : proto.reports()) {
    family.reports.push_back(ToReport(report));
  }
  for (const v1::SpaceTimeReport& report : proto.space_time_reports()) {
    family.space_time_reports.push_back(ToReport(report));
  }
  family.parameter_space = ToParameterSpace(proto.parameter_space());
  family.time_blending = ToTimeBlending(proto.time_blending());
  family.restored_version = proto.restored_version();
  if (proto.has_failed_registration()) {
    const v1::FailedRegistration& failed = proto.failed_registration();
    family.failed_registration = {failed.operation(), FromProto(failed.error()),
                                  ToTime(failed.end_time())};
  }
  for (const v1::FamilyVersion& version : proto.kept_versions()) {
    family.kept_versions.push_back({version.version(),
                                    version.source(),
                                    {version.targets().begin(), version.targets().end()},
                                    version.size_bytes(),
                                    ToTime(version.publish_time())});
  }
  family.size_bytes = proto.size_bytes();
  family.create_time = ToTime(proto.create_time());
  family.update_time = ToTime(proto.update_time());
  v1::Family shown = proto;
  if (shown.has_failed_registration()) {
    KeepOwnDetails(shown.mutable_failed_registration()->mutable_error());
  }
  family.json = JsonOf(shown);
  return family;
}

absl::StatusOr<Operation> FromProto(const google::longrunning::Operation& proto) {
  Operation operation;
  operation.name = proto.name();
  operation.done = proto.done();
  ReadMetadata(proto.metadata(), &operation);
  if (proto.has_error()) operation.result = FromProto(proto.error());
  operation.error_reason = ReasonOf(operation.result);
  if (proto.has_response()) LBC_RETURN_IF_ERROR(ReadResponse(proto.response(), &operation));
  return operation;
}

Frame FromProto(v1::Frame&& proto) {
  Frame frame;
  frame.data = std::move(*proto.mutable_data());
  frame.family = proto.family();
  frame.version = proto.version();
  frame.weights.assign(proto.weights().begin(), proto.weights().end());
  frame.extrapolated = proto.extrapolated();
  frame.clamped = proto.clamped();
  frame.time_s = proto.time_s();
  frame.num_vertices = proto.num_vertices();
  frame.num_triangles = proto.num_triangles();
  frame.bounds = ToBounds(proto.bounds());
  return frame;
}

}  // namespace liquidblend::client
