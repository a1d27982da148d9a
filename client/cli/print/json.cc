#include "client/cli/print/json.h"

#include <string>

#include "client/cli/files/correspondences.h"

namespace liquidblend::cli {
namespace {

Json ToJson(const Vector3& v) { return Json::array({v.x, v.y, v.z}); }

Json ToJson(const absl::Status& status) {
  return {{"code", absl::StatusCodeToString(status.code())},
          {"message", std::string(status.message())}};
}

Json ToJson(const Event& event) {
  const Vector3& at = event.position;
  return {{"position", {at.x, at.y, at.z}}, {"time_s", event.time_s}};
}

Json ToJson(const CorrespondenceReport& report) {
  return {{"kind", KindName(report.correspondence.kind)},
          {"hard", report.correspondence.hard},
          {"source", ToJson(report.correspondence.source)},
          {"target", ToJson(report.correspondence.target)},
          {"length_s", report.correspondence.length_s},
          {"kept", report.kept},
          {"residual_m", report.residual_m},
          {"residual_frames", report.residual_frames},
          {"num_nodes", report.num_nodes},
          {"automatic", report.automatic},
          {"confidence", report.confidence}};
}

Json ToJson(const Verdict& verdict) {
  Json json = {{"grade", GradeName(verdict.grade)},
               {"reason", verdict.reason},
               {"worst", ToJson(verdict.worst)}};
  for (const auto& [name, value] : verdict.figures) json[name] = value;
  for (const auto& [name, values] : verdict.lists) json[name] = values;
  return json;
}

Json ToJson(const RegistrationReport& report) {
  Json correspondences = Json::array();
  for (const CorrespondenceReport& correspondence : report.correspondences) {
    correspondences.push_back(ToJson(correspondence));
  }
  return {{"target", report.target},
          {"num_nodes", report.num_nodes},
          {"num_iterations", report.num_iterations},
          {"mean_residual_edges", report.mean_residual_edges},
          {"inlier_share", report.inlier_share},
          {"seconds", report.seconds},
          {"correspondences", correspondences},
          {"verdict", ToJson(report.verdict)}};
}

Json ToJson(const Fidelity& fidelity) {
  return {{"num_frames", fidelity.num_frames},
          {"mean_distance_edges", fidelity.mean_distance_edges},
          {"max_distance_edges", fidelity.max_distance_edges},
          {"max_volume_error", fidelity.max_volume_error},
          {"num_components", fidelity.num_components},
          {"num_components_shown", fidelity.num_components_shown},
          {"max_component_error", fidelity.max_component_error}};
}

Json ToJson(const SpaceTimeReport& report) {
  return {{"animation", report.animation},
          {"connectivity", ConnectivityName(report.connectivity)},
          {"grid_spacing_m", report.grid_spacing_m},
          {"grid_spacing_edges", report.grid_spacing_edges},
          {"edge_length_m", report.edge_length_m},
          {"num_vertices", report.num_vertices},
          {"num_tetrahedra", report.num_tetrahedra},
          {"num_pyramids", report.num_pyramids},
          {"num_wedges", report.num_wedges},
          {"num_hexahedra", report.num_hexahedra},
          {"num_droplets", report.num_droplets},
          {"num_rigid_pieces", report.num_rigid_pieces},
          {"thin_share", report.thin_share},
          {"fidelity", ToJson(report.fidelity)}};
}

Json ToJson(const Progress& progress) {
  Json json = {{"stage", progress.stage},
               {"fraction", progress.fraction},
               {"target_index", progress.target_index},
               {"iteration", progress.iteration},
               {"num_iterations", progress.num_iterations},
               {"fit_energy", progress.fit_energy},
               {"smoothness_energy", progress.smoothness_energy},
               {"num_inliers", progress.num_inliers},
               {"num_samples", progress.num_samples},
               {"seconds_elapsed", progress.seconds_elapsed},
               {"seconds_left", progress.seconds_left},
               {"attempt", progress.attempt},
               {"worker", progress.worker},
               {"priority", progress.priority},
               {"waiting_for", progress.waiting_for},
               {"memory_bytes", progress.memory_bytes}};
  if (progress.next_attempt_time) {
    json["next_attempt_time"] = FormatUtc(*progress.next_attempt_time);
  }
  if (progress.start_time) json["start_time"] = FormatUtc(*progress.start_time);
  if (progress.end_time) json["end_time"] = FormatUtc(*progress.end_time);
  if (!progress.last_failure.ok()) json["last_failure"] = ToJson(progress.last_failure);
  return json;
}

}  // namespace

Json ToJson(const TimeBlending& blending) {
  const bool is_squares = blending.kind == TimeBlending::Kind::kSquares;
  return {{"kind", is_squares ? "squares" : "linear"}, {"rest_time_s", blending.rest_time_s}};
}

std::string FormatUtc(absl::Time time) {
  return absl::FormatTime("%Y-%m-%dT%H:%M:%SZ", time, absl::UTCTimeZone());
}

Json ToJson(const Bounds& bounds) {
  return {{"min", ToJson(bounds.min)}, {"max", ToJson(bounds.max)}};
}

Json ToJson(const Animation& animation) {
  Json json = {{"name", animation.name},
               {"state", StateName(animation.state)},
               {"num_frames", animation.num_frames},
               {"first_frame_number", animation.first_frame_number},
               {"frames_per_second", animation.frames_per_second},
               {"up", NameOf(animation.up)},
               {"mean_edge_length_m", animation.mean_edge_length_m},
               {"num_vertices", animation.num_vertices},
               {"num_triangles", animation.num_triangles},
               {"bounds", ToJson(animation.bounds)},
               {"size_bytes", animation.size_bytes},
               {"notes", animation.notes},
               {"create_time", FormatUtc(animation.create_time)}};
  if (!animation.error.ok()) json["error"] = ToJson(animation.error);
  return json;
}

Json ToJson(const Family& family) {
  Json reports = Json::array();
  for (const RegistrationReport& report : family.reports) reports.push_back(ToJson(report));
  Json space_time_reports = Json::array();
  for (const SpaceTimeReport& report : family.space_time_reports) {
    space_time_reports.push_back(ToJson(report));
  }
  Json levels = Json::array();
  for (const LevelOfDetail& level : family.coarser_levels) {
    levels.push_back({{"num_vertices", level.num_vertices}, {"num_cells", level.num_cells}});
  }
  Json kept = Json::array();
  for (const FamilyVersion& version : family.kept_versions) {
    kept.push_back({{"version", version.version},
                    {"source", version.source},
                    {"targets", version.targets},
                    {"size_bytes", version.size_bytes},
                    {"publish_time", FormatUtc(version.publish_time)}});
  }
  Json json = {
      {"name", family.name},
      {"version", family.version},
      {"restored_version", family.restored_version},
      {"kept_versions", kept},
      {"source", family.source},
      {"targets", family.targets},
      {"duration_s", family.duration_s},
      {"frames_per_second", family.frames_per_second},
      {"bounds", ToJson(family.bounds)},
      {"up", NameOf(family.up)},
      {"num_vertices", family.num_vertices},
      {"num_cells", family.num_cells},
      {"coarser_levels", levels},
      {"has_velocities", family.has_velocities},
      {"reports", reports},
      {"space_time_reports", space_time_reports},
      {"parameter_space",
       {{"names", family.parameter_space.names}, {"points", family.parameter_space.points}}},
      {"time_blending", ToJson(family.time_blending)},
      {"size_bytes", family.size_bytes},
      {"create_time", FormatUtc(family.create_time)},
      {"update_time", FormatUtc(family.update_time)}};
  if (family.failed_registration) {
    const FailedRegistration& failed = *family.failed_registration;
    json["failed_registration"] = {{"operation", failed.operation},
                                   {"error", ToJson(failed.error)},
                                   {"end_time", FormatUtc(failed.end_time)}};
  }
  return json;
}

Json ToJson(const Operation& operation) {
  Json json = {{"name", operation.name},
               {"subject", operation.subject},
               {"state", StateName(operation)},
               {"done", operation.done},
               {"progress", ToJson(operation.progress)}};
  if (operation.version > 0) json["version"] = operation.version;
  if (operation.grade != Grade::kUnknown) json["verdict"] = GradeName(operation.grade);
  if (!operation.result.ok()) json["error"] = ToJson(operation.result);
  if (operation.animation) json["animation"] = ToJson(*operation.animation);
  if (operation.family) json["family"] = ToJson(*operation.family);
  return json;
}

Json ToJson(const MeshStats& stats) {
  return {{"num_vertices", stats.num_vertices},
          {"num_triangles", stats.num_triangles},
          {"num_components", stats.num_components},
          {"closed", stats.closed()},
          {"num_odd_edges", stats.num_odd_edges},
          {"num_misoriented_edges", stats.num_misoriented_edges},
          {"volume_m3", stats.volume_m3},
          {"area_m2", stats.area_m2},
          {"mean_edge_length_m", stats.mean_edge_length_m},
          {"bounds", ToJson(stats.bounds)}};
}

const char* StateName(AnimationState state) {
  switch (state) {
    case AnimationState::kImporting:
      return "importing";
    case AnimationState::kReady:
      return "ready";
    case AnimationState::kFailed:
      return "failed";
    case AnimationState::kUnknown:
      break;
  }
  return "unknown";
}

const char* GradeName(Grade grade) {
  switch (grade) {
    case Grade::kGood:
      return "good";
    case Grade::kDoubtful:
      return "doubtful";
    case Grade::kTooDifferent:
      return "too different";
    case Grade::kUnknown:
      break;
  }
  return "unknown";
}

const char* ConnectivityName(Connectivity connectivity) {
  switch (connectivity) {
    case Connectivity::kTracked:
      return "tracked";
    case Connectivity::kRebuilt:
      return "rebuilt";
    case Connectivity::kAuto:
      break;
  }
  return "unknown";
}

const char* StateName(const Operation& operation) {
  const Progress& progress = operation.progress;
  const bool is_queued = progress.attempt == 0 || progress.stage == "queued";
  if (!operation.done) return is_queued ? "queued" : "running";
  if (operation.result.ok()) return "done";
  return absl::IsCancelled(operation.result) ? "cancelled" : "failed";
}

}  // namespace liquidblend::cli
