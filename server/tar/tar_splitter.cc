#include "server/tar/tar_splitter.h"

#include <algorithm>
#include <optional>
#include <string_view>

#include "absl/strings/str_cat.h"
#include "core/base/status_macros.h"
#include "server/tar/libarchive.h"

namespace liquidblend::tar {
namespace {

constexpr size_t kBlock = 512;
constexpr int64_t kMaxAfterEnd = int64_t{4} << 20;  // programs fill their last record up
constexpr int64_t kMaxHeader = int64_t{64} << 10;
constexpr size_t kTypeAt = 156;  // in a header
constexpr size_t kSizeAt = 124;
constexpr size_t kSizeDigits = 12;

absl::Status NotAnArchive(absl::string_view why) {
  return absl::InvalidArgumentError(absl::StrCat("not a tar archive of files: ", why));
}

int64_t Padding(int64_t size) { return (static_cast<int64_t>(kBlock) - size % kBlock) % kBlock; }

// Headers whose contents tell of the file that follows.
bool IsExtension(char type) {
  return std::string_view("xgXLK").find(type) != std::string_view::npos;
}

// Regular files, of which a contiguous one is another name, and directories.
bool IsTaken(char type) { return type == '0' || type == '\0' || type == '7' || type == '5'; }

// The size in an extension's header, in octal digits.
std::optional<int64_t> SizeOf(std::string_view block) {
  int64_t size = 0;
  bool has_digit = false;
  for (const char c : block.substr(kSizeAt, kSizeDigits)) {
    if (c >= '0' && c <= '7') {
      size = 8 * size + (c - '0');
      has_digit = true;
    } else if (has_digit || c != ' ') {
      break;
    }
  }
  return has_digit ? std::optional<int64_t>(size) : std::nullopt;
}

struct Header {
  mode_t type = 0;
  TarEntry entry;
  bool is_plain = false;  // neither a link nor sparse
};

absl::StatusOr<Header> ReadHeader(std::string blocks) {
  blocks.append(2 * kBlock, '\0');
  const ArchivePtr read(NotNull(archive_read_new()));
  archive_read_support_format_tar(read.get());
  archive_read_open_memory(read.get(), blocks.data(), blocks.size());
  archive_entry* entry = nullptr;
  const int result = archive_read_next_header(read.get(), &entry);
  if (result != ARCHIVE_OK && result != ARCHIVE_WARN) {
    const char* why = archive_error_string(read.get());
    return NotAnArchive(why == nullptr ? "a header is damaged" : why);
  }
  const bool is_link =
      archive_entry_hardlink(entry) != nullptr || archive_entry_symlink(entry) != nullptr;
  return Header{archive_entry_filetype(entry),
                {NameOf(entry), archive_entry_size(entry)},
                !is_link && archive_entry_sparse_count(entry) == 0};
}

}  // namespace

absl::Status TarSplitter::Add(std::span<const std::byte> piece, FileSink& sink) {
  while (!piece.empty() && !is_over_) {
    size_t size = 0;
    if (content_left_ > 0) {
      size = static_cast<size_t>(std::min<int64_t>(content_left_, piece.size()));
      content_left_ -= static_cast<int64_t>(size);
      LB_RETURN_IF_ERROR(sink.AddBytes(piece.first(size)));
    } else if (padding_left_ > 0) {
      size = static_cast<size_t>(std::min<int64_t>(padding_left_, piece.size()));
      padding_left_ -= static_cast<int64_t>(size);
    } else {
      size = TakeBlock(piece);
      const bool is_whole = header_.size() - block_begin_ == kBlock;
      if (is_whole) LB_RETURN_IF_ERROR(OnBlock(sink));
    }
    piece = piece.subspan(size);
  }
  after_end_ += static_cast<int64_t>(piece.size());
  return after_end_ > kMaxAfterEnd ? NotAnArchive("it goes on after its end") : absl::OkStatus();
}

absl::Status TarSplitter::End() const {
  return is_over_ ? absl::OkStatus() : NotAnArchive("it ends early");
}

// Returns how many bytes were taken.
size_t TarSplitter::TakeBlock(std::span<const std::byte> piece) {
  const size_t size = std::min(kBlock - (header_.size() - block_begin_), piece.size());
  header_.append(reinterpret_cast<const char*>(piece.data()), size);
  return size;
}

absl::Status TarSplitter::OnBlock(FileSink& sink) {
  const std::string_view block = std::string_view(header_).substr(block_begin_);
  block_begin_ = header_.size();
  if (extension_left_ > 0) {
    extension_left_ -= static_cast<int64_t>(kBlock);
    return absl::OkStatus();
  }
  if (block.find_first_not_of('\0') == std::string_view::npos) {
    is_over_ = true;
    return block_begin_ == kBlock ? absl::OkStatus() : NotAnArchive("a file is missing");
  }
  const char type = block[kTypeAt];
  if (IsTaken(type)) return OnHeader(sink);
  if (!IsExtension(type)) return NotAnArchive("it holds something else, such as a link");
  const std::optional<int64_t> size = SizeOf(block);
  if (!size.has_value() || *size > kMaxHeader - static_cast<int64_t>(header_.size())) {
    return NotAnArchive("a header is too long");
  }
  extension_left_ = *size + Padding(*size);
  return absl::OkStatus();
}

absl::Status TarSplitter::OnHeader(FileSink& sink) {
  LB_ASSIGN_OR_RETURN(Header header, ReadHeader(header_));
  header_.clear();
  block_begin_ = 0;
  if (header.type == AE_IFDIR) {
    return ++num_left_out_ > kMaxLeftOut ? NotAnArchive("too many directories") : absl::OkStatus();
  }
  if (header.type != AE_IFREG || !header.is_plain || header.entry.size_bytes < 0) {
    return NotAnArchive(absl::StrCat("'", header.entry.name, "' is not a regular file"));
  }
  header.entry.name.erase(0, header.entry.name.rfind('/') + 1);
  content_left_ = header.entry.size_bytes;
  padding_left_ = Padding(content_left_);
  return sink.BeginFile(header.entry);
}

}  // namespace liquidblend::tar
