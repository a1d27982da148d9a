#include <utility>

#include "absl/strings/str_cat.h"
#include "core/base/status_macros.h"
#include "core/store/files/correspondence_records.h"
#include "core/store/files/files.h"
#include "core/store/files/report_messages.h"
#include "core/store/files/sections.h"

namespace liquidblend::store {
namespace {

constexpr FileFormat kTargetFormat = {"target file", "\x89LBTGT\r\n", 1};
constexpr int kNumSections = 2;
// Times stay in frames: turned into seconds and back they would not be the same bits.
constexpr double kFramesPerSecond = 1.0;

absl::Status CheckManifest(const SectionReader& reader, const v1::TargetManifest& manifest) {
  if (manifest.sections_size() != kNumSections) {
    return reader.Invalid(
        absl::StrCat(manifest.sections_size(), " sections instead of ", kNumSections));
  }
  for (const v1::CorrespondenceReport& correspondence : manifest.report().correspondences()) {
    if (!IsWhole(correspondence)) {
      return reader.Invalid("a correspondence's event is not four numbers");
    }
  }
  return absl::OkStatus();
}

}  // namespace

absl::Status WriteTarget(const TargetFile& target, BlobWriter& out) {
  v1::TargetManifest manifest;
  manifest.set_target(target.target.name);
  manifest.set_source_mesh(target.source_mesh);
  *manifest.mutable_report() = ToMessage(target.target, kFramesPerSecond);
  *manifest.mutable_space_time() = ToMessage(target.space_time);
  const std::vector<SectionData> sections = {
      MakeSection("displacement", target.target.displacement),
      MakeSection("extrapolation", target.target.extrapolation)};
  return WriteSectionFile(kTargetFormat, sections, manifest, *manifest.mutable_sections(), out);
}

absl::StatusOr<TargetFile> OpenTarget(std::shared_ptr<const Blob> blob, const std::string& name) {
  SectionReader reader(kTargetFormat, name, blob->bytes());
  LB_RETURN_IF_ERROR(reader.CheckAlignment());
  v1::TargetManifest manifest;
  LB_RETURN_IF_ERROR(reader.ReadManifest(manifest));
  LB_RETURN_IF_ERROR(CheckManifest(reader, manifest));
  TargetFile file;
  file.target.name = manifest.target();
  file.target.report = FromMessage(manifest.report(), kFramesPerSecond);
  file.space_time = FromMessage(manifest.space_time());
  file.source_mesh = manifest.source_mesh();
  LB_RETURN_IF_ERROR(reader.View(manifest.sections(0), "displacement", file.target.displacement));
  LB_RETURN_IF_ERROR(reader.View(manifest.sections(1), "extrapolation", file.target.extrapolation));
  LB_RETURN_IF_ERROR(reader.Finish());
  file.storage = std::move(blob);
  return file;
}

}  // namespace liquidblend::store
