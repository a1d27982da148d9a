#include "client/src/direct_files.h"

#include <algorithm>
#include <fstream>
#include <utility>

#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "client/src/connection/loopback.h"
#include "client/src/connection/own_address.h"
#include "client/src/files/checksum.h"
#include "client/src/files/part_file.h"
#include "client/src/retry.h"
#include "client/src/servers.h"
#include "client/src/status_macros.h"

namespace liquidblend::client {
namespace {

constexpr int64_t kChunk = 1 << 20;
constexpr int kMaxFiles = 100;                   // of a call
constexpr int64_t kMaxBytes = int64_t{1} << 30;  // so that urls do not expire before their turn
constexpr int kAlreadyThere = 412;               // an answer was lost; the worker checks it

// One part of the file to one url; its ETag.
absl::StatusOr<std::string> SendPart(Http& http, const UploadFile& file, int64_t begin,
                                     int64_t size, const std::string& url,
                                     const v1::PresignUploadResponse::File& urls,
                                     const std::function<void(int64_t bytes)>& sent) {
  std::ifstream input(file.path, std::ios::binary);
  input.seekg(begin);
  if (!input) return absl::NotFoundError(absl::StrCat(file.path, ": cannot be opened"));
  int64_t done = 0;
  const auto source = [&](char* buffer, size_t room) -> size_t {
    const auto wanted = std::min(static_cast<int64_t>(room), size - done);
    input.read(buffer, static_cast<std::streamsize>(wanted));
    const auto got = static_cast<int64_t>(input.gcount());
    done += got;
    sent(got);
    return static_cast<size_t>(got);
  };
  const std::map<std::string, std::string> headers(urls.headers().begin(), urls.headers().end());
  absl::StatusOr<HttpAnswer> answer = http.Put(url, headers, size, source);
  absl::Status status = answer.ok() ? StatusOf(*answer) : answer.status();
  if (answer.ok() && answer->status == kAlreadyThere) status = absl::OkStatus();
  if (status.ok()) return std::move(answer->etag);
  const bool is_short = !answer.ok() && done < size && input.eof();
  sent(-done);
  if (is_short) {
    return absl::DataLossError(absl::StrCat(file.path, ": changed while it was uploaded"));
  }
  return absl::Status(status.code(), absl::StrCat(file.path, ": ", status.message()));
}

// How many parts a file has; an empty one has one. -1: not any number of such parts.
int64_t NumParts(int64_t size_bytes, int64_t part_bytes) {
  if (size_bytes == 0) return 1;
  return part_bytes > 0 ? (size_bytes - 1) / part_bytes + 1 : -1;
}

absl::Status Complete(Http& http, const UploadFile& file, const std::string& url,
                      const std::string& list, const RetryOptions& retry) {
  return RetryUnavailable(retry, [&](int attempt) -> absl::Status {
    LBC_ASSIGN_OR_RETURN(const HttpAnswer answer, http.Post(url, list));
    // The answer to the attempt before was lost; the server looks whether the file is there.
    if (attempt > 1 && answer.status == 404) return absl::OkStatus();
    LBC_RETURN_IF_ERROR(StatusOf(answer));
    // S3 may find out that it cannot after it has begun to answer 200.
    if (!absl::StrContains(answer.body, "<Error>")) return absl::OkStatus();
    return absl::UnavailableError(absl::StrCat(file.path, ": its parts could not be joined"));
  });
}

}  // namespace

HttpHosts HostsOf(const std::string& target) {
  const std::vector<std::string> addresses = AddressesIn(target);
  const auto is_here = [](const std::string& address) {
    return IsThisMachine(address) || AllHostsPass(address, IsOwnHost);
  };
  return std::all_of(addresses.begin(), addresses.end(), is_here) ? HttpHosts::kAny
                                                                  : HttpHosts::kElsewhere;
}

absl::StatusOr<std::string> ChecksumOf(const UploadFile& file) {
  Checksum checksum;
  LBC_RETURN_IF_ERROR(ReadChunks(file, kChunk, [&](const std::string& bytes) {
    checksum.Add(bytes);
    return true;
  }));
  return checksum.Text();
}

int NumInCall(const std::vector<UploadFile>& files, size_t first) {
  if (first == 0) return 1;
  int num = 0;
  int64_t num_bytes = 0;
  for (size_t k = first; k < files.size() && num < kMaxFiles; ++k) {
    num_bytes += files[k].size_bytes;
    if (num > 0 && num_bytes > kMaxBytes) break;
    ++num;
  }
  return num;
}

absl::Status SendToUrls(Http& http, const UploadFile& file,
                        const v1::PresignUploadResponse::File& urls, const RetryOptions& retry,
                        const std::function<void(int64_t bytes)>& sent) {
  if (urls.part_urls_size() != NumParts(file.size_bytes, urls.part_bytes())) {
    return absl::InternalError(absl::StrCat(file.path, ": the urls are not for its size"));
  }
  std::string list = "<CompleteMultipartUpload>";
  int64_t begin = 0;
  for (int k = 0; k < urls.part_urls_size(); ++k) {
    const int64_t size = std::min(urls.part_bytes(), file.size_bytes - begin);
    std::string etag;
    LBC_RETURN_IF_ERROR(RetryUnavailable(retry, [&](int) -> absl::Status {
      LBC_ASSIGN_OR_RETURN(etag, SendPart(http, file, begin, size, urls.part_urls(k), urls, sent));
      return absl::OkStatus();
    }));
    absl::StrAppend(&list, "<Part><PartNumber>", k + 1, "</PartNumber><ETag>", etag,
                    "</ETag></Part>");
    begin += size;
  }
  if (urls.complete_url().empty()) return absl::OkStatus();
  list += "</CompleteMultipartUpload>";
  return Complete(http, file, urls.complete_url(), list, retry);
}

absl::Status GetFromUrl(Http& http, const v1::PresignDownloadResponse& from,
                        const std::string& path) {
  PartFile file(path, from.checksum());
  int64_t left = from.size_bytes();
  const auto sink = [&](absl::string_view bytes) {
    left -= static_cast<int64_t>(bytes.size());
    return left >= 0 && file.Append(bytes).ok();
  };
  absl::StatusOr<HttpAnswer> answer = http.Get(from.url(), sink);
  LBC_RETURN_IF_ERROR(file.Append(""));  // the disk's error says more
  if (left < 0) {
    return absl::DataLossError(absl::StrCat(path, ": the object store sends more than the ",
                                            from.size_bytes(), " bytes that the server speaks of"));
  }
  LBC_RETURN_IF_ERROR(answer.ok() ? StatusOf(*answer) : answer.status());
  if (left > 0) {
    return absl::DataLossError(absl::StrCat(path, ": ", left, " bytes are missing at its end"));
  }
  return file.Commit();
}

}  // namespace liquidblend::client
