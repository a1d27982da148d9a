#include "server/admin/print.h"

#include <nlohmann/json.hpp>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "absl/strings/str_join.h"
#include "core/store/catalog/job_records.h"
#include "server/admin/progress.h"

namespace liquidblend::admin {
namespace {

using Json = nlohmann::ordered_json;

// Names and messages may hold bytes that are no UTF-8: they become U+FFFD.
std::string Line(const Json& json) {
  return json.dump(-1, ' ', false, Json::error_handler_t::replace) + "\n";
}

std::string Text(absl::string_view text) { return std::string(text); }

std::string UtcOf(absl::Time time) {
  return absl::FormatTime("%Y-%m-%dT%H:%M:%SZ", time, absl::UTCTimeZone());
}

// Whole seconds, negative ones too: clocks differ.
std::string FormatAge(absl::Duration age) {
  return absl::FormatDuration(absl::Trunc(age, absl::Seconds(1)));
}

std::string ErrorText(const google::rpc::Status& error) {
  const auto code = static_cast<absl::StatusCode>(error.code());
  return absl::StrCat(absl::StatusCodeToString(code), ": ", error.message());
}

Json JsonOf(const store::pb::JobRecord& job) {
  Json json = {{"job", job.id()},
               {"subject", store::SubjectOf(job)},
               {"state", StateName(job.state())},
               {"submitted", UtcOf(store::ToTime(job.create_time()))},
               {"attempts", job.attempts()},
               {"worker", job.worker()},
               {"stage", job.progress().stage()},
               {"fraction", job.progress().fraction()},
               {"cancel_requested", job.cancel_requested()}};
  if (!job.parent().empty()) json["parent"] = job.parent();
  if (job.has_error()) json["error"] = ErrorText(job.error());
  return json;
}

std::string TextOf(const store::pb::JobRecord& job, absl::Time now) {
  std::string line = absl::StrFormat("%-9s %-12s %-32s %s", StateName(job.state()),
                                     FormatAge(now - store::ToTime(job.create_time())), job.id(),
                                     store::SubjectOf(job));
  if (job.attempts() > 0) absl::StrAppend(&line, ", attempt ", job.attempts());
  if (!job.worker().empty()) absl::StrAppend(&line, ", on ", job.worker());
  if (job.cancel_requested()) absl::StrAppend(&line, ", to be cancelled");
  if (job.has_error()) absl::StrAppend(&line, "\n          ", ErrorText(job.error()));
  return line + "\n";
}

Json JsonOf(const Damage& damage) {
  return {{"blob", damage.blob},
          {"error", Text(damage.error.message())},
          {"is_missing", absl::IsNotFound(damage.error)},
          {"needed_by", damage.needed_by},
          {"repair", damage.repair}};
}

std::string TextOf(const Damage& damage) {
  std::string text = absl::StrCat("DAMAGED ", Text(damage.error.message()), "\n");
  if (!damage.blob.empty()) {
    absl::StrAppend(&text, "  needed by ",
                    damage.needed_by.empty() ? "nothing" : absl::StrJoin(damage.needed_by, ", "),
                    "\n");
  }
  if (!damage.repair.empty()) absl::StrAppend(&text, "  ", damage.repair, "\n");
  return text;
}

Json JsonOf(const Worker& worker) {
  Json held = Json::array();
  for (const HeldWork& work : worker.work) {
    held.push_back({{"job", work.job},
                    {"subject", work.subject},
                    {"stage", work.stage},
                    {"fraction", work.fraction},
                    {"since", UtcOf(work.since)},
                    {"last_heartbeat", UtcOf(work.last_heartbeat)},
                    {"lease_expires", UtcOf(work.lease_expires)}});
  }
  return {{"worker", worker.name},
          {"last_seen", UtcOf(worker.last_seen)},
          {"memory_bytes", worker.memory_bytes},
          {"refusal", worker.refusal},
          {"work", held}};
}

// A line for each job that it holds, or one.
std::string TextOf(const Worker& worker, absl::Time now) {
  const std::string seen =
      absl::StrCat("seen ", FormatAge(now - worker.last_seen), " ago",
                   worker.memory_bytes == 0                   ? ""
                   : worker.memory_bytes == store::kAnyMemory ? ", takes any job"
                                                              : ", takes jobs up to ",
                   worker.memory_bytes == 0 || worker.memory_bytes == store::kAnyMemory
                       ? ""
                       : FormatBytes(worker.memory_bytes));
  if (!worker.refusal.empty() && worker.work.empty()) {
    return absl::StrFormat("%-28s takes no jobs for now, %s: %s\n", worker.name, seen,
                           worker.refusal);
  }
  if (worker.work.empty()) return absl::StrFormat("%-28s idle, %s\n", worker.name, seen);
  std::string text;
  for (const HeldWork& work : worker.work) {
    absl::StrAppend(
        &text,
        absl::StrFormat("%-28s %-32s %s, %.0f %% of it, %s, for %s, heartbeat %s ago%s; %s\n",
                        worker.name, work.job, work.subject, 100 * work.fraction,
                        work.stage.empty() ? "starting" : work.stage, FormatAge(now - work.since),
                        FormatAge(now - work.last_heartbeat),
                        work.lease_expires < now ? ", lease has expired" : "", seen));
  }
  return text;
}

}  // namespace

std::string Print(const CheckReport& report, Format format) {
  if (format == Format::kJson) {
    Json damage = Json::array();
    for (const Damage& item : report.damage) damage.push_back(JsonOf(item));
    return Line({{"blobs", report.num_blobs},
                 {"bytes", report.num_bytes},
                 {"animations", report.num_animations},
                 {"families", report.num_families},
                 {"jobs", report.num_jobs},
                 {"unreferenced_blobs", report.num_unreferenced},
                 {"unreferenced_bytes", report.unreferenced_bytes},
                 {"readable_again", report.repaired},
                 {"damage", damage}});
  }
  std::string text;
  for (const Damage& item : report.damage) text += TextOf(item);
  for (const std::string& name : report.repaired) {
    absl::StrAppend(&text, name, " is readable again\n");
  }
  absl::StrAppend(&text, report.num_animations, " animations, ", report.num_families, " families, ",
                  report.num_jobs, " jobs; ", report.num_blobs, " blobs, ",
                  FormatBytes(report.num_bytes), "\n");
  absl::StrAppend(&text, report.num_unreferenced, " blobs that nothing refers to, ",
                  FormatBytes(report.unreferenced_bytes), "\n");
  if (report.damage.empty()) return text + "no damage\n";
  return absl::StrCat(text, report.damage.size(), " damaged\n");
}

std::string Print(const CollectReport& report, bool dry_run, Format format) {
  if (format == Format::kJson) {
    return Line({{"unreferenced_blobs", report.num_unreferenced},
                 {"unreferenced_bytes", report.unreferenced_bytes},
                 {"deleted_blobs", report.num_deleted},
                 {"deleted_bytes", report.deleted_bytes},
                 {"pruned_jobs", report.num_pruned},
                 {"dry_run", dry_run}});
  }
  const char* const deleted = dry_run ? "would delete " : "deleted ";
  return absl::StrCat(report.num_unreferenced, " blobs that nothing refers to, ",
                      FormatBytes(report.unreferenced_bytes), "; ", deleted, report.num_deleted,
                      ", ", FormatBytes(report.deleted_bytes), "; ", deleted, report.num_pruned,
                      " jobs of the history\n");
}

std::string Print(const TransferReport& report, const std::string& action, Format format) {
  if (format == Format::kJson) {
    return Line({{"animations", report.num_animations},
                 {"families", report.num_families},
                 {"jobs", report.num_jobs},
                 {"copied_blobs", report.num_copied},
                 {"copied_bytes", report.copied_bytes},
                 {"skipped_blobs", report.num_skipped}});
  }
  return absl::StrCat(action, " ", report.num_animations, " animations, ", report.num_families,
                      " families, ", report.num_jobs, " jobs; copied ", report.num_copied,
                      " blobs, ", FormatBytes(report.copied_bytes), "; ", report.num_skipped,
                      " were there already\n");
}

std::string Print(const QueueReport& report, absl::Time now, Format format) {
  if (format == Format::kJson) {
    Json counts = Json::object();
    for (const auto& [state, count] : report.counts) counts[StateName(state)] = count;
    Json unfinished = Json::array();
    for (const store::HeldJob& held : report.unfinished) {
      Json job = JsonOf(held.job);
      if (held.lease_expires != absl::InfinitePast()) {
        job["lease_expires"] = UtcOf(held.lease_expires);
      }
      unfinished.push_back(std::move(job));
    }
    Json failed = Json::array();
    for (const auto& job : report.failed) failed.push_back(JsonOf(job));
    return Line({{"counts", counts}, {"unfinished", unfinished}, {"failed", failed}});
  }
  std::string text;
  for (const store::HeldJob& held : report.unfinished) text += TextOf(held.job, now);
  for (const auto& job : report.failed) text += TextOf(job, now);
  std::vector<std::string> counts;
  for (const auto& [state, count] : report.counts) {
    counts.push_back(absl::StrCat(count, " ", StateName(state)));
  }
  return absl::StrCat(text, counts.empty() ? "no jobs" : absl::StrJoin(counts, ", "), "\n");
}

std::string Print(const std::vector<Worker>& workers, absl::Time now, Format format) {
  if (format == Format::kJson) {
    Json list = Json::array();
    for (const Worker& worker : workers) list.push_back(JsonOf(worker));
    return Line({{"workers", list}});
  }
  std::string text;
  size_t num_idle = 0, num_refused = 0;
  for (const Worker& worker : workers) {
    if (worker.work.empty()) ++(worker.refusal.empty() ? num_idle : num_refused);
    text += TextOf(worker, now);
  }
  return absl::StrCat(text, workers.size() - num_idle - num_refused, " workers at work, ", num_idle,
                      " idle", num_refused == 0 ? "" : absl::StrCat(", ", num_refused, " refused"),
                      "\n");
}

std::string Print(const std::vector<store::OwnerUse>& owners, Format format) {
  Json list = Json::array();
  std::string text;
  for (const store::OwnerUse& use : owners) {
    list.push_back({{"owner", use.owner},
                    {"stored_bytes", use.stored_bytes},
                    {"queued_jobs", use.num_queued_jobs},
                    {"animations", use.num_animations},
                    {"families", use.num_families}});
    absl::StrAppend(
        &text,
        absl::StrFormat("%-28s %10s, %d animations, %d families, %d jobs not done\n",
                        use.owner.empty() ? "(nobody)" : use.owner, FormatBytes(use.stored_bytes),
                        use.num_animations, use.num_families, use.num_queued_jobs));
  }
  if (format == Format::kJson) return Line({{"owners", list}});
  return absl::StrCat(text, owners.size(), " owners\n");
}

std::string Print(const Plan& plan, Format format) {
  if (format == Format::kJson) {
    return Line({{"frame_ms", plan.frame_ms},
                 {"server_busy_cores", plan.server_busy_cores},
                 {"server_cores", plan.server_cores},
                 {"server_memory_bytes", plan.server_memory_bytes},
                 {"cache_disk_bytes", plan.cache_disk_bytes},
                 {"network_bytes_per_s", plan.network_bytes_per_s},
                 {"registration_core_s", plan.registration_core_s},
                 {"worker_busy_cores", plan.worker_busy_cores},
                 {"worker_cores", plan.worker_cores},
                 {"worker_memory_bytes", plan.worker_memory_bytes},
                 {"animation_bytes", plan.animation_bytes},
                 {"family_bytes", plan.family_bytes},
                 {"bucket_bytes", plan.bucket_bytes},
                 {"database_bytes", plan.database_bytes}});
  }
  return absl::StrFormat(
      "servers   %d cores, %.2f of them busy; a frame that is not cached takes %.1f ms of one\n"
      "          %s of memory and %s of disk (--cache) each\n"
      "          %s/s to clients\n"
      "workers   %d cores, %.2f of them busy; a family takes %.0f s of one\n"
      "          %s of memory for a job (--memory)\n"
      "bucket    %s: a family has %s, an animation %s\n"
      "database  %s\n",
      plan.server_cores, plan.server_busy_cores, plan.frame_ms,
      FormatBytes(plan.server_memory_bytes), FormatBytes(plan.cache_disk_bytes),
      FormatBytes(static_cast<int64_t>(plan.network_bytes_per_s)), plan.worker_cores,
      plan.worker_busy_cores, plan.registration_core_s, FormatBytes(plan.worker_memory_bytes),
      FormatBytes(plan.bucket_bytes), FormatBytes(plan.family_bytes),
      FormatBytes(plan.animation_bytes), FormatBytes(plan.database_bytes));
}

}  // namespace liquidblend::admin
