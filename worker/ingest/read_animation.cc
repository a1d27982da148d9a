#include "worker/ingest/read_animation.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <utility>
#include <vector>

#include "absl/base/thread_annotations.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "absl/synchronization/mutex.h"
#include "core/base/data_limit.h"
#include "core/base/status_macros.h"
#include "core/mesh/animation_limits.h"
#include "core/mesh/option_ranges.h"
#include "worker/ingest/clean/clean.h"
#include "worker/ingest/formats/readers.h"
#include "worker/ingest/formats/text.h"
#include "worker/ingest/frame_files.h"
#include "worker/ingest/frame_times.h"
#include "worker/ingest/meta.h"

namespace liquidblend::ingest {
namespace {

constexpr double kDefaultFramesPerSecond = 24.0;
constexpr double kMantaflowUnitsPerSecond = 2.5;  // Mantaflow's time runs in these
constexpr float kLargest = 1e9f;  // metres or metres per second: squares stay finite

struct Units {
  double frames_per_second = kDefaultFramesPerSecond;
  double vertex_scale = 1.0;
  double velocity_scale = 0.0;  // 0: not known
  // Units that neither an option nor meta.json gives.
  bool assumes_rate = false;
  bool assumes_metres = false;
  bool assumes_velocities = false;  // to be in the unit of positions per second
};

struct Frame {
  mesh::TriangleMesh mesh;
  CleanCounts counts;
  std::string source;  // what was taken of the file; or empty
};

absl::Status WithContext(const absl::Status& status, const std::string& context) {
  const std::string message = absl::StrCat(context, ": ", std::string(status.message()));
  if (base::IsOverMemoryLimit(status)) return base::MemoryLimitError(message);
  return absl::Status(status.code(), message);
}

// The first of the values that is known, i.e. not 0.
double FirstKnown(std::initializer_list<double> values) {
  for (const double value : values) {
    if (value > 0) return value;
  }
  return 0.0;
}

absl::StatusOr<Meta> FindMeta(const FrameSequence& sequence) {
  if (sequence.meta == nullptr) return Meta();
  absl::StatusOr<Meta> meta = ReadMeta(sequence.meta->bytes);
  if (!meta.ok()) return WithContext(meta.status(), Escaped(*sequence.meta));
  return meta;
}

// The assumed units, in one sentence; or empty.
std::string AssumptionNote(const Units& units, bool has_velocities) {
  std::vector<std::string> assumed, flags;
  if (units.assumes_rate) {
    assumed.push_back(absl::StrCat(kDefaultFramesPerSecond, " frames per second"));
    flags.push_back("--fps");
  }
  if (units.assumes_metres) {
    assumed.push_back("positions in metres");
    flags.push_back("--vertex-scale");
  }
  if (units.assumes_velocities && has_velocities) {
    assumed.push_back("velocities in the unit of positions per second");
    flags.push_back("--velocity-scale");
  }
  if (assumed.empty()) return "";
  const std::string last = assumed.back();
  assumed.pop_back();
  return absl::StrCat("Assumed ", absl::StrJoin(assumed, ", "), assumed.empty() ? "" : " and ",
                      last, ", as neither options (", absl::StrJoin(flags, ", "),
                      ") nor a meta.json say so.");
}

// Which way is up, of those that say so the first.
mesh::Up FirstUp(std::initializer_list<mesh::Up> ups) {
  for (const mesh::Up up : ups) {
    if (up != mesh::Up::kUnknown) return up;
  }
  return mesh::Up::kUnknown;
}

// A sentence, if meta.json's gravity contradicts what else is given; or empty.
std::string GravityNote(mesh::Up up, const Meta& meta) {
  if (meta.up_against_gravity == mesh::Up::kUnknown || up == meta.up_against_gravity) return "";
  return absl::StrCat("Took ", mesh::NameOf(up), " as up, as given, although gravity in meta.json ",
                      "points against ", mesh::NameOf(meta.up_against_gravity), ".");
}

absl::StatusOr<Units> FindUnits(const FrameSequence& sequence, const Meta& meta,
                                const ImportOptions& options) {
  const bool is_mantaflow = sequence.format == Format::kMantaflow;
  const double per_voxel = is_mantaflow ? kMantaflowUnitsPerSecond : 0.0;
  Units units;
  const double rate = FirstKnown({options.frames_per_second, meta.frames_per_second});
  const double scale = FirstKnown(
      {options.vertex_scale, meta.vertex_scale, is_mantaflow ? meta.longest_side_m : 0.0});
  units.frames_per_second = FirstKnown({rate, kDefaultFramesPerSecond});
  units.vertex_scale = FirstKnown({scale, 1.0});
  if (scale == 0.0 && !meta.unit_of_vertices.empty()) {
    return absl::InvalidArgumentError(absl::StrCat(
        Escaped(*sequence.meta), ": units.vertices is ", meta.unit_of_vertices,
        ", not metres: give units.vertex_scale too, or --vertex-scale (metres per unit, 0.01 for "
        "centimetres)"));
  }
  const double velocity_scale =
      FirstKnown({options.velocity_scale, options.voxel_size_m * per_voxel, meta.velocity_scale,
                  meta.voxel_size_m * per_voxel});
  units.velocity_scale = FirstKnown({velocity_scale, is_mantaflow ? 0.0 : units.vertex_scale});
  units.assumes_rate = rate == 0.0;
  units.assumes_metres = scale == 0.0;
  units.assumes_velocities = velocity_scale == 0.0 && !is_mantaflow;
  if (units.velocity_scale == 0.0 && sequence.frames[0].velocities != nullptr) {
    return absl::InvalidArgumentError(
        absl::StrCat("the unit of the velocities in ", Escaped(*sequence.frames[0].velocities),
                     " is not known: give voxel_size_m or velocity_scale, or a meta.json"));
  }
  return units;
}

absl::StatusOr<mesh::TriangleMesh> ReadVdbMesh(std::span<const std::byte> bytes,
                                               std::string& source) {
  LB_ASSIGN_OR_RETURN(VdbFrame frame, ReadVdb(bytes));
  source = absl::StrCat("Took grid ", Quoted(frame.level_set), " as the level set and ",
                        frame.velocities.empty() ? "none" : Quoted(frame.velocities),
                        " as its velocities");
  return std::move(frame.mesh);
}

//   source  set to what was taken of the file, if that is worth a note
absl::StatusOr<mesh::TriangleMesh> ReadMesh(Format format, std::span<const std::byte> bytes,
                                            std::string& source) {
  if (bytes.empty()) return absl::DataLossError("the file is empty");
  switch (format) {
    case Format::kMantaflow:
      return ReadMantaflowMesh(bytes);
    case Format::kPly:
      return ReadPly(bytes);
    case Format::kObj:
      return ReadObj(bytes);
    case Format::kStl:
      return ReadStl(bytes);
    case Format::kVdb:
      return ReadVdbMesh(bytes, source);
    case Format::kAny:
      break;
  }
  return absl::InternalError("no format");
}

absl::Status CheckMagnitude(const Eigen::Matrix3Xf& columns, const char* what, const char* unit,
                            int first_vertex) {
  for (Eigen::Index v = 0; v < columns.cols(); ++v) {
    const float largest = columns.col(v).cwiseAbs().maxCoeff();
    if (largest <= kLargest) continue;
    return absl::InvalidArgumentError(absl::StrCat("vertex ", v + first_vertex, ": ", what, " of ",
                                                   largest, " ", unit, " is beyond ", kLargest));
  }
  return absl::OkStatus();
}

//   first_vertex  its number in the file, for messages
absl::Status Scale(const Units& units, int first_vertex, mesh::TriangleMesh& mesh) {
  LB_RETURN_IF_ERROR(mesh::Validate(mesh, first_vertex));
  mesh.vertices = (mesh.vertices.cast<double>() * units.vertex_scale).cast<float>();
  mesh.velocities = (mesh.velocities.cast<double>() * units.velocity_scale).cast<float>();
  LB_RETURN_IF_ERROR(CheckMagnitude(mesh.vertices, "a position", "m", first_vertex));
  return CheckMagnitude(mesh.velocities, "a velocity", "m/s", first_vertex);
}

// Surfaces of STL and VDB files have no vertices of their own.
VertexNumbers NumbersOf(Format format) {
  if (format == Format::kObj) return VertexNumbers::kFromOne;
  return format == Format::kStl || format == Format::kVdb ? VertexNumbers::kNone
                                                          : VertexNumbers::kFromZero;
}

absl::StatusOr<Frame> ReadFrame(const FrameFiles& files, Format format, const Units& units) {
  const std::string context =
      absl::StrCat("frame ", FormatNumber(files.number), ", ", Escaped(*files.mesh));
  Frame frame;
  absl::StatusOr<mesh::TriangleMesh> mesh = ReadMesh(format, files.mesh->bytes, frame.source);
  if (!mesh.ok()) return WithContext(mesh.status(), context);
  if (files.velocities != nullptr) {
    absl::StatusOr<Eigen::Matrix3Xf> velocities =
        ReadMantaflowVelocities(files.velocities->bytes, mesh->num_vertices());
    if (!velocities.ok()) {
      return WithContext(velocities.status(), absl::StrCat("frame ", FormatNumber(files.number),
                                                           ", ", Escaped(*files.velocities)));
    }
    mesh->velocities = *std::move(velocities);
  }
  if (mesh->num_triangles() == 0 && mesh->num_vertices() > 0) {
    return absl::InvalidArgumentError(
        absl::StrCat(context, ": ", mesh->num_vertices(), " vertices but no triangle"));
  }
  if (const absl::Status status = Scale(units, format == Format::kObj ? 1 : 0, *mesh);
      !status.ok()) {
    return WithContext(status, context);
  }
  absl::StatusOr<CleanCounts> counts = Clean(*mesh, NumbersOf(format));
  if (!counts.ok()) return WithContext(counts.status(), context);
  frame.counts = *counts;
  frame.mesh = *std::move(mesh);
  return frame;
}

// Calls back with the share of frames done, one call at a time and rising.
class Progress {
 public:
  Progress(const std::function<void(double)>& callback, size_t num_frames)
      : callback_(callback), num_frames_(static_cast<double>(num_frames)) {}

