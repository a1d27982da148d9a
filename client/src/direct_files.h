// Direct transfers of files: to the urls of PresignUpload, and from the url of PresignDownload.
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "client/src/http.h"
#include "client/src/upload_files.h"
#include "liquidblend/client.h"
#include "liquidblend/v1/liquidblend.pb.h"

namespace liquidblend::client {

// The hosts of an object store that servers at `target` may name: any if they are on this machine.
HttpHosts HostsOf(const std::string& target);

// Errors: kNotFound if it cannot be read.
absl::StatusOr<std::string> ChecksumOf(const UploadFile& file);

// The number of files from `first` on for one call. The first call has one file, as it shows
// whether the server gives urls; so other files are not hashed in vain.
int NumInCall(const std::vector<UploadFile>& files, size_t first);

// Sends one file; failed requests are repeated according to `retry`. `sent` is called with the
// number of sent bytes, below 0 when some are sent again.
// Errors: kUnavailable, kPermissionDenied (the urls have expired), kDataLoss if the file changes or
// a header is none, kInternal if the parts are not those of its size.
absl::Status SendToUrls(Http& http, const UploadFile& file,
                        const v1::PresignUploadResponse::File& urls, const RetryOptions& retry,
                        const std::function<void(int64_t bytes)>& sent);

// Downloads the file into path.part, verifies it, and renames it. Errors: kDataLoss if the content
// differs from the response's size or checksum; kUnavailable, kPermissionDenied as above, and of
// the file.
absl::Status GetFromUrl(Http& http, const v1::PresignDownloadResponse& from,
                        const std::string& path);

}  // namespace liquidblend::client
