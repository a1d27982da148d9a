// Common structure of the file formats (docs/formats.md): a header with a protobuf manifest, then
// aligned, checksummed sections. Every byte of a file is checked when it is read.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "core/base/status_macros.h"
#include "core/store/blobs/blob_store.h"
#include "google/protobuf/message_lite.h"
#include "google/protobuf/repeated_ptr_field.h"
#include "liquidblend/store/v1/files.pb.h"

namespace liquidblend::store {

// Sections, and with them their arrays, begin at multiples of this many bytes.
constexpr size_t kSectionAlignment = 64;

// One kind of file.
struct FileFormat {
  absl::string_view name;             // for messages: "family file"
  absl::string_view magic;            // the first 8 bytes
  uint32_t version;                   // to write, and the newest to read
  uint32_t oldest_version = version;  // to read
};

struct SectionData {
  std::string name;
  uint32_t element_bytes = 1;
  std::span<const std::byte> bytes;  // a whole number of elements
};

template <typename Element>
SectionData MakeSection(std::string name, std::span<const Element> elements) {
  return {std::move(name), sizeof(Element), std::as_bytes(elements)};
}

using SectionList = google::protobuf::RepeatedPtrField<v1::Section>;

// Writes header, manifest and sections. `list`, the manifest's list of sections, is filled here.
// Errors: the writer's; kInvalidArgument if a string of the manifest is not UTF-8, or it is too
// big.
absl::Status WriteSectionFile(const FileFormat& format, const std::vector<SectionData>& sections,
                              google::protobuf::MessageLite& manifest, SectionList& list,
                              BlobWriter& out);

// Reads what WriteSectionFile() wrote, section by section in the order of the file.
// Errors of all calls: kDataLoss if the file is damaged, kInvalidArgument if it has another type;
// messages begin with the kind of file, `file_name`, and the section.
class SectionReader {
 public:
  // `bytes` must outlive the reader.
  SectionReader(const FileFormat& format, std::string file_name, std::span<const std::byte> bytes)
      : format_(format), file_name_(std::move(file_name)), bytes_(bytes) {}

  // kInvalidArgument unless the bytes are aligned for arrays in memory.
  absl::Status CheckAlignment() const;

  // To be called first: checks the header and parses the manifest.
  absl::Status ReadManifest(google::protobuf::MessageLite& manifest);

  // The file's format version. Requires: ReadManifest() returned OK.
  uint32_t version() const { return version_; }

  // To be called next for each entry of the manifest's list, in order: the section's bytes,
  // checked. The section must have this name and elements of this size.
  absl::StatusOr<std::span<const std::byte>> ReadSection(const v1::Section& section,
                                                         absl::string_view name,
                                                         size_t element_bytes);

  // Likewise, as an array in place. Requires: CheckAlignment() returned OK.
  template <typename Element>
  absl::Status View(const v1::Section& section, absl::string_view name,
                    std::span<const Element>& elements) {
    static_assert(kSectionAlignment % alignof(Element) == 0);
    LB_ASSIGN_OR_RETURN(const auto bytes, ReadSection(section, name, sizeof(Element)));
    elements = {reinterpret_cast<const Element*>(bytes.data()), bytes.size() / sizeof(Element)};
    return absl::OkStatus();
  }

  // Leaves out what stands before this section of the manifest, unchecked.
  absl::Status SkipTo(const v1::Section& section);

  // To be called last: checks that nothing follows.
  absl::Status Finish() const;

  // An error about this file.
  absl::Status Damaged(absl::string_view what) const;  // kDataLoss
  absl::Status Invalid(absl::string_view what) const;  // kInvalidArgument

 private:
  absl::Status ReadHeader(uint64_t* manifest_size);
  absl::Status SkipPadding(absl::string_view before);

  FileFormat format_;
  std::string file_name_;
  std::span<const std::byte> bytes_;
  uint32_t version_ = 0;
  size_t position_ = 0;  // everything before it has been checked
};

}  // namespace liquidblend::store
