#include <cmath>
#include <cstring>

#include "absl/strings/str_cat.h"
#include "core/base/status_macros.h"
#include "core/mesh/option_ranges.h"
#include "core/mesh/triangle_mesh.h"
#include "core/store/files/files.h"
#include "core/store/files/sections.h"

namespace liquidblend::store {
namespace {

constexpr FileFormat kWithoutTimes = {"animation file", "\x89LBANM\r\n", 1};
constexpr FileFormat kAnimationFormat = {"animation file", "\x89LBANM\r\n", 2,
                                         /*oldest_version=*/1};
constexpr int kSectionsPerFrame = 3;

// Columns of three are the elements.
template <typename Columns>
SectionData SectionOf(const char* name, int frame, const Columns& columns) {
  const auto elements = std::span(columns.data(), static_cast<size_t>(columns.size()));
  return {absl::StrCat(name, ".", frame), 3 * sizeof(elements[0]), std::as_bytes(elements)};
}

template <typename Columns>
absl::Status ReadColumns(SectionReader& reader, const v1::Section& section, const char* name,
                         int frame, Columns& columns) {
  constexpr size_t kElementBytes = 3 * sizeof(typename Columns::Scalar);
  LB_ASSIGN_OR_RETURN(const auto bytes,
                      reader.ReadSection(section, absl::StrCat(name, ".", frame), kElementBytes));
  columns.resize(3, static_cast<Eigen::Index>(bytes.size() / kElementBytes));
  if (!bytes.empty()) std::memcpy(columns.data(), bytes.data(), bytes.size());
  return absl::OkStatus();
}

// None, or one per frame, rising from 0.
absl::Status CheckTimes(const SectionReader& reader, const v1::AnimationManifest& manifest) {
  const auto& times = manifest.times();
  if (!times.empty() && times.size() != manifest.num_frames()) {
    return reader.Invalid(
        absl::StrCat(times.size(), " times for ", manifest.num_frames(), " frames"));
  }
  for (int k = 0; k < times.size(); ++k) {
    const bool rises = k == 0 ? times[k] == 0.0 : times[k] > times[k - 1];
    if (rises && std::isfinite(times[k])) continue;
    return reader.Invalid(absl::StrCat("the time of frame ", k, " is ", times[k]));
  }
  return absl::OkStatus();
}

absl::Status CheckManifest(const SectionReader& reader, const v1::AnimationManifest& manifest) {
  if (!v1::Up_IsValid(manifest.up())) return reader.Invalid(absl::StrCat("up = ", manifest.up()));
  if (!mesh::kFramesPerSecond.Holds(manifest.frames_per_second())) {
    return reader.Invalid(absl::StrCat("frames_per_second = ", manifest.frames_per_second()));
  }
  const int64_t num_sections = int64_t{kSectionsPerFrame} * manifest.num_frames();
  if (manifest.sections_size() != num_sections) {
    return reader.Invalid(
        absl::StrCat(manifest.sections_size(), " sections for ", manifest.num_frames(), " frames"));
  }
  return CheckTimes(reader, manifest);
}

absl::StatusOr<mesh::TriangleMesh> ReadFrame(SectionReader& reader,
                                             const v1::AnimationManifest& manifest, int frame) {
  const int first = kSectionsPerFrame * frame;
  mesh::TriangleMesh mesh;
  LB_RETURN_IF_ERROR(
      ReadColumns(reader, manifest.sections(first), "vertices", frame, mesh.vertices));
  LB_RETURN_IF_ERROR(
      ReadColumns(reader, manifest.sections(first + 1), "triangles", frame, mesh.triangles));
  LB_RETURN_IF_ERROR(
      ReadColumns(reader, manifest.sections(first + 2), "velocities", frame, mesh.velocities));
  const absl::Status valid = mesh::Validate(mesh);
  if (!valid.ok()) return reader.Invalid(absl::StrCat("frame ", frame, ": ", valid.message()));
  return mesh;
}

}  // namespace

v1::AnimationManifest ManifestOf(const mesh::Animation& animation) {
  v1::AnimationManifest manifest;
  manifest.set_name(animation.name);
  manifest.set_frames_per_second(animation.frames_per_second);
  manifest.set_first_frame_number(animation.first_frame_number);
  manifest.set_num_frames(animation.num_frames());
  manifest.set_mean_edge_length_m(mesh::MeanEdgeLength(animation));
  const Eigen::Matrix<float, 3, 2> bounds = mesh::Bounds(animation);
  for (int axis = 0; axis < 3; ++axis) {
    manifest.mutable_bounds()->add_min(bounds(axis, 0));
    manifest.mutable_bounds()->add_max(bounds(axis, 1));
  }
  manifest.mutable_notes()->Assign(animation.notes.begin(), animation.notes.end());
  manifest.mutable_times()->Assign(animation.times.begin(), animation.times.end());
  manifest.set_up(static_cast<v1::Up>(animation.up));  // the same numbers
  return manifest;
}

absl::Status WriteAnimation(const mesh::Animation& animation, BlobWriter& out) {
  std::vector<SectionData> sections;
  for (int k = 0; k < animation.num_frames(); ++k) {
    sections.push_back(SectionOf("vertices", k, animation.frames[k].vertices));
    sections.push_back(SectionOf("triangles", k, animation.frames[k].triangles));
    sections.push_back(SectionOf("velocities", k, animation.frames[k].velocities));
  }
  v1::AnimationManifest manifest = ManifestOf(animation);
  const FileFormat& format = animation.times.empty() ? kWithoutTimes : kAnimationFormat;
  return WriteSectionFile(format, sections, manifest, *manifest.mutable_sections(), out);
}

absl::StatusOr<mesh::Animation> ReadAnimation(const Blob& blob, const std::string& name) {
  SectionReader reader(kAnimationFormat, name, blob.bytes());
  v1::AnimationManifest manifest;
  LB_RETURN_IF_ERROR(reader.ReadManifest(manifest));
  LB_RETURN_IF_ERROR(CheckManifest(reader, manifest));
  mesh::Animation animation;
  animation.name = manifest.name();
  animation.frames_per_second = manifest.frames_per_second();
  animation.first_frame_number = manifest.first_frame_number();
  animation.notes.assign(manifest.notes().begin(), manifest.notes().end());
  animation.times.assign(manifest.times().begin(), manifest.times().end());
  animation.up = static_cast<mesh::Up>(manifest.up());
  for (int k = 0; k < manifest.num_frames(); ++k) {
    LB_ASSIGN_OR_RETURN(mesh::TriangleMesh frame, ReadFrame(reader, manifest, k));
    animation.frames.push_back(std::move(frame));
  }
  LB_RETURN_IF_ERROR(reader.Finish());
  return animation;
}

absl::StatusOr<std::shared_ptr<const AnimationFrames>> AnimationFrames::Open(
    std::shared_ptr<const Blob> blob, const std::string& name) {
  std::shared_ptr<AnimationFrames> frames(new AnimationFrames(std::move(blob), name));
  SectionReader reader(kAnimationFormat, name, frames->blob_->bytes());
  LB_RETURN_IF_ERROR(reader.ReadManifest(frames->manifest_));
  LB_RETURN_IF_ERROR(CheckManifest(reader, frames->manifest_));
  return frames;
}

absl::StatusOr<mesh::TriangleMesh> AnimationFrames::Read(int k) const {
  SectionReader reader(kAnimationFormat, name_, blob_->bytes());
  LB_RETURN_IF_ERROR(reader.SkipTo(manifest_.sections(kSectionsPerFrame * k)));
  LB_ASSIGN_OR_RETURN(mesh::TriangleMesh frame, ReadFrame(reader, manifest_, k));
  LB_RETURN_IF_ERROR(blob_->Check());
  return frame;
}

}  // namespace liquidblend::store
