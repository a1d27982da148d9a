#include "core/store/blobs/s3_client.h"

#include <algorithm>
#include <tuple>
#include <utility>

#include "absl/strings/ascii.h"
#include "absl/strings/match.h"
#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/strip.h"
#include "core/base/log.h"
#include "core/base/status_macros.h"
#include "core/store/blobs/s3_xml.h"

namespace liquidblend::store {
namespace {

constexpr int64_t kMaxParts = 10000;      // of S3
constexpr int64_t kMaxSignedParts = 100;  // an url each
constexpr char kHttpTime[] = "%a, %d %b %Y %H:%M:%S GMT";
constexpr absl::Duration kTimeTolerance = absl::Seconds(2);  // between hosts of S3
constexpr size_t kHiddenDigits = 24;                         // of the 32 that make an upload's id

bool IsEndpoint(const std::string& url) {
  return absl::StartsWith(url, "http://") || absl::StartsWith(url, "https://");
}

std::string HeaderOf(const HttpAnswer& answer, const char* name) {
  const auto found = answer.headers.find(name);
  return found == answer.headers.end() ? "" : found->second;
}

std::string EtagOf(const HttpAnswer& answer) {
  const std::string etag = HeaderOf(answer, "etag");
  return std::string(absl::StripSuffix(absl::StripPrefix(etag, "\""), "\""));
}

std::string ListOfParts(const std::vector<std::string>& etags) {
  std::string list = "<CompleteMultipartUpload>";
  for (size_t k = 0; k < etags.size(); ++k) {
    absl::StrAppend(&list, "<Part><PartNumber>", k + 1, "</PartNumber><ETag>\"", etags[k],
                    "\"</ETag></Part>");
  }
  return absl::StrCat(list, "</CompleteMultipartUpload>");
}

std::span<const std::byte> PartOf(std::span<const std::byte> bytes, size_t k, int64_t part_bytes) {
  const size_t begin = k * static_cast<size_t>(part_bytes);
  return bytes.subspan(begin, std::min(bytes.size() - begin, static_cast<size_t>(part_bytes)));
}

}  // namespace

absl::StatusOr<std::unique_ptr<S3Client>> S3Client::Make(const std::string& url,
                                                         S3Options options) {
  LB_RETURN_IF_ERROR(options.FillFromEnvironment());
  LB_RETURN_IF_ERROR(options.Validate());
  const std::string scheme = "s3://";
  const size_t slash = url.find('/', scheme.size());
  const std::string bucket =
      absl::StartsWith(url, scheme) ? url.substr(scheme.size(), slash - scheme.size()) : "";
  if (bucket.empty()) {
    return absl::InvalidArgumentError(absl::StrCat("'", url, "' is not s3://bucket/prefix"));
  }
  for (const std::string& endpoint : {options.endpoint, options.client_endpoint}) {
    if (IsEndpoint(endpoint) || (endpoint.empty() && !options.endpoint.empty())) continue;
    return absl::InvalidArgumentError(
        absl::StrCat("endpoint '", endpoint, "' is not http://host or https://host"));
  }
  std::string prefix = slash == std::string::npos ? "" : url.substr(slash + 1);
  while (absl::EndsWith(prefix, "/")) prefix.pop_back();
  if (!prefix.empty()) prefix += "/";
  std::unique_ptr<S3Client> client(new S3Client(bucket, prefix, options));
  LB_RETURN_IF_ERROR(client->transport_.Prepare());
  return client;
}

S3Client::S3Client(std::string bucket, std::string prefix, const S3Options& options)
    : bucket_(std::move(bucket)),
      prefix_(std::move(prefix)),
      options_(options),
      transport_(options) {}

// Hides most of an upload's id: a client that reads it could import the file as its own.
std::string S3Client::NameOf(const std::string& key) const {
  const bool is_upload = IsUploadId(key.substr(key.rfind('/') + 1));
  const std::string shown =
      is_upload ? absl::StrCat(key.substr(0, key.size() - kHiddenDigits), "...") : key;
  return absl::StrCat("s3://", bucket_, "/", prefix_, shown);
}

std::string S3Client::PathOf(const std::string& key) const {
  return absl::StrCat("/", bucket_, "/", prefix_, key);
}

absl::StatusOr<std::string> S3Client::PresignGet(const std::string& key, absl::Duration expires) {
  return transport_.Presign({.path = PathOf(key)}, {}, expires);
}

absl::StatusOr<DirectUpload> S3Client::PresignPut(const std::string& key, int64_t size_bytes,
                                                  absl::Duration expires) {
  DirectUpload upload;
  if (size_bytes <= options_.part_bytes) {
    upload.part_bytes = size_bytes;
    upload.headers = {{"If-None-Match", "*"}};
    LB_ASSIGN_OR_RETURN(
        upload.part_urls.emplace_back(),
        transport_.Presign({.method = "PUT", .path = PathOf(key)},
                           {{"content-length", absl::StrCat(size_bytes)}, {"if-none-match", "*"}},
                           expires));
    return upload;
  }
  LB_ASSIGN_OR_RETURN(const Upload created, CreateUpload(key));
  upload.multipart_id = created.id;
  const absl::Status status = PresignParts(key, size_bytes, expires, upload);
  if (status.ok()) return upload;
  DropUpload(key, created.id);
  return status;
}

int64_t S3Client::SignedPartBytes(int64_t size_bytes) const {
  return std::max(options_.part_bytes, (size_bytes + kMaxSignedParts - 1) / kMaxSignedParts);
}

int64_t S3Client::NumPartUrls(int64_t size_bytes) const {
  if (size_bytes <= options_.part_bytes) return 1;
  return (size_bytes - 1) / SignedPartBytes(size_bytes) + 1;
}

absl::Status S3Client::PresignParts(const std::string& key, int64_t size_bytes,
                                    absl::Duration expires, DirectUpload& upload) {
  const std::string& upload_id = upload.multipart_id;
  upload.part_bytes = SignedPartBytes(size_bytes);
  for (int64_t begin = 0; begin < size_bytes; begin += upload.part_bytes) {
    const int64_t length = std::min(upload.part_bytes, size_bytes - begin);
    const std::string number = absl::StrCat(upload.part_urls.size() + 1);
    LB_ASSIGN_OR_RETURN(
        upload.part_urls.emplace_back(),
        transport_.Presign({.method = "PUT",
                            .path = PathOf(key),
                            .query = {{"partNumber", number}, {"uploadId", upload_id}}},
                           {{"content-length", absl::StrCat(length)}}, expires));
  }
  LB_ASSIGN_OR_RETURN(upload.complete_url, transport_.Presign({.method = "POST",
                                                               .path = PathOf(key),
                                                               .query = {{"uploadId", upload_id}}},
                                                              {}, expires));
  return absl::OkStatus();
}

absl::StatusOr<S3Object> S3Client::Find(const std::string& key) {
  const absl::StatusOr<HttpAnswer> found =
      transport_.RunOne({.method = "HEAD", .path = PathOf(key)});
  if (absl::IsNotFound(found.status())) return ConfirmMissing(key);
  LB_RETURN_IF_ERROR(found.status());
  const HttpAnswer& answer = *found;
  S3Object object;
  object.key = key;
  object.etag = EtagOf(answer);
  std::string error;
  if (absl::SimpleAtoi(HeaderOf(answer, "content-length"), &object.size_bytes) &&
      object.size_bytes >= 0 &&
      absl::ParseTime(kHttpTime, HeaderOf(answer, "last-modified"), &object.modified, &error)) {
    return object;
  }
  return absl::InternalError(
      absl::StrCat("HEAD ", NameOf(key), ": no content-length or no last-modified"));
}

// Checks by a GET whether the object is really missing after a HEAD with status 404. Always returns
// an error; kNotFound if the object does not exist.
absl::Status S3Client::ConfirmMissing(const std::string& key) {
  const absl::Status got =
      transport_.RunOne({.path = PathOf(key), .headers = {{"Range", "bytes=0-0"}}}).status();
  if (!got.ok() && !absl::IsInternal(got)) return got;  // kInternal: no such range, it is empty
  return absl::UnavailableError(
      absl::StrCat("HEAD ", NameOf(key), ": HTTP status 404, but a GET finds the object"));
}

absl::StatusOr<std::vector<std::string>> S3Client::Get(const std::string& key,
                                                       std::span<const Range> ranges) {
  std::vector<S3Call> calls;
  for (const Range& range : ranges) {
    S3Call call{.path = PathOf(key),
                .max_answer_bytes = std::max<int64_t>(range.size, 1 << 16),
                .answer_bytes = range.size};
    call.headers.emplace_back(
        "Range", absl::StrCat("bytes=", range.offset, "-", range.offset + range.size - 1));
    calls.push_back(std::move(call));
  }
  LB_ASSIGN_OR_RETURN(std::vector<HttpAnswer> answers, transport_.Run(calls));
  std::vector<std::string> bodies;
  for (HttpAnswer& answer : answers) bodies.push_back(std::move(answer.body));
  return bodies;
}

absl::Status S3Client::Put(const std::string& key, std::span<const std::byte> bytes) {
  if (static_cast<int64_t>(bytes.size()) > options_.part_bytes) return PutParts(key, bytes);
  return transport_.RunOne({.method = "PUT", .path = PathOf(key), .body = bytes}).status();
}

absl::Status S3Client::PutParts(const std::string& key, std::span<const std::byte> bytes) {
  for (int num_failures = 1;; ++num_failures) {
    const absl::Status status = PutPartsOnce(key, bytes);
    if (!absl::IsAborted(status)) return status;
    if (num_failures >= options_.max_attempts) return absl::UnavailableError(status.message());
    base::LogInfo(absl::StrCat("multipart upload ", num_failures, " was lost: ", status.message()));
    transport_.PauseAfter(num_failures);
  }
}

// Writes an object by one multipart upload. Errors: kAborted if S3 does not know the upload any
// more, and the object does not exist either.
absl::Status S3Client::PutPartsOnce(const std::string& key, std::span<const std::byte> bytes) {
  LB_ASSIGN_OR_RETURN(const Upload upload, CreateUpload(key));
  const absl::StatusOr<std::vector<std::string>> etags = UploadParts(key, upload.id, bytes);
  const absl::Status status = etags.ok() ? Complete(key, upload, *etags, bytes) : etags.status();
  if (!status.ok()) Abort(key, upload.id);
  return status;
}

// Creates a multipart upload. If the answer is lost, another upload is created, and the first one
// stays open.
absl::StatusOr<S3Client::Upload> S3Client::CreateUpload(const std::string& key) {
  LB_ASSIGN_OR_RETURN(const HttpAnswer created, transport_.RunOne({.method = "POST",
                                                                   .path = PathOf(key),
                                                                   .query = {{"uploads", ""}},
                                                                   .closing_tag = "</UploadId>"}));
  Upload upload = {.id = XmlElement(created.body, "UploadId")};
  std::string error;  // without a date the object's age is not checked
  absl::ParseTime(kHttpTime, HeaderOf(created, "date"), &upload.created, &error);
  return upload;
}

int64_t S3Client::PartBytes(int64_t size_bytes) const {
  return std::max(options_.part_bytes, (size_bytes + kMaxParts - 1) / kMaxParts);
}

// Sends the parts; returns their ETags, in order.
absl::StatusOr<std::vector<std::string>> S3Client::UploadParts(const std::string& key,
                                                               const std::string& upload_id,
                                                               std::span<const std::byte> bytes) {
  const int64_t part_bytes = PartBytes(static_cast<int64_t>(bytes.size()));
  const size_t num_parts =
      (bytes.size() + static_cast<size_t>(part_bytes) - 1) / static_cast<size_t>(part_bytes);
  std::vector<std::string> etags;
  while (etags.size() < num_parts) {
    std::vector<S3Call> calls;
    for (size_t k = etags.size();
         k < num_parts && calls.size() < static_cast<size_t>(options_.num_parallel); ++k) {
      calls.push_back({.method = "PUT",
                       .path = PathOf(key),
                       .query = {{"partNumber", absl::StrCat(k + 1)}, {"uploadId", upload_id}},
                       .body = PartOf(bytes, k, part_bytes)});
    }
    LB_ASSIGN_OR_RETURN(const std::vector<HttpAnswer> answers, transport_.Run(calls));
    for (const HttpAnswer& answer : answers) {
      etags.push_back(EtagOf(answer));
      if (!etags.back().empty()) continue;
      return absl::InternalError(absl::StrCat("PUT ", NameOf(key), ": no etag of a part"));
    }
  }
  return etags;
}

// Completes the upload. S3 may fail after it has begun to answer 200: then the answer's closing tag
// is missing. An upload that does not exist may have been completed by a request whose answer was
// lost.
absl::Status S3Client::Complete(const std::string& key, const Upload& upload,
                                const std::vector<std::string>& etags,
                                std::span<const std::byte> bytes) {
  const std::string list = ListOfParts(etags);
  const absl::Status status =
      transport_
          .RunOne({.method = "POST",
                   .path = PathOf(key),
                   .query = {{"uploadId", upload.id}},
                   .body = std::as_bytes(std::span(list.data(), list.size())),
                   .closing_tag = "</CompleteMultipartUploadResult>",
                   .drip_limit = options_.complete_timeout})
          .status();
  if (!absl::IsAborted(status)) return status;
  LB_ASSIGN_OR_RETURN(const bool is_there, IsThere(key, upload, etags, bytes));
  return is_there ? absl::OkStatus() : status;
}

// Whether the object was made of these parts by this upload. An older one of the same bytes does
// not count, since its age would not be renewed. Where S3 encrypts with keys of its own, ETags are
// not MD5s; then the size decides.
absl::StatusOr<bool> S3Client::IsThere(const std::string& key, const Upload& upload,
                                       const std::vector<std::string>& etags,
                                       std::span<const std::byte> bytes) {
  const absl::StatusOr<S3Object> object = Find(key);
  if (absl::IsNotFound(object.status())) return false;
  if (!object.ok()) return object.status();
  if (object->size_bytes != static_cast<int64_t>(bytes.size())) return false;
  if (object->modified < upload.created - kTimeTolerance) return false;
  const int64_t part_bytes = PartBytes(static_cast<int64_t>(bytes.size()));
  for (size_t k = 0; k < etags.size(); ++k) {
    if (etags[k] != Md5Hex(PartOf(bytes, k, part_bytes))) return true;
  }
  return object->etag == EtagOfParts(etags);
}

void S3Client::DropUpload(const std::string& key, const std::string& upload_id) {
  Abort(key, upload_id, /*is_repeated=*/false);
}

void S3Client::Abort(const std::string& key, const std::string& upload_id, bool is_repeated) {
  const absl::Status aborted = transport_
                                   .RunOne({.method = "DELETE",
                                            .path = PathOf(key),
                                            .query = {{"uploadId", upload_id}},
                                            .is_repeated = is_repeated})
                                   .status();
  if (aborted.ok() || absl::IsAborted(aborted) || absl::IsNotFound(aborted)) return;
  base::LogWarning(absl::StrCat("cannot abort a multipart upload: ", aborted.ToString()));
}

absl::StatusOr<S3UploadPage> S3Client::ListUploads(const std::string& prefix,
                                                   const std::string& after_key,
                                                   const std::string& after_id) {
  S3Call call;
  call.path = absl::StrCat("/", bucket_);
  call.query = {{"uploads", ""}, {"prefix", absl::StrCat(prefix_, prefix)}};
  call.closing_tag = "</ListMultipartUploadsResult>";
  if (!after_key.empty()) {
    call.query["key-marker"] = after_key;
    call.query["upload-id-marker"] = after_id;
  }
  LB_ASSIGN_OR_RETURN(const HttpAnswer answer, transport_.RunOne(call));
  absl::StatusOr<S3UploadPage> page = ParseS3UploadPage(answer.body, prefix_);
  if (page.ok()) return page;
  return absl::InternalError(absl::StrCat("GET s3://", bucket_, ": ", page.status().message()));
}

absl::StatusOr<int64_t> S3Client::DropOldUploads(const std::string& prefix, absl::Time time) {
  int64_t num_dropped = 0;
  std::string after_key, after_id;
  do {
    LB_ASSIGN_OR_RETURN(S3UploadPage page, ListUploads(prefix, after_key, after_id));
    for (const S3OpenUpload& upload : page.uploads) {
      if (upload.begun > time) continue;
      Abort(upload.key, upload.id);
      ++num_dropped;
    }
    if (!page.next_key.empty() &&
        std::tie(page.next_key, page.next_id) == std::tie(after_key, after_id)) {
      return absl::UnavailableError(
          absl::StrCat("list of uploads of s3://", bucket_, ": it goes in circles"));
    }
    after_key = std::move(page.next_key);
    after_id = std::move(page.next_id);
  } while (!after_key.empty());
  return num_dropped;
}

absl::Status S3Client::Delete(const std::string& key) {
  const absl::Status status = transport_.RunOne({.method = "DELETE", .path = PathOf(key)}).status();
  return absl::IsNotFound(status) ? absl::OkStatus() : status;
}

absl::StatusOr<bool> S3Client::DeleteIfNotNewer(const std::string& key, absl::Time time) {
  for (int num_failures = 1;; ++num_failures) {
    const absl::StatusOr<S3Object> object = Find(key);
    if (absl::IsNotFound(object.status())) return true;
    if (!object.ok()) return object.status();
    if (object->modified > time) return false;
    const absl::Status status =
        transport_.RunOne({.method = "DELETE", .path = PathOf(key), .is_repeated = false}).status();
    if (status.ok() || absl::IsNotFound(status)) return true;
    if (!absl::IsUnavailable(status) || num_failures >= options_.max_attempts) return status;
    transport_.PauseAfter(num_failures);
  }
}

absl::StatusOr<S3Page> S3Client::List(const std::string& prefix, const std::string& token) {
  S3Call call;
  call.path = absl::StrCat("/", bucket_);
  call.query = {{"list-type", "2"}, {"prefix", absl::StrCat(prefix_, prefix)}};
  call.closing_tag = "</ListBucketResult>";
  if (!token.empty()) call.query["continuation-token"] = token;
  LB_ASSIGN_OR_RETURN(const HttpAnswer answer, transport_.RunOne(call));
  absl::StatusOr<S3Page> page = ParseS3Page(answer.body, prefix_);
  if (page.ok()) return page;
  return absl::InternalError(absl::StrCat("GET s3://", bucket_, ": ", page.status().message()));
}

}  // namespace liquidblend::store
