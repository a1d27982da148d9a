#include "core/store/catalog/catalog_file.h"

#include <cstring>
#include <utility>

#include "absl/strings/str_cat.h"
#include "core/base/status_macros.h"
#include "core/store/catalog/job_records.h"
#include "core/store/files/sections.h"

namespace liquidblend::store {
namespace {

constexpr FileFormat kFormat = {"catalog file", "\x89LBCAT\r\n", 1};

template <typename Record>
std::string Join(const std::vector<Record>& records) {
  std::string bytes;
  for (const Record& record : records) {
    const auto size = static_cast<uint32_t>(record.ByteSizeLong());
    bytes.append(reinterpret_cast<const char*>(&size), sizeof(size));
    record.AppendToString(&bytes);
  }
  return bytes;
}

// Reads the records of the next section.
template <typename Record>
absl::Status Split(SectionReader& reader, const pb::Section& section, absl::string_view name,
                   std::vector<Record>& records) {
  LB_ASSIGN_OR_RETURN(std::span<const std::byte> bytes, reader.ReadSection(section, name, 1));
  while (!bytes.empty()) {
    uint32_t size = 0;
    if (bytes.size() >= sizeof(size)) std::memcpy(&size, bytes.data(), sizeof(size));
    const bool is_whole = bytes.size() >= sizeof(size) && bytes.size() - sizeof(size) >= size;
    if (!is_whole || !records.emplace_back().ParseFromArray(bytes.data() + sizeof(size),
                                                            static_cast<int>(size))) {
      return reader.Invalid(
          absl::StrCat("section ", name, ": record ", records.size(), " cannot be read"));
    }
    bytes = bytes.subspan(sizeof(size) + size);
  }
  return absl::OkStatus();
}

void CollectBlobIds(const google::protobuf::Message& record, std::vector<BlobId>& ids) {
  using Field = google::protobuf::FieldDescriptor;
  const google::protobuf::Reflection& reflection = *record.GetReflection();
  std::vector<const Field*> fields;
  reflection.ListFields(record, &fields);
  for (const Field* field : fields) {
    const int count = field->is_repeated() ? reflection.FieldSize(record, field) : 1;
    for (int k = 0; k < count; ++k) {
      if (field->cpp_type() == Field::CPPTYPE_MESSAGE) {
        CollectBlobIds(field->is_repeated() ? reflection.GetRepeatedMessage(record, field, k)
                                            : reflection.GetMessage(record, field),
                       ids);
      } else if (field->cpp_type() == Field::CPPTYPE_STRING) {
        std::string text = field->is_repeated() ? reflection.GetRepeatedString(record, field, k)
                                                : reflection.GetString(record, field);
        if (IsBlobId(text) || IsUploadId(text)) ids.push_back(std::move(text));
      }
    }
  }
}

}  // namespace

absl::Status WriteCatalogFile(const CatalogContents& contents, const std::string& store,
                              absl::Time time, BlobWriter& out) {
  std::vector<std::pair<const char*, std::string>> sections = {
      {"animations", Join(contents.animations)},
      {"families", Join(contents.families)},
      {"members", Join(contents.members)},
      {"versions", Join(contents.versions)},
      {"jobs", Join(contents.jobs)},
  };
  // Older programs read files without this one.
  if (!contents.kept_versions.empty()) {
    sections.emplace_back("kept_versions", Join(contents.kept_versions));
  }
  std::vector<SectionData> data;
  for (const auto& [name, bytes] : sections) {
    data.push_back(MakeSection(name, std::span(bytes.data(), bytes.size())));
  }
  pb::CatalogManifest manifest;
  manifest.set_store(store);
  *manifest.mutable_time() = ToTimestamp(time);
  return WriteSectionFile(kFormat, data, manifest, *manifest.mutable_sections(), out);
}

absl::StatusOr<CatalogContents> ReadCatalogFile(std::span<const std::byte> bytes,
                                                const std::string& name) {
  SectionReader reader(kFormat, name, bytes);
  pb::CatalogManifest manifest;
  LB_RETURN_IF_ERROR(reader.ReadManifest(manifest));
  if (manifest.sections_size() != 5 && manifest.sections_size() != 6) {
    return reader.Invalid("does not have five or six sections");
  }
  CatalogContents contents;
  LB_RETURN_IF_ERROR(Split(reader, manifest.sections(0), "animations", contents.animations));
  LB_RETURN_IF_ERROR(Split(reader, manifest.sections(1), "families", contents.families));
  LB_RETURN_IF_ERROR(Split(reader, manifest.sections(2), "members", contents.members));
  LB_RETURN_IF_ERROR(Split(reader, manifest.sections(3), "versions", contents.versions));
  LB_RETURN_IF_ERROR(Split(reader, manifest.sections(4), "jobs", contents.jobs));
  if (manifest.sections_size() == 6) {
    LB_RETURN_IF_ERROR(
        Split(reader, manifest.sections(5), "kept_versions", contents.kept_versions));
  }
  LB_RETURN_IF_ERROR(reader.Finish());
  return contents;
}

std::vector<BlobId> BlobIdsIn(const google::protobuf::Message& record) {
  std::vector<BlobId> ids;
  CollectBlobIds(record, ids);
  return ids;
}

}  // namespace liquidblend::store
