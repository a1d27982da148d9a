#include "core/store/files/sections.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cstring>

#include "absl/strings/str_cat.h"
#include "core/base/status_macros.h"
#include "core/store/blobs/content_hash.h"

namespace liquidblend::store {
namespace {

static_assert(std::endian::native == std::endian::little, "files are little endian");

constexpr size_t kChecksumOffset = 8;
constexpr size_t kCheckedFrom = 16;  // the header's checksum covers what follows, and the manifest
constexpr size_t kVersionOffset = 16;
constexpr size_t kReservedOffset = 20;
constexpr size_t kManifestSizeOffset = 24;
constexpr size_t kHeaderBytes = 32;
constexpr size_t kMaxManifestBytes = size_t{16} << 20;
constexpr std::array<std::byte, kSectionAlignment> kZeros = {};

size_t Aligned(size_t offset) {
  return (offset + kSectionAlignment - 1) / kSectionAlignment * kSectionAlignment;
}

template <typename T>
T Load(std::span<const std::byte> bytes, size_t offset) {
  T value;
  std::memcpy(&value, bytes.data() + offset, sizeof(T));
  return value;
}

template <typename T>
void PutNumber(T value, size_t offset, std::string& bytes) {
  std::memcpy(bytes.data() + offset, &value, sizeof(T));
}

// Where the sections begin depends on the size of the manifest, which depends on the offsets that
// it holds: they only grow, so this ends.
void AssignOffsets(const google::protobuf::MessageLite& manifest, SectionList& list) {
  size_t begin = 0;
  while (begin != Aligned(kHeaderBytes + manifest.ByteSizeLong())) {
    begin = Aligned(kHeaderBytes + manifest.ByteSizeLong());
    size_t offset = begin;
    for (v1::Section& section : list) {
      section.set_offset(offset);
      offset = Aligned(offset + section.count() * section.element_bytes());
    }
  }
}

std::string MakeHead(const FileFormat& format, const std::string& manifest) {
  std::string head(kHeaderBytes, '\0');
  std::copy(format.magic.begin(), format.magic.end(), head.begin());
  PutNumber<uint32_t>(format.version, kVersionOffset, head);
  PutNumber<uint64_t>(manifest.size(), kManifestSizeOffset, head);
  head += manifest;
  const auto bytes = std::as_bytes(std::span(head));
  PutNumber<uint64_t>(Checksum(bytes.subspan(kCheckedFrom)), kChecksumOffset, head);
  return head;
}

}  // namespace

absl::Status WriteSectionFile(const FileFormat& format, const std::vector<SectionData>& sections,
                              google::protobuf::MessageLite& manifest, SectionList& list,
                              BlobWriter& out) {
  list.Clear();
  for (const SectionData& data : sections) {
    v1::Section* const section = list.Add();
    section->set_name(data.name);
    section->set_count(data.bytes.size() / data.element_bytes);
    section->set_element_bytes(data.element_bytes);
    section->set_xxh3(Checksum(data.bytes));
  }
  AssignOffsets(manifest, list);
  const std::string serialized = manifest.SerializeAsString();
  const std::unique_ptr<google::protobuf::MessageLite> copy(manifest.New());
  if (serialized.size() > kMaxManifestBytes || !copy->ParseFromString(serialized)) {
    return absl::InvalidArgumentError(absl::StrCat(format.name, ": the manifest of ",
                                                   serialized.size(), " bytes is larger than ",
                                                   kMaxManifestBytes, ", or a name is not UTF-8"));
  }
  const std::string head = MakeHead(format, serialized);
  LB_RETURN_IF_ERROR(out.Append(std::as_bytes(std::span(head))));
  size_t position = head.size();
  for (size_t k = 0; k < sections.size(); ++k) {
    const size_t offset = list[static_cast<int>(k)].offset();
    LB_RETURN_IF_ERROR(out.Append(std::span(kZeros).first(offset - position)));
    LB_RETURN_IF_ERROR(out.Append(sections[k].bytes));
    position = offset + sections[k].bytes.size();
  }
  return absl::OkStatus();
}

absl::Status SectionReader::Damaged(absl::string_view what) const {
  return absl::DataLossError(absl::StrCat(format_.name, " ", file_name_, ": ", what));
}

absl::Status SectionReader::Invalid(absl::string_view what) const {
  return absl::InvalidArgumentError(absl::StrCat(format_.name, " ", file_name_, ": ", what));
}

absl::Status SectionReader::CheckAlignment() const {
  if (reinterpret_cast<uintptr_t>(bytes_.data()) % kSectionAlignment == 0) return absl::OkStatus();
  return Invalid(absl::StrCat("lies in memory unaligned to ", kSectionAlignment));
}

absl::Status SectionReader::ReadHeader(uint64_t* manifest_size) {
  const auto magic = std::as_bytes(std::span(format_.magic));
  const auto start = bytes_.first(std::min(bytes_.size(), magic.size()));
  if (!std::equal(start.begin(), start.end(), magic.begin())) {
    return Invalid("is not a file of this type");
  }
  if (bytes_.size() < kHeaderBytes) {
    return Damaged(absl::StrCat("ends in the header, after ", bytes_.size(), " bytes"));
  }
  version_ = Load<uint32_t>(bytes_, kVersionOffset);
  if (version_ < format_.oldest_version || version_ > format_.version) {
    const std::string oldest = format_.oldest_version < format_.version
                                   ? absl::StrCat(format_.oldest_version, " to ")
                                   : "";
    return Invalid(absl::StrCat("has format version ", version_, "; this program reads version ",
                                oldest, format_.version));
  }
  *manifest_size = Load<uint64_t>(bytes_, kManifestSizeOffset);
  if (*manifest_size > kMaxManifestBytes) {
    return Damaged(absl::StrCat("the header announces a manifest of ", *manifest_size, " bytes"));
  }
  if (*manifest_size > bytes_.size() - kHeaderBytes) {
    return Damaged(absl::StrCat("ends in the manifest, after ", bytes_.size(), " bytes"));
  }
  return absl::OkStatus();
}

absl::Status SectionReader::ReadManifest(google::protobuf::MessageLite& manifest) {
  uint64_t manifest_size = 0;
  LB_RETURN_IF_ERROR(ReadHeader(&manifest_size));
  position_ = kHeaderBytes + manifest_size;
  const auto checked = bytes_.subspan(kCheckedFrom, position_ - kCheckedFrom);
  if (Checksum(checked) != Load<uint64_t>(bytes_, kChecksumOffset)) {
    return Damaged("the checksum of header and manifest does not match");
  }
  if (Load<uint32_t>(bytes_, kReservedOffset) != 0) return Invalid("a reserved byte is not zero");
  if (!manifest.ParseFromArray(bytes_.data() + kHeaderBytes, static_cast<int>(manifest_size))) {
    return Invalid("the manifest cannot be read");
  }
  return absl::OkStatus();
}

absl::Status SectionReader::SkipPadding(absl::string_view before) {
  const size_t end = Aligned(position_);
  if (end > bytes_.size()) {
    return Damaged(absl::StrCat("section ", before, ": the file ends before it, after ",
                                bytes_.size(), " bytes"));
  }
  for (; position_ < end; ++position_) {
    if (bytes_[position_] == std::byte{0}) continue;
    return Damaged(absl::StrCat("section ", before, ": the padding before it is not zero, at byte ",
                                position_));
  }
  return absl::OkStatus();
}

absl::StatusOr<std::span<const std::byte>> SectionReader::ReadSection(const v1::Section& section,
                                                                      absl::string_view name,
                                                                      size_t element_bytes) {
  if (section.name() != name) {
    return Invalid(absl::StrCat("has section ", section.name(), " in the place of ", name));
  }
  if (section.element_bytes() != element_bytes) {
    return Invalid(absl::StrCat("section ", name, ": elements of ", section.element_bytes(),
                                " bytes, not ", element_bytes));
  }
  LB_RETURN_IF_ERROR(SkipPadding(name));
  if (section.offset() != position_) {
    return Invalid(
        absl::StrCat("section ", name, ": offset ", section.offset(), ", not ", position_));
  }
  const size_t num_left = (bytes_.size() - position_) / element_bytes;
  if (section.count() > num_left) {
    return Damaged(absl::StrCat("section ", name, ": has ", section.count(),
                                " elements, but the file ends after ", num_left));
  }
  const auto bytes = bytes_.subspan(position_, section.count() * element_bytes);
  if (Checksum(bytes) != section.xxh3()) {
    return Damaged(absl::StrCat("section ", name, ": its checksum does not match"));
  }
  position_ += bytes.size();
  return bytes;
}

absl::Status SectionReader::SkipTo(const v1::Section& section) {
  if (section.offset() % kSectionAlignment != 0 || section.offset() > bytes_.size()) {
    return Invalid(absl::StrCat("section ", section.name(), ": offset ", section.offset()));
  }
  position_ = section.offset();
  return absl::OkStatus();
}

absl::Status SectionReader::Finish() const {
  if (position_ == bytes_.size()) return absl::OkStatus();
  return Damaged(absl::StrCat("goes on after the last section, from byte ", position_));
}

}  // namespace liquidblend::store
