#include <algorithm>

#include "absl/strings/str_cat.h"
#include "core/base/status_macros.h"
#include "core/store/files.h"
#include "core/store/sections.h"

namespace liquidblend::store {
namespace {

constexpr FileFormat kFamilyFormat = {"family file", "\x89LBFAM\r\n", 1};
constexpr int kMeshSections = 5;
constexpr int kSectionsPerTarget = 2;

std::string NameOfTarget(const char* name, size_t target) {
  return absl::StrCat(name, ".", target);
}

absl::Status CheckManifest(const SectionReader& reader, const v1::FamilyManifest& manifest) {
  if (manifest.reports_size() != manifest.targets_size()) {
    return reader.Invalid(absl::StrCat(manifest.reports_size(), " reports for ",
                                       manifest.targets_size(), " targets"));
  }
  const int64_t num_sections =
      kMeshSections + int64_t{kSectionsPerTarget} * manifest.targets_size();
  if (manifest.sections_size() != num_sections) {
    return reader.Invalid(absl::StrCat(manifest.sections_size(), " sections for ",
                                       manifest.targets_size(), " targets"));
  }
  if (manifest.domain().min_size() != 3 || manifest.domain().max_size() != 3) {
    return reader.Invalid("the domain is no box in three dimensions");
  }
  return absl::OkStatus();
}

// What stands in the manifest itself.
mesh::RegisteredFamily FamilyOf(const v1::FamilyManifest& manifest) {
  mesh::RegisteredFamily family;
  family.name = manifest.name();
  family.source = manifest.source();
  family.num_first_vertices = manifest.num_first_vertices();
  family.num_last_vertices = manifest.num_last_vertices();
  family.num_frames = manifest.num_frames();
  family.frames_per_second = manifest.frames_per_second();
  family.edge_length_m = manifest.edge_length_m();
  std::copy_n(manifest.domain().min().begin(), 3, family.domain_min.begin());
  std::copy_n(manifest.domain().max().begin(), 3, family.domain_max.begin());
  for (int k = 0; k < manifest.targets_size(); ++k) {
    const v1::RegistrationReport& report = manifest.reports(k);
    mesh::FamilyTarget& target = family.targets.emplace_back();
    target.name = manifest.targets(k);
    target.report = {report.num_nodes(), report.num_iterations(), report.mean_residual_edges(),
                     report.inlier_share(), report.seconds()};
  }
  return family;
}

template <typename Element>
absl::Status View(SectionReader& reader, const v1::Section& section, const std::string& name,
                  std::span<const Element>& elements) {
  static_assert(kSectionAlignment % alignof(Element) == 0);
  LB_ASSIGN_OR_RETURN(const auto bytes, reader.ReadSection(section, name, sizeof(Element)));
  elements = {reinterpret_cast<const Element*>(bytes.data()), bytes.size() / sizeof(Element)};
  return absl::OkStatus();
}

absl::Status ViewSections(SectionReader& reader, const v1::FamilyManifest& manifest,
                          mesh::RegisteredFamily& family) {
  auto section = manifest.sections().begin();
  LB_RETURN_IF_ERROR(View(reader, *section++, "vertices", family.vertices));
  LB_RETURN_IF_ERROR(View(reader, *section++, "tetrahedra", family.tetrahedra));
  LB_RETURN_IF_ERROR(View(reader, *section++, "pyramids", family.pyramids));
  LB_RETURN_IF_ERROR(View(reader, *section++, "wedges", family.wedges));
  LB_RETURN_IF_ERROR(View(reader, *section++, "hexahedra", family.hexahedra));
  for (size_t k = 0; k < family.targets.size(); ++k) {
    mesh::FamilyTarget& target = family.targets[k];
    LB_RETURN_IF_ERROR(
        View(reader, *section++, NameOfTarget("displacement", k), target.displacement));
    LB_RETURN_IF_ERROR(
        View(reader, *section++, NameOfTarget("extrapolation", k), target.extrapolation));
  }
  return reader.Finish();
}

}  // namespace

v1::FamilyManifest ManifestOf(const mesh::RegisteredFamily& family) {
  v1::FamilyManifest manifest;
  manifest.set_name(family.name);
  manifest.set_version(family.version);
  manifest.set_source(family.source);
  manifest.set_frames_per_second(family.frames_per_second);
  manifest.set_num_frames(family.num_frames);
  manifest.set_edge_length_m(family.edge_length_m);
  manifest.set_num_first_vertices(static_cast<int32_t>(family.num_first_vertices));
  manifest.set_num_last_vertices(static_cast<int32_t>(family.num_last_vertices));
  for (int axis = 0; axis < 3; ++axis) {
    manifest.mutable_domain()->add_min(family.domain_min[axis]);
    manifest.mutable_domain()->add_max(family.domain_max[axis]);
  }
  for (const mesh::FamilyTarget& target : family.targets) {
    manifest.add_targets(target.name);
    v1::RegistrationReport* const report = manifest.add_reports();
    report->set_target(target.name);
    report->set_num_nodes(target.report.num_nodes);
    report->set_num_iterations(target.report.num_iterations);
    report->set_mean_residual_edges(target.report.mean_residual_edges);
    report->set_inlier_share(target.report.inlier_share);
    report->set_seconds(target.report.seconds);
  }
  return manifest;
}

absl::Status WriteFamily(const mesh::RegisteredFamily& family, BlobWriter& out) {
  std::vector<SectionData> sections = {
      MakeSection("vertices", family.vertices), MakeSection("tetrahedra", family.tetrahedra),
      MakeSection("pyramids", family.pyramids), MakeSection("wedges", family.wedges),
      MakeSection("hexahedra", family.hexahedra)};
  for (size_t k = 0; k < family.targets.size(); ++k) {
    const mesh::FamilyTarget& target = family.targets[k];
    sections.push_back(MakeSection(NameOfTarget("displacement", k), target.displacement));
    sections.push_back(MakeSection(NameOfTarget("extrapolation", k), target.extrapolation));
  }
  v1::FamilyManifest manifest = ManifestOf(family);
  manifest.clear_version();
  for (v1::RegistrationReport& report : *manifest.mutable_reports()) report.clear_seconds();
  return WriteSectionFile(kFamilyFormat, sections, manifest, *manifest.mutable_sections(), out);
}

absl::StatusOr<mesh::RegisteredFamily> OpenFamily(std::shared_ptr<const Blob> blob,
                                                  const std::string& name) {
  SectionReader reader(kFamilyFormat, name, blob->bytes());
  if (reinterpret_cast<uintptr_t>(blob->bytes().data()) % kSectionAlignment != 0) {
    return reader.Invalid(absl::StrCat("lies in memory unaligned to ", kSectionAlignment));
  }
  v1::FamilyManifest manifest;
  LB_RETURN_IF_ERROR(reader.ReadManifest(manifest));
  LB_RETURN_IF_ERROR(CheckManifest(reader, manifest));
  mesh::RegisteredFamily family = FamilyOf(manifest);
  LB_RETURN_IF_ERROR(ViewSections(reader, manifest, family));
  if (const absl::Status valid = Validate(family); !valid.ok()) {
    return reader.Invalid(valid.message());
  }
  family.storage = std::move(blob);
  return family;
}

}  // namespace liquidblend::store
