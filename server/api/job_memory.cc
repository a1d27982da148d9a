#include "server/api/job_memory.h"

#include <algorithm>
#include <cmath>
#include <string>

#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "core/base/memory_limit.h"
#include "core/base/status_macros.h"
#include "core/mesh/option_ranges.h"
#include "server/base/errors.h"

namespace liquidblend::server {
namespace {

using store::v1::AnimationRecord;
using store::v1::WorkerRecord;

constexpr double kBaseBytes = 100e6;  // of any worker

// large-animations.md: 5.9 M space-time vertices of 4.2 M of frames, at the default spacing; of
// two_drops it is 0.9 instead of 1.4.
constexpr double kVerticesPerFrameVertex = 1.4;
// large-animations.md: peak 4.4 GB with 2 x 5.9 M vertices; registration-speed.md: 411 MB with
// 1.05 M.
constexpr double kBytesPerVertex = 400;
// Putting a family together: the source's mesh ("memory, per million vertices": 170 to 250 MB), and
// of each target what is moved and extrapolated, 4 floats each, twice: as read, and as written.
constexpr double kMeshBytesPerVertex = 250;
constexpr double kTargetBytesPerVertex = 64;
// Space-time grids: a bit for each point and layer. There are one or two layers a frame, and some
// forty are worked on at a time. But droplets need no grid, and bounds include those that fly far:
// a quarter is counted, so that no job is refused for them. Workers let jobs have four times the
// estimate, and refuse grids that do not fit into that.
constexpr double kLayersPerFrame = 0.5;
constexpr double kMoreLayers = 10;
constexpr double kMoreGridPoints = 5;  // along each axis
// Measuring slices: each of up to 64 at a time lists the cells that it cuts (core/mesh/slice_at.h).
constexpr double kBytesPerCutCell = 4;
constexpr double kMostSlices = 64;

// sanitizers-and-fuzzing.md: 15 to 21 bytes of memory for a byte of Mantaflow's, 1.3 to 6.4 of
// others.
// The files of frames are compressed once more when they are stored, a frame at a time.
constexpr double kBytesPerGzipByte = 24;
constexpr double kBytesPerFileByte = 8;

constexpr double kMostBytes = 0x1p62;  // of animations that nobody can register

int64_t ToBytes(double bytes) {
  return static_cast<int64_t>(std::min(std::ceil(bytes), kMostBytes));
}

// A hypersurface of space-time has the square as many vertices on a coarser grid; on a finer one
// the steps between frames are divided as well.
double VerticesOf(const AnimationRecord& animation, double spacing_edges) {
  const double finer = mesh::kDefaultSpacingEdges / spacing_edges;
  const double growth = finer > 1 ? finer * finer * finer : finer * finer;
  const double num_frame_vertices = static_cast<double>(animation.num_vertices());
  return kVerticesPerFrameVertex * num_frame_vertices * growth;
}

double SpacingOf(const store::v1::RegisterJob& job) {
  const double asked = job.space_time().spacing_edges();
  return asked > 0 ? asked : mesh::kDefaultSpacingEdges;
}

// 1 + 1/2 + 1/4 + ..., as far as there are levels.
double AllLevels(const store::v1::RegisterJob& job) {
  const store::v1::SpaceTimeOptions& options = job.space_time();
  const int num_coarser =
      options.has_coarser_levels() ? options.coarser_levels() : mesh::kDefaultCoarserLevels;
  return 2.0 - std::exp2(-std::max(0, num_coarser));
}

// Of the grid of an animation that is rebuilt; 0 if its bounds are not known.
double GridBytes(const AnimationRecord& animation, const store::v1::RegisterJob& job) {
  const store::v1::AnimationManifest& manifest = animation.manifest();
  const double spacing_m = SpacingOf(job) * manifest.mean_edge_length_m();
  const bool is_known =
      spacing_m > 0 && manifest.bounds().min_size() == 3 && manifest.bounds().max_size() == 3;
  if (!is_known || job.space_time().connectivity() == store::v1::TRACKED) return 0;
  double num_points = 1;
  for (int k = 0; k < 3; ++k) {
    const double extent_m =
        static_cast<double>(manifest.bounds().max(k)) - manifest.bounds().min(k);
    num_points *= kMoreGridPoints + std::max(0.0, extent_m) / spacing_m;
  }
  return num_points / 8 * (kMoreLayers + kLayersPerFrame * manifest.num_frames());
}

// Frames between successive frames, the most of all.
double LongestStep(const AnimationRecord& animation) {
  const auto& times = animation.manifest().times();
  double longest = 1;
  for (int k = 1; k < times.size(); ++k) longest = std::max(longest, times[k] - times[k - 1]);
  return longest;
}

// Of measuring slices, for each vertex: cells between two frames that lie far apart are cut by
// many.
double SliceBytesPerVertex(const AnimationRecord& animation) {
  return kBytesPerCutCell * (std::min(LongestStep(animation), kMostSlices) - 1);
}

absl::StatusOr<int64_t> MemoryOf(const store::v1::JobRecord& job, store::Catalog& catalog) {
  if (job.has_import_animation()) return MemoryToImport(job.import_animation());
  const store::v1::RegisterJob& registration = job.register_family();
  LB_ASSIGN_OR_RETURN(const AnimationRecord source, catalog.GetAnimation(registration.source()));
  std::vector<AnimationRecord> targets;
  for (const std::string& id : registration.targets()) {
    LB_ASSIGN_OR_RETURN(targets.emplace_back(), catalog.GetAnimation(id));
  }
  return MemoryToRegister(registration, source, targets);
}

bool CanHold(const std::vector<WorkerRecord>& workers, int64_t bytes) {
  return std::any_of(workers.begin(), workers.end(), [bytes](const WorkerRecord& worker) {
    return worker.memory_bytes() >= bytes;
  });
}

bool CanTake(const std::vector<WorkerRecord>& workers, int64_t bytes) {
  return std::any_of(workers.begin(), workers.end(), [bytes](const WorkerRecord& worker) {
    return worker.memory_bytes() >= bytes && worker.refusal().empty();
  });
}

}  // namespace

int64_t MemoryToImport(const store::v1::ImportJob& job) {
  double bytes = kBaseBytes;
  for (const store::v1::SourceFile& file : job.files()) {
    const double factor =
        absl::EndsWith(file.name(), ".gz") ? kBytesPerGzipByte : kBytesPerFileByte;
    bytes += factor * static_cast<double>(file.size_bytes());
  }
  return ToBytes(bytes);
}

int64_t MemoryToRegister(const store::v1::RegisterJob& job, const AnimationRecord& source,
                         const std::vector<AnimationRecord>& targets) {
  const double spacing = SpacingOf(job);
  const double num_source = VerticesOf(source, spacing);
  double num_largest = 0, largest_grid = 0, slice_bytes = SliceBytesPerVertex(source);
  for (const AnimationRecord& target : targets) {
    num_largest = std::max(num_largest, VerticesOf(target, spacing));
    largest_grid = std::max(largest_grid, GridBytes(target, job));
    slice_bytes = std::max(slice_bytes, SliceBytesPerVertex(target));
  }
  const double num_both = num_source + num_largest;
  const double to_build = GridBytes(source, job) + largest_grid + kMeshBytesPerVertex * num_both;
  const double to_register = (kBytesPerVertex + slice_bytes) * num_both;
  const double per_vertex =
      kMeshBytesPerVertex + kTargetBytesPerVertex * static_cast<double>(targets.size());
  const double to_assemble = AllLevels(job) * per_vertex * num_source;
  return ToBytes(kBaseBytes + std::max({to_build, to_register, to_assemble}));
}

absl::Status NoteMemory(store::Catalog& catalog, int64_t worker_memory_bytes,
                        store::v1::JobRecord& job) {
  const absl::StatusOr<int64_t> needed = MemoryOf(job, catalog);
  if (absl::IsNotFound(needed.status())) return absl::OkStatus();
  LB_RETURN_IF_ERROR(needed.status());
  job.set_memory_bytes(*needed);
  if (worker_memory_bytes == 0 || *needed <= worker_memory_bytes) return absl::OkStatus();
  LB_ASSIGN_OR_RETURN(const std::vector<WorkerRecord> workers, catalog.ListWorkers());
  if (CanHold(workers, *needed)) return absl::OkStatus();
  return WithReason(
      absl::ResourceExhaustedError(absl::StrCat("needs about ", base::FormatGibibytes(*needed),
                                                " of memory; the server's workers can hold ",
                                                base::FormatGibibytes(worker_memory_bytes))),
      "JOB_TOO_LARGE",
      {{"needed_bytes", absl::StrCat(*needed)},
       {"limit_bytes", absl::StrCat(worker_memory_bytes)}});
}

std::string WaitsFor(const store::v1::JobRecord& job, const std::vector<WorkerRecord>& workers) {
  if (workers.empty()) return "no worker has asked for work lately";
  if (CanTake(workers, job.memory_bytes())) return "";
  for (const WorkerRecord& worker : workers) {
    if (worker.memory_bytes() < job.memory_bytes()) continue;
    return absl::StrCat("workers take no jobs for now; ", worker.name(), ": ", worker.refusal());
  }
  return absl::StrCat("needs about ", base::FormatGibibytes(job.memory_bytes()),
                      " of memory; no worker that asked lately can hold it");
}

}  // namespace liquidblend::server
