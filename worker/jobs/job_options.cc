#include "worker/jobs/job_options.h"

#include "absl/strings/str_cat.h"
#include "core/base/status_macros.h"
#include "core/mesh/option_ranges.h"
#include "core/mesh/registration_options.h"
#include "core/store/files/correspondence_records.h"
#include "core/store/files/message_fields.h"

namespace liquidblend::jobs {
namespace {

ingest::Format ToFormat(store::v1::ImportOptions::Format format) {
  switch (format) {
    case store::v1::ImportOptions::MANTAFLOW:
      return ingest::Format::kMantaflow;
    case store::v1::ImportOptions::PLY:
      return ingest::Format::kPly;
    case store::v1::ImportOptions::OBJ:
      return ingest::Format::kObj;
    case store::v1::ImportOptions::STL:
      return ingest::Format::kStl;
    case store::v1::ImportOptions::VDB:
      return ingest::Format::kVdb;
    default:
      return ingest::Format::kAny;
  }
}

spacetime::Connectivity ToConnectivity(store::v1::Connectivity connectivity) {
  switch (connectivity) {
    case store::v1::TRACKED:
      return spacetime::Connectivity::kTracked;
    case store::v1::REBUILT:
      return spacetime::Connectivity::kRebuilt;
    default:
      return spacetime::Connectivity::kAuto;
  }
}

}  // namespace

ingest::ImportOptions ToImportOptions(const store::v1::ImportOptions& options) {
  ingest::ImportOptions result;
  result.format = ToFormat(options.format());
  result.frames_per_second = options.frames_per_second();
  result.vertex_scale = options.vertex_scale();
  result.velocity_scale = options.velocity_scale();
  result.voxel_size_m = options.voxel_size_m();
  result.allow_gaps = options.allow_gaps();
  result.up = static_cast<mesh::Up>(options.up());  // the same numbers
  result.frame_times.assign(options.frame_times().begin(), options.frame_times().end());
  result.pattern = options.pattern();
  return result;
}

registration::RegistrationOptions ToRegistrationOptions(
    const store::v1::RegistrationOptions& options) {
  registration::RegistrationOptions result;
  const auto read = [&](const mesh::OptionInfo& info, auto&... members) {
    (store::GetField(info.name, options, members), ...);
  };
  mesh::RegistrationOptions::ForEach(result, read);
  return result;
}

spacetime::BuildOptions ToBuildOptions(const store::v1::SpaceTimeOptions& options) {
  spacetime::BuildOptions result;
  result.connectivity = ToConnectivity(options.connectivity());
  if (options.spacing_edges() != 0) result.spacing_edges = options.spacing_edges();
  if (options.has_droplet_vertices()) result.droplet_vertices = options.droplet_vertices();
  if (options.has_sheet_thickness_edges()) {
    result.sheet_thickness_edges = options.sheet_thickness_edges();
  }
  if (options.has_keep_thin_sheets()) result.keep_thin_sheets = options.keep_thin_sheets();
  return result;
}

int NumCoarserLevels(const store::v1::SpaceTimeOptions& options) {
  return options.has_coarser_levels() ? options.coarser_levels() : mesh::kDefaultCoarserLevels;
}

spacetime::BuildOptions ToLevelOptions(const store::v1::SpaceTimeOptions& options, int level) {
  spacetime::BuildOptions result = ToBuildOptions(options);
  if (level == 0) return result;
  result.spacing_edges *= mesh::LevelSpacing(level);
  result.connectivity = spacetime::Connectivity::kRebuilt;  // a tracked mesh has no coarser one
  return result;
}

absl::Status CheckOptions(const store::v1::RegisterJob& job) {
  const int num_levels = NumCoarserLevels(job.space_time());
  LB_RETURN_IF_ERROR(mesh::CheckRange("coarser_levels", num_levels, mesh::kCoarserLevels));
  LB_RETURN_IF_ERROR(ToBuildOptions(job.space_time()).Validate());
  const absl::Status coarsest = ToLevelOptions(job.space_time(), num_levels).Validate();
  if (!coarsest.ok()) {
    return absl::InvalidArgumentError(
        absl::StrCat("level of detail ", num_levels, ": ", std::string(coarsest.message())));
  }
  return ToRegistrationOptions(job.options()).Validate();
}

std::vector<registration::Correspondence> ToCorrespondences(const store::v1::RegisterJob& job,
                                                            int target_index,
                                                            double frames_per_second) {
  std::vector<registration::Correspondence> result;
  if (target_index >= job.correspondences_size()) return result;
  for (const auto& record : job.correspondences(target_index).correspondences()) {
    result.push_back(store::FromRecord(record, frames_per_second));
  }
  return result;
}

}  // namespace liquidblend::jobs