  void OneMore() {
    const absl::MutexLock lock(&mutex_);
    ++num_done_;
    if (callback_) callback_(num_done_ / num_frames_);
  }

 private:
  const std::function<void(double)>& callback_;
  const double num_frames_;
  absl::Mutex mutex_;
  double num_done_ ABSL_GUARDED_BY(mutex_) = 0;
};

// All frames, or the error of the lowest frame that has one.
absl::StatusOr<std::vector<Frame>> ReadFrames(const FrameSequence& sequence, const Units& units,
                                              const parallel::Arena& arena,
                                              const std::function<void(double)>& callback) {
  std::vector<absl::StatusOr<Frame>> read(sequence.frames.size());
  // Frames above a bad one need not be read. Those below it are, so the lowest bad one is found.
  std::atomic<int64_t> lowest_bad = static_cast<int64_t>(read.size());
  Progress progress(callback, read.size());
  arena.Run(static_cast<int64_t>(read.size()), [&](int64_t k) {
    if (k > lowest_bad) return;
    read[k] = ReadFrame(sequence.frames[k], sequence.format, units);
    progress.OneMore();
    int64_t lowest = lowest_bad;
    while (!read[k].ok() && k < lowest && !lowest_bad.compare_exchange_weak(lowest, k)) {
    }
  });
  std::vector<Frame> frames;
  for (absl::StatusOr<Frame>& frame : read) {
    if (!frame.ok()) return frame.status();
    frames.push_back(*std::move(frame));
  }
  return frames;
}

// Velocities are known at all vertices or nowhere, and there is something to see.
absl::Status CheckAlike(const FrameSequence& sequence, const std::vector<Frame>& frames) {
  int with = -1;
  int without = -1;
  bool has_triangles = false;
  for (int k = static_cast<int>(frames.size()) - 1; k >= 0; --k) {
    has_triangles = has_triangles || frames[k].mesh.num_triangles() > 0;
    if (frames[k].mesh.num_vertices() == 0) continue;
    (frames[k].mesh.velocities.cols() > 0 ? with : without) = k;
  }
  if (!has_triangles) return absl::InvalidArgumentError("no frame has a triangle");
  if (with < 0 || without < 0) return absl::OkStatus();
  return absl::InvalidArgumentError(
      absl::StrCat("frame ", FormatNumber(sequence.frames[without].number), ", ",
                   Escaped(*sequence.frames[without].mesh), ": no velocities, but frame ",
                   FormatNumber(sequence.frames[with].number), " has them"));
}

// The parts of the files that were read, a sentence for each, in the frames' order.
std::vector<std::string> SourceNotes(const std::vector<Frame>& frames) {
  std::vector<std::string> sources;
  for (const Frame& frame : frames) {
    const bool is_new = std::find(sources.begin(), sources.end(), frame.source) == sources.end();
    if (!frame.source.empty() && is_new) sources.push_back(frame.source);
  }
  for (std::string& source : sources) {
    const auto count = std::count_if(frames.begin(), frames.end(),
                                     [&](const Frame& frame) { return frame.source == source; });
    absl::StrAppend(&source, ", in ", count, " of ", frames.size(), " frames.");
  }
  return sources;
}

std::vector<std::string> AllNotes(const FrameSequence& sequence, const std::vector<Frame>& frames,
                                  const std::string& gap_note, const Units& units,
                                  const std::string& gravity_note) {
  std::vector<CleanCounts> counts;
  std::vector<std::string> names;
  for (size_t k = 0; k < frames.size(); ++k) {
    counts.push_back(frames[k].counts);
    names.push_back(FormatNumber(sequence.frames[k].number));
  }
  std::vector<std::string> notes = SourceNotes(frames);
  if (!gap_note.empty()) notes.push_back(gap_note);
  for (std::string& note : Notes(counts, names)) notes.push_back(std::move(note));
  const bool has_velocities = std::any_of(frames.begin(), frames.end(), [](const Frame& frame) {
    return frame.mesh.velocities.cols() > 0;
  });
  for (const std::string& note : {AssumptionNote(units, has_velocities), gravity_note}) {
    if (!note.empty()) notes.push_back(note);
  }
  return notes;
}

absl::Status CheckPositive(double value, const char* name) {
  if (value >= 0 && std::isfinite(value)) return absl::OkStatus();
  return absl::InvalidArgumentError(
      absl::StrCat(name, " is ", value, ", not above 0 (or 0: not given)"));
}

}  // namespace

absl::Status ImportOptions::Validate() const {
  if (frames_per_second != 0) {
    LB_RETURN_IF_ERROR(
        mesh::CheckRange("frames_per_second", frames_per_second, mesh::kFramesPerSecond));
  }
  LB_RETURN_IF_ERROR(CheckPositive(vertex_scale, "vertex_scale"));
  LB_RETURN_IF_ERROR(CheckPositive(velocity_scale, "velocity_scale"));
  LB_RETURN_IF_ERROR(CheckPositive(voxel_size_m, "voxel_size_m"));
  return CheckFrameTimes(frame_times, "frame_times");
}

absl::StatusOr<mesh::Animation> ReadAnimation(const std::string& name,
                                              std::span<const InputFile> files,
                                              const ImportOptions& options,
                                              const parallel::Arena& arena,
                                              const std::function<void(double)>& progress) {
  LB_RETURN_IF_ERROR(options.Validate());
  LB_ASSIGN_OR_RETURN(const FrameSequence sequence,
                      FindFrames(files, options.format, options.pattern));
  LB_ASSIGN_OR_RETURN(const Meta meta, FindMeta(sequence));
  LB_ASSIGN_OR_RETURN(const Units units, FindUnits(sequence, meta, options));
  const std::vector<double>& given =
      options.frame_times.empty() ? meta.frame_times : options.frame_times;
  LB_ASSIGN_OR_RETURN(FrameTimes times, FindFrameTimes(sequence, given, options.allow_gaps));
  LB_ASSIGN_OR_RETURN(std::vector<Frame> frames, ReadFrames(sequence, units, arena, progress));
  LB_RETURN_IF_ERROR(CheckAlike(sequence, frames));
  mesh::Animation animation;
  animation.name = name;
  animation.frames_per_second = units.frames_per_second;
  animation.first_frame_number = static_cast<int>(sequence.frames.front().number);
  animation.times = std::move(times.times);
  animation.up = FirstUp({options.up, meta.up, meta.up_against_gravity});
  animation.notes = AllNotes(sequence, frames, times.note, units, GravityNote(animation.up, meta));
  for (Frame& frame : frames) animation.frames.push_back(std::move(frame.mesh));
  LB_RETURN_IF_ERROR(mesh::CheckExtent(animation));
  return animation;
}

}  // namespace liquidblend::ingest
