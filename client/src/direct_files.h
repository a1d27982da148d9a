// Files on their way past the server: to the urls of PresignUpload, from that of PresignDownload.
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

// Errors: kNotFound if it cannot be read.
absl::StatusOr<std::string> ChecksumOf(const UploadFile& file);

// How many of the files from `first` on go into one call. One at first: only then does it show
// whether the server gives urls, so that others need not be read in vain.
int NumInCall(const std::vector<UploadFile>& files, size_t first);

// Sends one file; requests that meet trouble are repeated as `retry` says. `sent` hears of bytes,
// and of less than 0 when some are sent again.
// Errors: kUnavailable, kPermissionDenied (the urls have expired), kDataLoss if the file changes.
absl::Status SendToUrls(Http& http, const UploadFile& file,
                        const v1::PresignUploadResponse::File& urls, const RetryOptions& retry,
                        const std::function<void(int64_t bytes)>& sent);

// Gets it into path.part, checks it, and renames that. Errors: kDataLoss if it is something else
// than the response says; kUnavailable, kPermissionDenied as above, and of the file.
absl::Status GetFromUrl(Http& http, const v1::PresignDownloadResponse& from,
                        const std::string& path);

}  // namespace liquidblend::client
