#include "server/api/api_messages.h"

#include <algorithm>
#include <vector>

#include "absl/time/clock.h"
#include "absl/time/time.h"
#include "core/base/status_macros.h"
#include "server/api/job_memory.h"
#include "server/api/part_progress.h"
#include "server/base/names.h"

namespace liquidblend::server {
namespace {

using google::longrunning::Operation;
using store::pb::JobRecord;

// A job that is queued for longer than this is told why.
constexpr absl::Duration kWorkerPatience = absl::Seconds(15);

void SetVector(const google::protobuf::RepeatedField<float>& from, v1::Vector3* to) {
  if (from.size() != 3) return;
  to->set_x(from[0]);
  to->set_y(from[1]);
  to->set_z(from[2]);
}

void SetBounds(const store::pb::Box& box, v1::Bounds* bounds) {
  SetVector(box.min(), bounds->mutable_min());
  SetVector(box.max(), bounds->mutable_max());
}

v1::Event ToEvent(const google::protobuf::RepeatedField<double>& from) {
  v1::Event event;
  if (from.size() != 4) return event;
  event.mutable_position()->set_x(from[0]);
  event.mutable_position()->set_y(from[1]);
  event.mutable_position()->set_z(from[2]);
  event.set_time_s(from[3]);
  return event;
}

v1::CorrespondenceReport ToReport(const store::pb::CorrespondenceReport& record) {
  v1::CorrespondenceReport report;
  const store::pb::Correspondence& from = record.correspondence();
  v1::Correspondence& to = *report.mutable_correspondence();
  to.set_kind(static_cast<v1::Correspondence::Kind>(from.kind()));  // the same numbers
  to.set_hard(from.hard());
  *to.mutable_source() = ToEvent(from.source());
  *to.mutable_target() = ToEvent(from.target());
  to.set_length_s(from.length_s());
  report.set_outcome(record.overruled() ? v1::CorrespondenceReport::OVERRULED
                                        : v1::CorrespondenceReport::KEPT);
  report.set_residual_m(record.residual_m());
  report.set_residual_frames(record.residual_frames());
  report.set_num_nodes(record.num_nodes());
  report.set_automatic(record.automatic());
  report.set_confidence(record.confidence());
  return report;
}

v1::Verdict ToVerdict(const store::pb::Verdict& record, double frames_per_second) {
  v1::Verdict verdict;
  verdict.set_grade(static_cast<v1::Verdict::Grade>(record.grade()));  // the same numbers
  verdict.set_reason(record.reason());
  if (record.worst_size() == 4 && frames_per_second > 0) {
    v1::Vector3& position = *verdict.mutable_worst()->mutable_position();
    position.set_x(record.worst(0));
    position.set_y(record.worst(1));
    position.set_z(record.worst(2));
    verdict.mutable_worst()->set_time_s(record.worst(3) / frames_per_second);
  }
  verdict.set_fit_energy(record.fit_energy());
  verdict.set_smoothness_energy(record.smoothness_energy());
  *verdict.mutable_residual_histogram() = record.residual_histogram();
  verdict.set_compatible_share(record.compatible_share());
  verdict.set_covered_share(record.covered_share());
  verdict.set_unmatched_share(record.unmatched_share());
  verdict.set_component_error(record.component_error());
  verdict.set_stretch(record.stretch());
  verdict.set_inverted_share(record.inverted_share());
  *verdict.mutable_volume_errors() = record.volume_errors();
  return verdict;
}

v1::RegistrationReport ToReport(const store::pb::RegistrationReport& record,
                                double frames_per_second) {
  v1::RegistrationReport report;
  report.set_target(AnimationName(record.target()));
  report.set_num_nodes(record.num_nodes());
  report.set_num_iterations(record.num_iterations());
  report.set_mean_residual_edges(record.mean_residual_edges());
  report.set_inlier_share(record.inlier_share());
  report.set_seconds(record.seconds());
  for (const store::pb::CorrespondenceReport& correspondence : record.correspondences()) {
    *report.add_correspondences() = ToReport(correspondence);
  }
  if (record.has_verdict()) {
    *report.mutable_verdict() = ToVerdict(record.verdict(), frames_per_second);
  }
  return report;
}

v1::Fidelity ToFidelity(const store::pb::Fidelity& record) {
  v1::Fidelity fidelity;
  fidelity.set_num_frames(record.num_frames());
  fidelity.set_mean_distance_edges(record.mean_distance_edges());
  fidelity.set_max_distance_edges(record.max_distance_edges());
  fidelity.set_max_volume_error(record.max_volume_error());
  fidelity.set_num_components(record.num_components());
  fidelity.set_num_components_shown(record.num_components_shown());
  fidelity.set_max_component_error(record.max_component_error());
  return fidelity;
}

v1::SpaceTimeReport ToReport(const std::string& animation,
                             const store::pb::SpaceTimeReport& record) {
  v1::SpaceTimeReport report;
  report.set_animation(AnimationName(animation));
  report.set_connectivity(
      static_cast<v1::Connectivity>(record.connectivity()));  // the same numbers
  report.set_grid_spacing_m(record.grid_spacing_m());
  if (record.edge_length_m() > 0) {
    report.set_grid_spacing_edges(record.grid_spacing_m() / record.edge_length_m());
  }
  report.set_edge_length_m(record.edge_length_m());
  report.set_num_vertices(record.num_vertices());
  report.set_num_tetrahedra(record.num_tetrahedra());
  report.set_num_pyramids(record.num_pyramids());
  report.set_num_wedges(record.num_wedges());
  report.set_num_hexahedra(record.num_hexahedra());
  report.set_num_droplets(record.num_droplets());
  report.set_num_rigid_pieces(record.num_rigid_pieces());
  report.set_thin_share(record.thin_share());
  *report.mutable_fidelity() = ToFidelity(record.fidelity());
  return report;
}

bool IsQueued(const JobRecord& job) {
  return job.state() == JobRecord::QUEUED ||
         (job.state() == JobRecord::WAITING && job.progress().stage().empty());
}

bool IsDone(const JobRecord& job) {
  return job.state() == JobRecord::SUCCEEDED || job.state() == JobRecord::FAILED ||
         job.state() == JobRecord::CANCELLED;
}

v1::Progress ToProgress(const JobRecord& job, const std::string& waiting_for) {
  const store::pb::JobProgress& from = job.progress();
  v1::Progress to;
  to.set_waiting_for(waiting_for);
  to.set_stage(IsQueued(job) ? "queued" : from.stage());
  to.set_fraction(job.state() == JobRecord::SUCCEEDED ? 1.0 : from.fraction());
  to.set_target_index(from.target_index());
  to.set_iteration(from.iteration());
  to.set_num_iterations(from.num_iterations());
  to.set_fit_energy(from.fit_energy());
  to.set_smoothness_energy(from.smoothness_energy());
  to.set_num_inliers(from.num_inliers());
  to.set_num_samples(from.num_samples());
  to.set_seconds_elapsed(from.seconds_elapsed());
  to.set_seconds_left(from.seconds_left());
  to.set_attempt(job.attempts() + job.environment_failures());
  to.set_worker(job.worker());
  to.set_priority(job.priority());
  to.set_memory_bytes(job.memory_bytes());
  if (job.has_next_attempt_time()) *to.mutable_next_attempt_time() = job.next_attempt_time();
  if (job.has_first_start_time()) *to.mutable_start_time() = job.first_start_time();
  if (IsDone(job)) *to.mutable_end_time() = job.update_time();
  if (!job.failed_attempts().empty()) {
    *to.mutable_last_failure() = job.failed_attempts().rbegin()->error();
  }
  return to;
}

absl::StatusOr<v1::Animation> ResultAnimation(const std::string& id, store::Catalog& catalog) {
  absl::StatusOr<store::pb::AnimationRecord> record = catalog.GetAnimation(id);
  if (record.ok()) return ToAnimation(*record);
  if (!absl::IsNotFound(record.status())) return record.status();
  v1::Animation deleted;
  deleted.set_name(AnimationName(id));
  return deleted;
}

absl::StatusOr<v1::Family> ResultFamily(const std::string& id, store::Catalog& catalog) {
  absl::StatusOr<store::pb::FamilyRecord> record = catalog.GetFamily(id);
  if (record.ok()) return ToFamily(*record);
  if (!absl::IsNotFound(record.status())) return record.status();
  v1::Family deleted;
  deleted.set_name(FamilyName(id));
  return deleted;
}

void PackMetadata(const JobRecord& job, const std::string& waiting_for, Operation& operation) {
  if (job.has_import_animation()) {
    v1::ImportAnimationMetadata metadata;
    metadata.set_animation(AnimationName(job.import_animation().animation()));
    *metadata.mutable_progress() = ToProgress(job, waiting_for);
    operation.mutable_metadata()->PackFrom(metadata);
  } else {
    v1::RegisterFamilyMetadata metadata;
    metadata.set_family(FamilyName(job.register_family().family()));
    metadata.set_version(job.published_version());
    metadata.set_grade(static_cast<v1::Verdict::Grade>(job.grade()));  // the same numbers
    *metadata.mutable_progress() = ToProgress(job, waiting_for);
    operation.mutable_metadata()->PackFrom(metadata);
  }
}

absl::Status PackResponse(const JobRecord& job, store::Catalog& catalog, Operation& operation) {
  if (job.has_import_animation()) {
    LB_ASSIGN_OR_RETURN(const v1::Animation animation,
                        ResultAnimation(job.import_animation().animation(), catalog));
    operation.mutable_response()->PackFrom(animation);
  } else {
    LB_ASSIGN_OR_RETURN(const v1::Family family,
                        ResultFamily(job.register_family().family(), catalog));
    operation.mutable_response()->PackFrom(family);
  }
  return absl::OkStatus();
}

// The job with the progress of its parts.
absl::StatusOr<JobRecord> WithParts(const JobRecord& job, store::Catalog& catalog) {
  const bool has_parts = job.register_family().targets_size() > 1;
  if (!has_parts || IsDone(job) || !job.progress().stage().empty()) return job;
  LB_ASSIGN_OR_RETURN(const std::vector<JobRecord> parts, catalog.ListParts(job.id()));
  if (!parts.empty()) return WithProgressOf(parts, job);
  absl::StatusOr<JobRecord> ended = catalog.GetJob(job.id());  // since `job` was read
  if (absl::IsNotFound(ended.status())) return job;
  return ended;
}

// Of a job that nobody has taken for a while since it could be; else empty.
absl::StatusOr<std::string> WaitingFor(const JobRecord& job, WorkerList& workers) {
  const int64_t since_s = std::max(job.update_time().seconds(), job.next_attempt_time().seconds());
  const bool is_left = absl::Now() - absl::FromUnixSeconds(since_s) >= kWorkerPatience;
  if (!IsQueued(job) || !is_left) return std::string();
  LB_ASSIGN_OR_RETURN(const std::vector<store::pb::WorkerRecord>* asked, workers.Get());
  return WaitsFor(job, *asked);
}

void SetError(const JobRecord& job, Operation& operation) {
  *operation.mutable_error() = job.error();
  if (job.error().code() != 0) return;
  const bool is_cancelled = job.state() == JobRecord::CANCELLED;
  const absl::Status error = is_cancelled ? absl::CancelledError("cancelled on request")
                                          : absl::UnknownError("failed without a message");
  operation.mutable_error()->set_code(static_cast<int>(error.code()));
  operation.mutable_error()->set_message(std::string(error.message()));
}

void AddEvent(const v1::Event& event, google::protobuf::RepeatedField<double>* to) {
  to->Add(event.position().x());
  to->Add(event.position().y());
  to->Add(event.position().z());
  to->Add(event.time_s());
}

}  // namespace

v1::Animation ToAnimation(const store::pb::AnimationRecord& record) {
  const store::pb::AnimationManifest& manifest = record.manifest();
  v1::Animation animation;
  animation.set_name(AnimationName(record.id()));
  animation.set_state(static_cast<v1::Animation::State>(record.state()));  // the same numbers
  if (record.has_error()) *animation.mutable_error() = record.error();
  animation.set_num_frames(manifest.num_frames());
  animation.set_first_frame_number(manifest.first_frame_number());
  animation.set_frames_per_second(manifest.frames_per_second());
  animation.set_up(static_cast<v1::Up>(manifest.up()));  // the same numbers
  animation.set_mean_edge_length_m(manifest.mean_edge_length_m());
  animation.set_num_vertices(record.num_vertices());
  animation.set_num_triangles(record.num_triangles());
  if (manifest.has_bounds()) SetBounds(manifest.bounds(), animation.mutable_bounds());
  animation.set_size_bytes(record.size_bytes());
  *animation.mutable_notes() = manifest.notes();
  *animation.mutable_create_time() = record.create_time();
  return animation;
}

v1::FamilyVersion ToFamilyVersion(const store::pb::FamilyRecord& record) {
  v1::FamilyVersion version;
  version.set_version(record.version());
  const store::pb::FamilyManifest& manifest = record.manifest();
  version.set_source(AnimationName(manifest.source()));
  for (const std::string& target : manifest.targets()) version.add_targets(AnimationName(target));
  version.set_size_bytes(record.size_bytes());
  *version.mutable_publish_time() = record.update_time();
  return version;
}

v1::Family ToFamily(const store::pb::FamilyRecord& record) {
  const store::pb::FamilyManifest& manifest = record.manifest();
  v1::Family family;
  family.set_name(FamilyName(record.id()));
  family.set_version(record.version());
  family.set_restored_version(record.restored_version());
  if (record.has_failed_registration()) {
    const store::pb::FailedRegistration& failed = record.failed_registration();
    family.mutable_failed_registration()->set_operation(OperationName(failed.job()));
    *family.mutable_failed_registration()->mutable_error() = failed.error();
    *family.mutable_failed_registration()->mutable_end_time() = failed.end_time();
  }
  if (!manifest.source().empty()) family.set_source(AnimationName(manifest.source()));
  for (const std::string& target : manifest.targets()) family.add_targets(AnimationName(target));
  if (manifest.frames_per_second() > 0) {
    family.set_duration_s((manifest.num_frames() - 1) / manifest.frames_per_second());
  }
  family.set_frames_per_second(manifest.frames_per_second());
  if (manifest.has_domain()) SetBounds(manifest.domain(), family.mutable_bounds());
  family.set_num_vertices(record.num_vertices());
  family.set_num_cells(record.num_cells());
  for (const auto& report : manifest.reports()) {
    *family.add_reports() = ToReport(report, manifest.frames_per_second());
  }
  family.set_size_bytes(record.size_bytes());
  family.set_has_velocities(manifest.has_velocities());
  for (const store::pb::FamilyLevel& level : manifest.coarser_levels()) {
    v1::LevelOfDetail& to = *family.add_coarser_levels();
    to.set_num_vertices(level.num_vertices());
    to.set_num_cells(level.num_cells());
  }
  // The manifest has none, or the source's and one per target.
  const int num_reports = std::min(manifest.space_time_reports_size(), 1 + manifest.targets_size());
  for (int k = 0; k < num_reports; ++k) {
    const std::string& animation = k == 0 ? manifest.source() : manifest.targets(k - 1);
    *family.add_space_time_reports() = ToReport(animation, manifest.space_time_reports(k));
  }
  if (manifest.has_parameter_space()) {
    *family.mutable_parameter_space() = ToParameterSpace(manifest.parameter_space());
  }
  *family.mutable_time_blending() = ToTimeBlending(manifest);
  family.set_up(static_cast<v1::Up>(manifest.up()));  // the same numbers
  *family.mutable_create_time() = record.create_time();
  *family.mutable_update_time() = record.update_time();
  return family;
}

v1::TimeBlending ToTimeBlending(const store::pb::FamilyManifest& manifest) {
  v1::TimeBlending blending;
  blending.set_kind(manifest.has_rest_time_s() ? v1::TimeBlending::SQUARES
                                               : v1::TimeBlending::LINEAR);
  blending.set_rest_time_s(manifest.rest_time_s());
  return blending;
}

v1::ParameterSpace ToParameterSpace(const store::pb::ParameterSpace& record) {
  v1::ParameterSpace space;
  *space.mutable_names() = record.names();
  for (const store::pb::ParameterPoint& point : record.points()) {
    *space.add_points()->mutable_values() = point.values();
  }
  return space;
}

absl::StatusOr<const std::vector<store::pb::WorkerRecord>*> WorkerList::Get() {
  if (!workers_.has_value()) {
    LB_ASSIGN_OR_RETURN(workers_, catalog_.ListWorkers());
  }
  return &*workers_;
}

absl::StatusOr<Operation> ToOperation(const JobRecord& record, store::Catalog& catalog) {
  WorkerList workers(catalog);
  return ToOperation(record, catalog, workers);
}

absl::StatusOr<Operation> ToOperation(const JobRecord& record, store::Catalog& catalog,
                                      WorkerList& workers) {
  LB_ASSIGN_OR_RETURN(const JobRecord job, WithParts(record, catalog));
  Operation operation;
  operation.set_name(OperationName(job.id()));
  LB_ASSIGN_OR_RETURN(const std::string waiting_for, WaitingFor(job, workers));
  PackMetadata(job, waiting_for, operation);
  operation.set_done(IsDone(job));
  if (job.state() == JobRecord::SUCCEEDED) {
    LB_RETURN_IF_ERROR(PackResponse(job, catalog, operation));
  } else if (operation.done()) {
    SetError(job, operation);
  }
  return operation;
}

store::pb::ImportOptions ToRecord(const v1::ImportOptions& options) {
  store::pb::ImportOptions record;
  record.set_format(static_cast<store::pb::ImportOptions::Format>(options.format()));
  record.set_frames_per_second(options.frames_per_second());
  record.set_vertex_scale(options.vertex_scale());
  record.set_velocity_scale(options.velocity_scale());
  record.set_voxel_size_m(options.voxel_size_m());
  record.set_allow_gaps(options.allow_gaps());
  *record.mutable_frame_times() = options.frame_times();
  record.set_up(static_cast<store::pb::Up>(options.up()));  // the same numbers
  record.set_pattern(options.pattern());
  return record;
}

store::pb::RegistrationOptions ToRecord(const v1::RegistrationOptions& options) {
  store::pb::RegistrationOptions record;
  record.set_max_iterations(options.max_iterations());
  record.set_node_spacing_edges(options.node_spacing_edges());
  record.set_sample_share(options.sample_share());
  record.set_seed(options.seed());
  record.set_final_smoothness(options.final_smoothness());
  record.set_thin_sheets_from(options.thin_sheets_from());
  if (options.has_automatic_correspondences()) {
    record.set_automatic_correspondences(options.automatic_correspondences());
  }
  return record;
}

store::pb::SpaceTimeOptions ToRecord(const v1::SpaceTimeOptions& options) {
  store::pb::SpaceTimeOptions record;
  record.set_connectivity(static_cast<store::pb::Connectivity>(options.connectivity()));
  record.set_spacing_edges(options.spacing_edges());
  if (options.has_droplet_vertices()) record.set_droplet_vertices(options.droplet_vertices());
  if (options.has_sheet_thickness_edges()) {
    record.set_sheet_thickness_edges(options.sheet_thickness_edges());
  }
  if (options.has_coarser_levels()) record.set_coarser_levels(options.coarser_levels());
  if (options.has_keep_thin_sheets()) record.set_keep_thin_sheets(options.keep_thin_sheets());
  return record;
}

store::pb::ParameterSpace ToRecord(const v1::ParameterSpace& space) {
  store::pb::ParameterSpace record;
  *record.mutable_names() = space.names();
  for (const v1::ParameterPoint& point : space.points()) {
    *record.add_points()->mutable_values() = point.values();
  }
  return record;
}

store::pb::Correspondence ToRecord(const v1::Correspondence& correspondence) {
  store::pb::Correspondence record;
  record.set_kind(static_cast<store::pb::Correspondence::Kind>(correspondence.kind()));
  record.set_hard(correspondence.hard());
  AddEvent(correspondence.source(), record.mutable_source());
  AddEvent(correspondence.target(), record.mutable_target());
  record.set_length_s(correspondence.length_s());
  return record;
}

}  // namespace liquidblend::server
