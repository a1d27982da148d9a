#include "server/api/api_messages.h"

#include <algorithm>
#include <vector>

#include "absl/time/clock.h"
#include "absl/time/time.h"
#include "core/base/status_macros.h"
#include "core/store/catalog/job_records.h"
#include "core/store/files/copy_fields.h"
#include "core/trace/context.h"
#include "server/api/child_progress.h"
#include "server/api/job_memory.h"
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

// The conversions below fill what CopyFields() leaves: names, and events, which are lists of
// numbers in records.
void SetEvents(const store::pb::Correspondence& record, v1::Correspondence& correspondence) {
  *correspondence.mutable_source() = ToEvent(record.source());
  *correspondence.mutable_target() = ToEvent(record.target());
}

void SetWorst(const store::pb::Verdict& record, double frames_per_second, v1::Verdict& verdict) {
  if (record.worst_size() != 4 || !(frames_per_second > 0)) return;
  *verdict.mutable_worst() = ToEvent(record.worst());
  verdict.mutable_worst()->set_time_s(record.worst(3) / frames_per_second);
}

void Complete(const store::pb::RegistrationReport& record, double frames_per_second,
              v1::RegistrationReport& report) {
  report.set_target(AnimationName(record.target()));
  for (int n = 0; n < record.correspondences_size(); ++n) {
    v1::CorrespondenceReport& correspondence = *report.mutable_correspondences(n);
    SetEvents(record.correspondences(n).correspondence(), *correspondence.mutable_correspondence());
    correspondence.set_outcome(record.correspondences(n).overruled()
                                   ? v1::CorrespondenceReport::OVERRULED
                                   : v1::CorrespondenceReport::KEPT);
  }
  if (record.has_verdict()) {
    SetWorst(record.verdict(), frames_per_second, *report.mutable_verdict());
  }
}

void Complete(const std::string& animation, v1::SpaceTimeReport& report) {
  report.set_animation(AnimationName(animation));
  if (report.edge_length_m() > 0) {
    report.set_grid_spacing_edges(report.grid_spacing_m() / report.edge_length_m());
  }
  report.mutable_fidelity();  // never missing
}

// The manifest has no reports, or the source's and one per target.
void CompleteSpaceTimeReports(const store::pb::FamilyManifest& manifest, v1::Family& family) {
  auto& reports = *family.mutable_space_time_reports();
  const int num_reports = std::min(reports.size(), 1 + manifest.targets_size());
  reports.DeleteSubrange(num_reports, reports.size() - num_reports);
  for (int k = 0; k < num_reports; ++k) {
    Complete(k == 0 ? manifest.source() : manifest.targets(k - 1), reports[k]);
  }
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
  auto to = store::CopyOf<v1::Progress>(job.progress());
  to.set_waiting_for(waiting_for);
  if (IsQueued(job)) to.set_stage("queued");
  if (job.state() == JobRecord::SUCCEEDED) to.set_fraction(1.0);
  to.set_attempt(store::AttemptNumber(job));
  to.set_worker(job.worker());
  to.set_priority(job.priority());
  to.set_memory_bytes(job.memory_bytes());
  to.set_trace_id(trace::TraceIdOf(trace::ParseContext(job.traceparent())));
  to.set_handed_back(job.handed_back());
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

// The job with the progress of its children.
absl::StatusOr<JobRecord> WithChildren(const JobRecord& job, store::Catalog& catalog) {
  const bool has_children = job.register_family().targets_size() > 1;
  if (!has_children || IsDone(job) || !job.progress().stage().empty()) return job;
  LB_ASSIGN_OR_RETURN(const std::vector<JobRecord> children, catalog.ListChildren(job.id()));
  if (!children.empty()) return WithProgressOf(children, job);
  absl::StatusOr<JobRecord> ended = catalog.GetJob(job.id());  // since `job` was read
  if (absl::IsNotFound(ended.status())) return job;
  return ended;
}

// Of a job that workers hand back again and again, or that nobody has taken for a while since it
// could be; else empty.
absl::StatusOr<std::string> WaitingFor(const JobRecord& job, WorkerList& workers) {
  if (IsQueued(job) && job.handed_back_in_vain() > 1) {
    return absl::StrCat("was handed back ", job.handed_back_in_vain(),
                        " times in succession without a new checkpoint; its workers need more "
                        "time (--max-time, the farm's time limit)");
  }
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
  auto animation = store::CopyOf<v1::Animation>(record.manifest());
  store::CopyFields(record, animation);
  animation.set_name(AnimationName(record.id()));
  if (record.manifest().has_bounds()) {
    SetBounds(record.manifest().bounds(), animation.mutable_bounds());
  }
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
  auto family = store::CopyOf<v1::Family>(manifest);
  store::CopyFields(record, family);
  family.set_name(FamilyName(record.id()));
  if (record.has_failed_registration()) {
    family.mutable_failed_registration()->set_operation(
        OperationName(record.failed_registration().job()));
  }
  if (!manifest.source().empty()) family.set_source(AnimationName(manifest.source()));
  for (std::string& target : *family.mutable_targets()) target = AnimationName(target);
  if (manifest.frames_per_second() > 0) {
    family.set_duration_s((manifest.num_frames() - 1) / manifest.frames_per_second());
  }
  if (manifest.has_domain()) SetBounds(manifest.domain(), family.mutable_bounds());
  for (int k = 0; k < manifest.reports_size(); ++k) {
    Complete(manifest.reports(k), manifest.frames_per_second(), *family.mutable_reports(k));
  }
  CompleteSpaceTimeReports(manifest, family);
  *family.mutable_time_blending() = ToTimeBlending(manifest);
  if (manifest.has_parameter_space()) {
    *family.mutable_parameter_space() = ToParameterSpace(manifest.parameter_space());
  }
  return family;
}

v1::TimeBlending ToTimeBlending(const store::pb::FamilyManifest& manifest) {
  v1::TimeBlending blending;
  blending.set_kind(manifest.has_rest_time_s() ? v1::TimeBlending::SQUARES
                                               : v1::TimeBlending::LINEAR);
  blending.set_rest_time_s(manifest.rest_time_s());
  blending.set_reason(manifest.time_blending_reason());
  return blending;
}

v1::ParameterSpace ToParameterSpace(const store::pb::ParameterSpace& record) {
  auto space = store::CopyOf<v1::ParameterSpace>(record);
  if (space.interpolation() == v1::ParameterSpace::INTERPOLATION_UNSPECIFIED) {
    space.set_interpolation(v1::ParameterSpace::LINEAR);
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
  LB_ASSIGN_OR_RETURN(const JobRecord job, WithChildren(record, catalog));
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
  return store::CopyOf<store::pb::ImportOptions>(options);
}

store::pb::RegistrationOptions ToRecord(const v1::RegistrationOptions& options) {
  return store::CopyOf<store::pb::RegistrationOptions>(options);
}

store::pb::SpaceTimeOptions ToRecord(const v1::SpaceTimeOptions& options) {
  return store::CopyOf<store::pb::SpaceTimeOptions>(options);
}

store::pb::ParameterSpace ToRecord(const v1::ParameterSpace& space) {
  return store::CopyOf<store::pb::ParameterSpace>(space);
}

store::pb::Correspondence ToRecord(const v1::Correspondence& correspondence) {
  auto record = store::CopyOf<store::pb::Correspondence>(correspondence);
  AddEvent(correspondence.source(), record.mutable_source());
  AddEvent(correspondence.target(), record.mutable_target());
  return record;
}

}  // namespace liquidblend::server
