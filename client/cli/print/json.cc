#include "client/cli/print/json.h"

#include <string>

namespace liquidblend::cli {
namespace {

Json ToJson(const Vector3& v) { return Json::array({v.x, v.y, v.z}); }

Json ToJson(const absl::Status& status) {
  return {{"code", absl::StatusCodeToString(status.code())},
          {"message", std::string(status.message())}};
}

Json ToJson(const Progress& progress) {
  Json json = {{"stage", progress.stage},
               {"fraction", progress.fraction},
               {"targetIndex", progress.target_index},
               {"iteration", progress.iteration},
               {"numIterations", progress.num_iterations},
               {"fitEnergy", progress.fit_energy},
               {"smoothnessEnergy", progress.smoothness_energy},
               {"numInliers", progress.num_inliers},
               {"numSamples", progress.num_samples},
               {"secondsElapsed", progress.seconds_elapsed},
               {"secondsLeft", progress.seconds_left},
               {"attempt", progress.attempt},
               {"worker", progress.worker},
               {"priority", progress.priority},
               {"waitingFor", progress.waiting_for},
               {"memoryBytes", progress.memory_bytes},
               {"handedBack", progress.handed_back}};
  if (progress.next_attempt_time) {
    json["nextAttemptTime"] = FormatUtc(*progress.next_attempt_time);
  }
  if (progress.start_time) json["startTime"] = FormatUtc(*progress.start_time);
  if (progress.end_time) json["endTime"] = FormatUtc(*progress.end_time);
  if (!progress.last_failure.ok()) json["lastFailure"] = ToJson(progress.last_failure);
  if (!progress.trace_id.empty()) json["traceId"] = progress.trace_id;
  return json;
}

}  // namespace

std::string FormatUtc(absl::Time time) {
  return absl::FormatTime("%Y-%m-%dT%H:%M:%SZ", time, absl::UTCTimeZone());
}

Json ToJson(const Bounds& bounds) {
  return {{"min", ToJson(bounds.min)}, {"max", ToJson(bounds.max)}};
}

Json ToJson(const Animation& animation) { return Json::parse(animation.json); }

Json ToJson(const Family& family) { return Json::parse(family.json); }

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
