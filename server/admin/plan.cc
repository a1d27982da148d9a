#include "server/admin/plan.h"

#include <algorithm>
#include <cmath>

#include "absl/strings/str_cat.h"

namespace liquidblend::admin {
namespace {

// docs/capacity.md has the measurements that these are fitted to.
// Servers: core time to make a frame (preset FASTEST), and to answer a call.
constexpr double kMakeMs = 0.5;
constexpr double kMakeMsPerVertex = 2.3e-4;
constexpr double kAnswerMs = 0.25;
constexpr double kAnswerMsPerByte = 0.6e-6;
constexpr double kRestingCores = 0.02;  // of a server that answers few calls
// Bytes of a frame on the wire per vertex: finer surfaces have smaller differences.
constexpr double kBytesPerVertex = 3.5;  // with kCoarseVertices
constexpr double kCoarseVertices = 5000;
constexpr double kBytesLessPerDoubling = 0.36;
constexpr double kLeastBytesPerVertex = 1.0;
constexpr double kServerBytes = 120e6;
constexpr double kFrameCacheBytes = 256e6;  // --frame-cache
constexpr double kIndexShare = 1.1;         // of a family in memory by its file
constexpr double kClientBytes = 100e3;

// Workers and files, per vertex of all frames of an animation. Those of registrations are for
// frames of kUsualVertices and grow with the frames' resolution.
constexpr double kAnimationBytesPerVertex = 48;  // exact: positions, velocities, triangles
constexpr double kFamilyBytesPerVertex = 130;
constexpr double kTargetBytesPerVertex = 67;
constexpr double kSourceMsPerVertex = 0.005;
constexpr double kTargetMsPerVertex = 0.055;
constexpr double kUsualVertices = 7000;
constexpr double kGrowth = 0.1;  // exponent
// server/api/job_memory.cc: what a worker must have to be given the job, not what it uses.
constexpr double kWorkerBytes = 100e6;
constexpr double kWorkerBytesPerVertex = 1120;

// The catalog, per record; a job is kept for 30 days (--keep-history).
constexpr double kDatabaseBytes = 10e6;
constexpr double kRecordBytes = 4e3;
constexpr double kHistoryDays = 30;

constexpr double kSecondsPerDay = 86'400;

// At least one, if there is anything to do.
int64_t CoresFor(double busy) { return static_cast<int64_t>(std::ceil(busy / kBusyShare)); }

int64_t Bytes(double bytes) { return static_cast<int64_t>(std::ceil(bytes)); }

double Growth(const Load& load) { return std::pow(load.vertices / kUsualVertices, kGrowth); }

void PlanFiles(const Load& load, double frame_vertices, Plan& plan) {
  const double family_bytes_per_vertex =
      kFamilyBytesPerVertex + kTargetBytesPerVertex * static_cast<double>(load.targets);
  plan.animation_bytes = Bytes(kAnimationBytesPerVertex * frame_vertices);
  plan.family_bytes = Bytes(family_bytes_per_vertex * Growth(load) * frame_vertices);
}

double FrameBytes(double vertices) {
  const double doublings = std::log2(vertices / kCoarseVertices);
  return vertices *
         std::max(kLeastBytesPerVertex, kBytesPerVertex - kBytesLessPerDoubling * doublings);
}

void PlanServers(const Load& load, Plan& plan) {
  const double frames_per_s = static_cast<double>(load.clients) * load.frames_per_second;
  const double frame_bytes = FrameBytes(load.vertices);
  const double answer_ms = (kAnswerMs + kAnswerMsPerByte * frame_bytes) / load.core_speed;
  const double make_ms = (kMakeMs + kMakeMsPerVertex * load.vertices) / load.core_speed;
  plan.frame_ms = make_ms + answer_ms;
  if (frames_per_s > 0) {
    plan.server_busy_cores = kRestingCores / load.core_speed +
                             frames_per_s * ((1 - load.cached) * make_ms + answer_ms) / 1e3;
  }
  plan.server_cores = CoresFor(plan.server_busy_cores);
  plan.network_bytes_per_s = frames_per_s * frame_bytes;
  const int64_t asked = load.families_in_use > 0 ? load.families_in_use : load.families;
  const auto in_use = static_cast<double>(std::min(asked, load.families));
  plan.cache_disk_bytes = Bytes(in_use * static_cast<double>(plan.family_bytes));
  plan.server_memory_bytes =
      Bytes(kServerBytes + kFrameCacheBytes + kClientBytes * static_cast<double>(load.clients) +
            kIndexShare * static_cast<double>(plan.cache_disk_bytes));
}

void PlanWorkers(const Load& load, double frame_vertices, Plan& plan) {
  const double ms_per_vertex =
      kSourceMsPerVertex + kTargetMsPerVertex * static_cast<double>(load.targets);
  plan.registration_core_s = ms_per_vertex * Growth(load) * frame_vertices / 1e3 / load.core_speed;
  plan.worker_busy_cores = load.registrations_per_day * plan.registration_core_s / kSecondsPerDay;
  plan.worker_cores = CoresFor(plan.worker_busy_cores);
  plan.worker_memory_bytes = Bytes(kWorkerBytes + kWorkerBytesPerVertex * frame_vertices);
}

void PlanStores(const Load& load, Plan& plan) {
  const auto families = static_cast<double>(load.families);
  const double animations = families * static_cast<double>(load.targets + 1);
  plan.bucket_bytes = Bytes(families * static_cast<double>(plan.family_bytes) +
                            animations * static_cast<double>(plan.animation_bytes));
  const double jobs =
      kHistoryDays * load.registrations_per_day * static_cast<double>(load.targets + 2);
  plan.database_bytes = Bytes(kDatabaseBytes + kRecordBytes * (families + animations + jobs));
}

absl::Status OutOfRange(const char* field, double value) {
  return absl::InvalidArgumentError(absl::StrCat(field, " is out of range: ", value));
}

}  // namespace

absl::Status Load::Validate() const {
  const auto is_positive = [](double value) { return value > 0 && std::isfinite(value); };
  const auto is_amount = [](double value) { return value >= 0 && std::isfinite(value); };
  if (!is_positive(vertices)) return OutOfRange("vertices", vertices);
  if (frames <= 0) return OutOfRange("frames", static_cast<double>(frames));
  if (targets < 1 || targets > 16) return OutOfRange("targets", static_cast<double>(targets));
  if (families < 0) return OutOfRange("families", static_cast<double>(families));
  if (families_in_use < 0) {
    return OutOfRange("families_in_use", static_cast<double>(families_in_use));
  }
  if (clients < 0) return OutOfRange("clients", static_cast<double>(clients));
  if (!is_amount(frames_per_second)) return OutOfRange("frames_per_second", frames_per_second);
  if (!is_amount(cached) || cached > 1) return OutOfRange("cached", cached);
  if (!is_amount(registrations_per_day)) {
    return OutOfRange("registrations_per_day", registrations_per_day);
  }
  if (!is_positive(core_speed)) return OutOfRange("core_speed", core_speed);
  return absl::OkStatus();
}

Plan MakePlan(const Load& load) {
  const double frame_vertices = load.vertices * static_cast<double>(load.frames);
  Plan plan;
  PlanFiles(load, frame_vertices, plan);
  PlanServers(load, plan);
  PlanWorkers(load, frame_vertices, plan);
  PlanStores(load, plan);
  return plan;
}

}  // namespace liquidblend::admin
