// Downloads: from the url that the server gives, or through the server where it gives none.
#include <functional>
#include <memory>
#include <string>
#include <utility>

#include "absl/strings/str_cat.h"
#include "client/src/client_impl.h"
#include "client/src/direct_files.h"
#include "client/src/files/part_file.h"
#include "client/src/http.h"
#include "client/src/known_versions.h"
#include "client/src/status_macros.h"

namespace liquidblend {
namespace {

using ReadPart = std::function<absl::StatusOr<v1::ReadFileResponse>(const v1::ReadFileRequest&)>;

// Reads the file part by part.  Errors: read's; kAborted if it was replaced meanwhile.
absl::StatusOr<int64_t> ReadWhole(v1::ReadFileRequest request, const std::string& path,
                                  const ReadPart& read) {
  const int64_t asked_version = request.version();
  std::unique_ptr<client::PartFile> file;
  int64_t size = 0;
  do {
    LBC_ASSIGN_OR_RETURN(const v1::ReadFileResponse part, read(request));
    if (file == nullptr) {
      LBC_RETURN_IF_ERROR(client::CheckVersion(asked_version, part.version()));
      file = std::make_unique<client::PartFile>(path, part.checksum());
      size = part.size_bytes();
      request.set_version(part.version());
      request.set_checksum(part.checksum());
    }
    const int64_t end = request.offset() + static_cast<int64_t>(part.data().size());
    if ((part.data().empty() && end < size) || end > size) {
      return absl::DataLossError(absl::StrCat("the server sends bytes ", request.offset(), " to ",
                                              end, " of a file of ", size));
    }
    LBC_RETURN_IF_ERROR(file->Append(part.data()));
    request.set_offset(end);
  } while (request.offset() < size);
  LBC_RETURN_IF_ERROR(file->Commit());
  return size;
}

}  // namespace

absl::StatusOr<int64_t> Client::Impl::ReadFile(const std::string& name, const std::string& path,
                                               int64_t version) {
  v1::ReadFileRequest first;
  first.set_name(name);
  first.set_version(version);
  // A server reads and checks all of a file before it gives the first part: others would do so,
  // too.
  client::Server* server = nullptr;
  return ReadWhole(std::move(first), path, [&](const v1::ReadFileRequest& next) {
    return Call(&Service::ReadFile, next, options.upload_timeout, &server);
  });
}

absl::StatusOr<int64_t> Client::Download(const std::string& name, const std::string& path,
                                         int64_t version) {
  if (!impl_->options.direct_transfers) return impl_->ReadFile(name, path, version);
  v1::PresignDownloadRequest request;
  request.set_name(name);
  request.set_version(version);
  const absl::StatusOr<v1::PresignDownloadResponse> from =
      impl_->Call(&Impl::Service::PresignDownload, request);
  if (absl::IsUnimplemented(from.status())) {
    const absl::StatusOr<int64_t> size = impl_->ReadFile(name, path, version);
    // A server that is too old for it says less than this.
    return absl::IsUnimplemented(size.status()) ? from.status() : size;
  }
  LBC_RETURN_IF_ERROR(from.status());
  LBC_RETURN_IF_ERROR(client::CheckVersion(version, from->version()));
  client::Http http(impl_->options.security.storage_ca, client::HostsOf(impl_->options.target));
  const absl::Status got = client::RetryUnavailable(
      impl_->options.retry, [&](int) { return client::GetFromUrl(http, *from, path); });
  // The object store may be out of this client's reach.
  if (absl::IsUnavailable(got)) return impl_->ReadFile(name, path, version);
  LBC_RETURN_IF_ERROR(got);
  return from->size_bytes();
}

}  // namespace liquidblend
