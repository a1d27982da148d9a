#include "server/tar/tar.h"

#include <archive.h>
#include <archive_entry.h>

#include <cerrno>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "core/base/status_macros.h"
#include "server/tar/libarchive.h"

namespace liquidblend::tar {
namespace {

constexpr size_t kChunkBytes = size_t{1} << 20;
constexpr int kReadOnly = 0444;

struct EntryCloser {
  void operator()(archive_entry* entry) const { archive_entry_free(entry); }
};
using EntryPtr = std::unique_ptr<archive_entry, EntryCloser>;

la_ssize_t WriteToStream(archive* written, void* stream, const void* bytes, size_t size) {
  auto& out = *static_cast<std::ostream*>(stream);
  if (out.write(static_cast<const char*>(bytes), static_cast<std::streamsize>(size))) {
    return static_cast<la_ssize_t>(size);
  }
  archive_set_error(written, EIO, "the stream takes no more");
  return -1;
}

absl::Status CannotWrite(const std::string& where) {
  return absl::UnavailableError(absl::StrCat("the archive cannot be written", where));
}

}  // namespace

void ArchiveCloser::operator()(archive* closed) const { archive_free(closed); }

TarWriter::TarWriter(std::ostream& out) : out_(out), archive_(NotNull(archive_write_new())) {
  archive_write_set_format_pax_restricted(archive_.get());
  archive_write_set_bytes_per_block(archive_.get(), 0);  // the stream has a buffer
  archive_write_open2(archive_.get(), &out_, nullptr, WriteToStream, nullptr, nullptr);
}

absl::Status TarWriter::Add(const std::string& name, std::span<const std::byte> bytes) {
  const EntryPtr entry(NotNull(archive_entry_new()));
  archive_entry_set_pathname(entry.get(), name.c_str());
  archive_entry_set_filetype(entry.get(), AE_IFREG);
  archive_entry_set_perm(entry.get(), kReadOnly);
  archive_entry_set_size(entry.get(), static_cast<la_int64_t>(bytes.size()));
  if (archive_write_header(archive_.get(), entry.get()) != ARCHIVE_OK) return CannotWrite("");
  for (size_t begin = 0; begin < bytes.size();) {
    const la_ssize_t written =
        archive_write_data(archive_.get(), bytes.data() + begin, bytes.size() - begin);
    if (written <= 0) return CannotWrite(absl::StrCat(", in ", name));
    begin += static_cast<size_t>(written);
  }
  if (archive_write_finish_entry(archive_.get()) == ARCHIVE_OK) return absl::OkStatus();
  return CannotWrite(absl::StrCat(", in ", name));
}

absl::Status TarWriter::End() {
  const bool is_whole = archive_write_close(archive_.get()) == ARCHIVE_OK;
  return is_whole && out_.flush() ? absl::OkStatus() : CannotWrite("");
}

// A stream as libarchive reads it.
struct TarReader::Source {
  static la_ssize_t ReadChunk(archive* /*read*/, void* source, const void** bytes) {
    auto& self = *static_cast<Source*>(source);
    self.in.read(self.chunk.data(), static_cast<std::streamsize>(self.chunk.size()));
    *bytes = self.chunk.data();
    self.is_empty = self.is_empty && self.in.gcount() == 0;
    return static_cast<la_ssize_t>(self.in.gcount());
  }

  std::istream& in;
  std::vector<char> chunk = std::vector<char>(kChunkBytes);
  bool is_empty = true;  // so far
};

TarReader::TarReader(std::istream& in)
    : source_(new Source{in}), archive_(NotNull(archive_read_new())) {
  archive_read_support_format_tar(archive_.get());
  archive_read_open(archive_.get(), source_.get(), nullptr, Source::ReadChunk, nullptr);
}

TarReader::~TarReader() = default;

absl::Status TarReader::ErrorOf() const {
  const char* const known = archive_error_string(archive_.get());
  const std::string why = known == nullptr ? "unknown error" : known;
  if (has_begun_) return absl::DataLossError(absl::StrCat("the archive is damaged: ", why));
  if (source_->is_empty) return absl::DataLossError("the archive is empty");
  return absl::InvalidArgumentError(absl::StrCat("not a tar archive: ", why));
}

absl::StatusOr<std::optional<TarEntry>> TarReader::Next() {
  while (true) {
    archive_entry* entry = nullptr;
    const int result = archive_read_next_header(archive_.get(), &entry);
    if (result == ARCHIVE_EOF && has_begun_) return std::optional<TarEntry>();
    if (result != ARCHIVE_OK && result != ARCHIVE_WARN) return ErrorOf();
    has_begun_ = true;
    if (archive_entry_filetype(entry) != AE_IFREG) continue;
    return std::optional<TarEntry>(TarEntry{NameOf(entry), archive_entry_size(entry)});
  }
}

absl::Status TarReader::Read(Take take) {
  std::vector<std::byte> chunk(kChunkBytes);
  while (true) {
    const la_ssize_t size = archive_read_data(archive_.get(), chunk.data(), chunk.size());
    if (size == 0) return absl::OkStatus();
    if (size < 0) return ErrorOf();
    LB_RETURN_IF_ERROR(take(std::span(chunk).first(static_cast<size_t>(size))));
  }
}

}  // namespace liquidblend::tar
