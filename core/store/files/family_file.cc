#include <algorithm>

#include "absl/strings/str_cat.h"
#include "core/base/status_macros.h"
#include "core/mesh/option_ranges.h"
#include "core/store/files/correspondence_records.h"
#include "core/store/files/files.h"
#include "core/store/files/parameter_records.h"
#include "core/store/files/report_messages.h"
#include "core/store/files/sections.h"

namespace liquidblend::store {
namespace {

constexpr FileFormat kFamilyFormat = {"family file", "\x89LBFAM\r\n", 3, 1};
// Version 2 counts times in frames, version 1 has neither velocities nor levels; a family that
// needs no more is still written as such.
constexpr FileFormat kFramesFormat = {kFamilyFormat.name, kFamilyFormat.magic, 2};
constexpr FileFormat kPlainFormat = {kFamilyFormat.name, kFamilyFormat.magic, 1};
constexpr int kMeshSections = 5;
constexpr int kSectionsPerTarget = 2;

// The prefix of the names of a level's sections; level 0 is the family itself.
std::string PrefixOf(int level) { return level == 0 ? "" : absl::StrCat("lod", level, "."); }

const FileFormat& FormatOf(const mesh::RegisteredFamily& family) {
  if (family.rest_time_s) return kFamilyFormat;
  const bool is_plain = family.velocities.empty() && family.coarser_levels.empty();
  return is_plain ? kPlainFormat : kFramesFormat;
}

int64_t NumSections(uint32_t version, const v1::FamilyManifest& manifest) {
  const int64_t of_level = kMeshSections + int64_t{kSectionsPerTarget} * manifest.targets_size();
  return version == 1 ? of_level : (of_level + 1) * (1 + manifest.coarser_levels_size());
}

absl::Status CheckManifest(const SectionReader& reader, const v1::FamilyManifest& manifest) {
  if (manifest.reports_size() != manifest.targets_size()) {
    return reader.Invalid(absl::StrCat(manifest.reports_size(), " reports for ",
                                       manifest.targets_size(), " targets"));
  }
  // Each has a copy of the family's names and reports in memory, and none need have a section's
  // bytes.
  if (manifest.coarser_levels_size() > mesh::kCoarserLevels.max) {
    return reader.Invalid(absl::StrCat(manifest.coarser_levels_size(),
                                       " coarser levels, more than ", mesh::kCoarserLevels.max));
  }
  const int num_reports = manifest.space_time_reports_size();
  if (num_reports != 0 && num_reports != 1 + manifest.targets_size()) {
    return reader.Invalid(absl::StrCat(num_reports, " reports of space-time meshes for ",
                                       1 + manifest.targets_size(), " animations"));
  }
  if (manifest.sections_size() != NumSections(reader.version(), manifest)) {
    return reader.Invalid(absl::StrCat(manifest.sections_size(), " sections for ",
                                       manifest.targets_size(), " targets and ",
                                       manifest.coarser_levels_size(), " coarser levels"));
  }
  for (const v1::RegistrationReport& report : manifest.reports()) {
    for (const v1::CorrespondenceReport& correspondence : report.correspondences()) {
      if (!IsWhole(correspondence)) {
        return reader.Invalid("a correspondence's event is not four numbers");
      }
    }
  }
  if (!v1::Up_IsValid(manifest.up())) return reader.Invalid(absl::StrCat("up = ", manifest.up()));
  if (manifest.has_rest_time_s() != (reader.version() >= 3)) {
    return reader.Invalid(absl::StrCat("has ", manifest.has_rest_time_s() ? "a" : "no",
                                       " rest time, in version ", reader.version()));
  }
  if (manifest.domain().min_size() != 3 || manifest.domain().max_size() != 3) {
    return reader.Invalid("the domain is not a box in three dimensions");
  }
  return absl::OkStatus();
}

// The family's values in the manifest itself.
mesh::RegisteredFamily FamilyOf(const v1::FamilyManifest& manifest) {
  mesh::RegisteredFamily family;
  family.name = manifest.name();
  family.source = manifest.source();
  family.num_first_vertices = manifest.num_first_vertices();
  family.num_last_vertices = manifest.num_last_vertices();
  family.num_frames = manifest.num_frames();
  family.num_pre_roll = manifest.num_pre_roll();
  family.frames_per_second = manifest.frames_per_second();
  family.up = static_cast<mesh::Up>(manifest.up());
  if (manifest.has_rest_time_s()) family.rest_time_s = manifest.rest_time_s();
  family.time_blending_reason = manifest.time_blending_reason();
  family.edge_length_m = manifest.edge_length_m();
  std::copy_n(manifest.domain().min().begin(), 3, family.domain_min.begin());
  std::copy_n(manifest.domain().max().begin(), 3, family.domain_max.begin());
  for (int k = 0; k < manifest.targets_size(); ++k) {
    mesh::FamilyTarget& target = family.targets.emplace_back();
    target.name = manifest.targets(k);
    target.report = FromMessage(manifest.reports(k), manifest.frames_per_second());
  }
  const mesh::RegisteredFamily plain = family;
  for (const v1::FamilyLevel& from : manifest.coarser_levels()) {
    mesh::RegisteredFamily& level = family.coarser_levels.emplace_back(plain);
    level.num_first_vertices = from.num_first_vertices();
    level.num_last_vertices = from.num_last_vertices();
  }
  for (const v1::SpaceTimeReport& report : manifest.space_time_reports()) {
    family.space_time_reports.push_back(FromMessage(report));
  }
  family.parameter_space = FromMessage(manifest.parameter_space());
  return family;
}

using SectionIterator = SectionList::const_iterator;

absl::Status ViewLevel(SectionReader& reader, int number, SectionIterator& section,
                       mesh::RegisteredFamily& level) {
  const std::string prefix = PrefixOf(number);
  LB_RETURN_IF_ERROR(reader.View(*section++, prefix + "vertices", level.vertices));
  LB_RETURN_IF_ERROR(reader.View(*section++, prefix + "tetrahedra", level.tetrahedra));
  LB_RETURN_IF_ERROR(reader.View(*section++, prefix + "pyramids", level.pyramids));
  LB_RETURN_IF_ERROR(reader.View(*section++, prefix + "wedges", level.wedges));
  LB_RETURN_IF_ERROR(reader.View(*section++, prefix + "hexahedra", level.hexahedra));
  for (size_t k = 0; k < level.targets.size(); ++k) {
    mesh::FamilyTarget& target = level.targets[k];
    LB_RETURN_IF_ERROR(
        reader.View(*section++, absl::StrCat(prefix, "displacement.", k), target.displacement));
    LB_RETURN_IF_ERROR(
        reader.View(*section++, absl::StrCat(prefix, "extrapolation.", k), target.extrapolation));
  }
  if (reader.version() == 1) return absl::OkStatus();
  return reader.View(*section++, prefix + "velocities", level.velocities);
}

absl::Status ViewSections(SectionReader& reader, const v1::FamilyManifest& manifest,
                          mesh::RegisteredFamily& family) {
  auto section = manifest.sections().begin();
  LB_RETURN_IF_ERROR(ViewLevel(reader, 0, section, family));
  for (size_t k = 0; k < family.coarser_levels.size(); ++k) {
    LB_RETURN_IF_ERROR(
        ViewLevel(reader, static_cast<int>(k) + 1, section, family.coarser_levels[k]));
  }
  return reader.Finish();
}

// Checks the values of the sections that the manifest repeats, for readers of the manifest alone.
absl::Status CheckCounts(const SectionReader& reader, const v1::FamilyManifest& manifest,
                         const mesh::RegisteredFamily& family) {
  if (manifest.has_velocities() == family.velocities.empty()) {
    return reader.Invalid(absl::StrCat("has_velocities is ", manifest.has_velocities(), " with ",
                                       family.velocities.size(), " velocities"));
  }
  for (size_t k = 0; k < family.coarser_levels.size(); ++k) {
    const mesh::RegisteredFamily& level = family.coarser_levels[k];
    const v1::FamilyLevel& stated = manifest.coarser_levels(static_cast<int>(k));
    if (stated.num_vertices() == static_cast<int64_t>(level.vertices.size()) &&
        stated.num_cells() == level.num_cells()) {
      continue;
    }
    return reader.Invalid(absl::StrCat("level of detail ", k + 1, " has ", level.vertices.size(),
                                       " vertices and ", level.num_cells(), " cells, not ",
                                       stated.num_vertices(), " and ", stated.num_cells()));
  }
  return absl::OkStatus();
}

void AddSections(const mesh::RegisteredFamily& level, int number, bool has_velocities,
                 std::vector<SectionData>& sections) {
  const std::string prefix = PrefixOf(number);
  sections.push_back(MakeSection(prefix + "vertices", level.vertices));
  sections.push_back(MakeSection(prefix + "tetrahedra", level.tetrahedra));
  sections.push_back(MakeSection(prefix + "pyramids", level.pyramids));
  sections.push_back(MakeSection(prefix + "wedges", level.wedges));
  sections.push_back(MakeSection(prefix + "hexahedra", level.hexahedra));
  for (size_t k = 0; k < level.targets.size(); ++k) {
    const mesh::FamilyTarget& target = level.targets[k];
    sections.push_back(MakeSection(absl::StrCat(prefix, "displacement.", k), target.displacement));
    sections.push_back(
        MakeSection(absl::StrCat(prefix, "extrapolation.", k), target.extrapolation));
  }
  if (has_velocities) sections.push_back(MakeSection(prefix + "velocities", level.velocities));
}

}  // namespace

v1::FamilyManifest ManifestOf(const mesh::RegisteredFamily& family) {
  v1::FamilyManifest manifest;
  manifest.set_name(family.name);
  manifest.set_version(family.version);
  manifest.set_source(family.source);
  manifest.set_frames_per_second(family.frames_per_second);
  manifest.set_up(static_cast<v1::Up>(family.up));  // the same numbers
  manifest.set_num_frames(family.num_frames);
  manifest.set_num_pre_roll(family.num_pre_roll);
  if (family.rest_time_s) manifest.set_rest_time_s(*family.rest_time_s);
  manifest.set_time_blending_reason(family.time_blending_reason);
  manifest.set_edge_length_m(family.edge_length_m);
  manifest.set_num_first_vertices(static_cast<int32_t>(family.num_first_vertices));
  manifest.set_num_last_vertices(static_cast<int32_t>(family.num_last_vertices));
  for (int axis = 0; axis < 3; ++axis) {
    manifest.mutable_domain()->add_min(family.domain_min[axis]);
    manifest.mutable_domain()->add_max(family.domain_max[axis]);
  }
  for (const mesh::FamilyTarget& target : family.targets) {
    manifest.add_targets(target.name);
    *manifest.add_reports() = ToMessage(target, family.frames_per_second);
  }
  manifest.set_has_velocities(!family.velocities.empty());
  for (const mesh::RegisteredFamily& level : family.coarser_levels) {
    v1::FamilyLevel* const to = manifest.add_coarser_levels();
    to->set_num_first_vertices(static_cast<int32_t>(level.num_first_vertices));
    to->set_num_last_vertices(static_cast<int32_t>(level.num_last_vertices));
    to->set_num_vertices(static_cast<int64_t>(level.vertices.size()));
    to->set_num_cells(level.num_cells());
  }
  for (const mesh::SpaceTimeReport& report : family.space_time_reports) {
    *manifest.add_space_time_reports() = ToMessage(report);
  }
  if (!family.parameter_space.empty()) {
    *manifest.mutable_parameter_space() = ToMessage(family.parameter_space);
  }
  return manifest;
}

absl::Status WriteFamily(const mesh::RegisteredFamily& family, BlobWriter& out) {
  const FileFormat& format = FormatOf(family);
  const bool has_velocities = format.version > 1;
  std::vector<SectionData> sections;
  AddSections(family, 0, has_velocities, sections);
  for (size_t k = 0; k < family.coarser_levels.size(); ++k) {
    AddSections(family.coarser_levels[k], static_cast<int>(k) + 1, has_velocities, sections);
  }
  v1::FamilyManifest manifest = ManifestOf(family);
  manifest.clear_version();
  for (v1::RegistrationReport& report : *manifest.mutable_reports()) report.clear_seconds();
  return WriteSectionFile(format, sections, manifest, *manifest.mutable_sections(), out);
}

absl::StatusOr<mesh::RegisteredFamily> OpenFamily(std::shared_ptr<const Blob> blob,
                                                  const std::string& name) {
  SectionReader reader(kFamilyFormat, name, blob->bytes());
  LB_RETURN_IF_ERROR(reader.CheckAlignment());
  v1::FamilyManifest manifest;
  LB_RETURN_IF_ERROR(reader.ReadManifest(manifest));
  LB_RETURN_IF_ERROR(CheckManifest(reader, manifest));
  mesh::RegisteredFamily family = FamilyOf(manifest);
  LB_RETURN_IF_ERROR(ViewSections(reader, manifest, family));
  LB_RETURN_IF_ERROR(CheckCounts(reader, manifest, family));
  if (const absl::Status valid = Validate(family); !valid.ok()) {
    return reader.Invalid(valid.message());
  }
  family.storage = std::move(blob);
  return family;
}

}  // namespace liquidblend::store
