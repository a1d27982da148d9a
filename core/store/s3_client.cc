#include "core/store/s3_client.h"

#include <algorithm>
#include <cstdlib>
#include <random>
#include <utility>

#include "absl/strings/match.h"
#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_replace.h"
#include "absl/time/clock.h"
#include "core/base/log.h"
#include "core/base/status_macros.h"

namespace liquidblend::store {
namespace {

constexpr int64_t kMaxParts = 10000;      // of S3
constexpr int64_t kMaxSignedParts = 100;  // an url each

std::string FirstOf(const std::string& given, std::initializer_list<const char*> variables,
                    const std::string& fallback = "") {
  if (!given.empty()) return given;
  for (const char* variable : variables) {
    const char* const value = std::getenv(variable);
    if (value != nullptr && *value != '\0') return value;
  }
  return fallback;
}

void FillFromEnvironment(S3Options& options) {
  options.region = FirstOf(options.region, {"AWS_REGION", "AWS_DEFAULT_REGION"}, "us-east-1");
  options.endpoint = FirstOf(options.endpoint, {"AWS_ENDPOINT_URL_S3", "AWS_ENDPOINT_URL"},
                             absl::StrCat("https://s3.", options.region, ".amazonaws.com"));
  options.access_key_id = FirstOf(options.access_key_id, {"AWS_ACCESS_KEY_ID"});
  options.secret_access_key = FirstOf(options.secret_access_key, {"AWS_SECRET_ACCESS_KEY"});
  options.session_token = FirstOf(options.session_token, {"AWS_SESSION_TOKEN"});
  options.ca_file = FirstOf(options.ca_file, {"AWS_CA_BUNDLE"});
  for (std::string* const endpoint : {&options.endpoint, &options.client_endpoint}) {
    while (absl::EndsWith(*endpoint, "/")) endpoint->pop_back();
  }
}

// With the port.
std::string HostOf(const std::string& endpoint) { return endpoint.substr(endpoint.find("//") + 2); }

bool IsEndpoint(const std::string& url) {
  return absl::StartsWith(url, "http://") || absl::StartsWith(url, "https://");
}

// The content of the first <tag> at or after `position`, which moves behind it; empty: there is
// none.
std::string NextElement(const std::string& xml, const std::string& tag, size_t& position) {
  const std::string open = absl::StrCat("<", tag, ">");
  const size_t begin = xml.find(open, position);
  const size_t end = begin == std::string::npos ? begin : xml.find(absl::StrCat("</", tag), begin);
  if (end == std::string::npos) {
    position = xml.size();
    return "";
  }
  position = end;
  return xml.substr(begin + open.size(), end - begin - open.size());
}

std::string Element(const std::string& xml, const std::string& tag) {
  size_t position = 0;
  return absl::StrReplaceAll(NextElement(xml, tag, position), {{"&lt;", "<"},
                                                               {"&gt;", ">"},
                                                               {"&quot;", "\""},
                                                               {"&#34;", "\""},
                                                               {"&apos;", "'"},
                                                               {"&amp;", "&"}});
}

bool MayPass(const absl::StatusOr<HttpAnswer>& answer) {
  if (!answer.ok()) return absl::IsUnavailable(answer.status());
  return answer->status == 408 || answer->status == 429 || answer->status >= 500;
}

// Between half and all of the pause, so that those who met the same trouble do not come back
// together.
absl::Duration Jittered(absl::Duration pause) {
  thread_local std::minstd_rand random{std::random_device()()};
  return pause * std::uniform_real_distribution<double>(0.5, 1.0)(random);
}

}  // namespace

absl::StatusOr<std::unique_ptr<S3Client>> S3Client::Make(const std::string& url,
                                                         S3Options options) {
  LB_RETURN_IF_ERROR(options.Validate());
  FillFromEnvironment(options);
  const std::string scheme = "s3://";
  const size_t slash = url.find('/', scheme.size());
  const std::string bucket =
      absl::StartsWith(url, scheme) ? url.substr(scheme.size(), slash - scheme.size()) : "";
  if (bucket.empty()) {
    return absl::InvalidArgumentError(absl::StrCat("'", url, "' is not s3://bucket/prefix"));
  }
  if (options.access_key_id.empty() || options.secret_access_key.empty()) {
    return absl::InvalidArgumentError(absl::StrCat(
        "no credentials for ", url, ": AWS_ACCESS_KEY_ID and AWS_SECRET_ACCESS_KEY must be set"));
  }
  for (const std::string& endpoint : {options.endpoint, options.client_endpoint}) {
    if (IsEndpoint(endpoint) || (endpoint.empty() && !options.endpoint.empty())) continue;
    return absl::InvalidArgumentError(
        absl::StrCat("endpoint '", endpoint, "' is not http://host or https://host"));
  }
  std::string prefix = slash == std::string::npos ? "" : url.substr(slash + 1);
  while (absl::EndsWith(prefix, "/")) prefix.pop_back();
  if (!prefix.empty()) prefix += "/";
  return std::unique_ptr<S3Client>(new S3Client(bucket, prefix, std::move(options)));
}

S3Client::S3Client(std::string bucket, std::string prefix, S3Options options)
    : bucket_(std::move(bucket)),
      prefix_(std::move(prefix)),
      options_(std::move(options)),
      credentials_{options_.access_key_id, options_.secret_access_key, options_.session_token},
      http_(HttpOptions{.ca_file = options_.ca_file}) {}

std::string S3Client::NameOf(const std::string& key) const {
  return absl::StrCat("s3://", bucket_, "/", prefix_, key);
}

// An empty key stands for the bucket.
std::string S3Client::PathOf(const Call& call) const {
  return absl::StrCat("/", bucket_, call.key.empty() ? "" : absl::StrCat("/", prefix_, call.key));
}

HttpRequest S3Client::RequestOf(const Call& call) const {
  AwsRequest signed_part;
  signed_part.method = call.method;
  signed_part.host = HostOf(options_.endpoint);
  signed_part.path = PathOf(call);
  signed_part.query = call.query;
  signed_part.body_sha256 = Sha256Hex(call.body);  // S3 compares it with what arrives
  HttpRequest request;
  request.method = call.method;
  request.url = absl::StrCat(options_.endpoint, UriEncode(signed_part.path, EncodeSlashes::kNo),
                             call.query.empty() ? "" : "?", EncodeQuery(call.query));
  request.headers = call.headers;
  for (const auto& [name, value] :
       SignRequest(signed_part, credentials_, options_.region, absl::Now())) {
    request.headers.emplace_back(name, value);
  }
  request.body = call.body;
  request.max_answer_bytes = call.max_answer_bytes;
  return request;
}

std::string S3Client::Presign(const Call& call, const std::map<std::string, std::string>& headers,
                              absl::Duration expires) const {
  const std::string& endpoint = options_.client_endpoint;
  AwsRequest request;
  request.method = call.method;
  request.host = HostOf(endpoint);
  request.path = PathOf(call);
  request.query = call.query;
  return absl::StrCat(
      endpoint, UriEncode(request.path, EncodeSlashes::kNo), "?",
      PresignQuery(request, headers, credentials_, options_.region, absl::Now(), expires));
}

std::string S3Client::PresignGet(const std::string& key, absl::Duration expires) const {
  return Presign({.key = key}, {}, expires);
}

absl::StatusOr<DirectUpload> S3Client::PresignPut(const std::string& key, int64_t size_bytes,
                                                  absl::Duration expires) {
  DirectUpload upload;
  if (size_bytes <= options_.part_bytes) {
    upload.part_bytes = size_bytes;
    upload.headers = {{"If-None-Match", "*"}};
    upload.part_urls = {
        Presign({.method = "PUT", .key = key},
                {{"content-length", absl::StrCat(size_bytes)}, {"if-none-match", "*"}}, expires)};
    return upload;
  }
  LB_ASSIGN_OR_RETURN(const HttpAnswer created,
                      RunOne({.method = "POST", .key = key, .query = {{"uploads", ""}}}));
  const std::string upload_id = Element(created.body, "UploadId");
  upload.part_bytes =
      std::max(options_.part_bytes, (size_bytes + kMaxSignedParts - 1) / kMaxSignedParts);
  for (int64_t begin = 0; begin < size_bytes; begin += upload.part_bytes) {
    const int64_t length = std::min(upload.part_bytes, size_bytes - begin);
    upload.part_urls.push_back(
        Presign({.method = "PUT",
                 .key = key,
                 .query = {{"partNumber", absl::StrCat(upload.part_urls.size() + 1)},
                           {"uploadId", upload_id}}},
                {{"content-length", absl::StrCat(length)}}, expires));
  }
  upload.complete_url =
      Presign({.method = "POST", .key = key, .query = {{"uploadId", upload_id}}}, {}, expires);
  return upload;
}

absl::Status S3Client::ErrorOf(const Call& call, const absl::StatusOr<HttpAnswer>& answer) const {
  const std::string what = absl::StrCat(
      call.method, " ", call.key.empty() ? absl::StrCat("s3://", bucket_) : NameOf(call.key));
  if (!answer.ok()) {
    return absl::Status(answer.status().code(),
                        absl::StrCat(what, ": ", answer.status().message()));
  }
  const int status = answer->status;
  const std::string code = Element(answer->body, "Code");
  absl::StatusCode result = absl::StatusCode::kInternal;
  if (status == 404) result = absl::StatusCode::kNotFound;
  if (status == 401 || status == 403) result = absl::StatusCode::kPermissionDenied;
  if (code == "QuotaExceeded" || status == 507) result = absl::StatusCode::kResourceExhausted;
  if (MayPass(answer)) result = absl::StatusCode::kUnavailable;
  return absl::Status(result,
                      absl::StrCat(what, ": HTTP status ", status, code.empty() ? "" : ", ", code,
                                   code.empty() ? "" : ": ", Element(answer->body, "Message")));
}

absl::StatusOr<std::vector<HttpAnswer>> S3Client::Run(std::span<const Call> calls) {
  std::vector<HttpAnswer> answers(calls.size());
  std::vector<size_t> open(calls.size());
  for (size_t k = 0; k < calls.size(); ++k) open[k] = k;
  absl::Duration pause = options_.first_pause;
  for (int attempt = 1;; ++attempt) {
    std::vector<HttpRequest> requests;
    for (const size_t k : open) requests.push_back(RequestOf(calls[k]));
    std::vector<absl::StatusOr<HttpAnswer>> results = http_.Run(requests);
    std::vector<size_t> again;
    absl::Status error;
    for (size_t r = 0; r < results.size(); ++r) {
      if (results[r].ok() && results[r]->status < 300) {
        answers[open[r]] = *std::move(results[r]);
        continue;
      }
      error = ErrorOf(calls[open[r]], results[r]);
      if (!MayPass(results[r])) return error;
      again.push_back(open[r]);
    }
    if (again.empty()) return answers;
    if (attempt >= options_.max_attempts || !calls[open.front()].is_repeated) return error;
    base::LogInfo(absl::StrCat("attempt ", attempt, ": ", error.ToString()));
    absl::SleepFor(Jittered(pause));
    pause = std::min(2 * pause, options_.longest_pause);
    open = std::move(again);
  }
}

absl::StatusOr<HttpAnswer> S3Client::RunOne(const Call& call) {
  LB_ASSIGN_OR_RETURN(std::vector<HttpAnswer> answers, Run({&call, 1}));
  return std::move(answers.front());
}

absl::StatusOr<S3Object> S3Client::Find(const std::string& key) {
  LB_ASSIGN_OR_RETURN(const HttpAnswer answer, RunOne({.method = "HEAD", .key = key}));
  S3Object object;
  object.key = key;
  const auto length = answer.headers.find("content-length");
  const auto modified = answer.headers.find("last-modified");
  std::string error;
  if (length != answer.headers.end() && modified != answer.headers.end() &&
      absl::SimpleAtoi(length->second, &object.size_bytes) &&
      absl::ParseTime("%a, %d %b %Y %H:%M:%S GMT", modified->second, &object.modified, &error)) {
    return object;
  }
  return absl::InternalError(
      absl::StrCat("HEAD ", NameOf(key), ": no content-length or no last-modified"));
}

absl::StatusOr<std::vector<std::string>> S3Client::Get(const std::string& key,
                                                       std::span<const Range> ranges) {
  std::vector<Call> calls;
  for (const Range& range : ranges) {
    Call call{.key = key, .max_answer_bytes = std::max<int64_t>(range.size, 1 << 16)};
    call.headers.emplace_back(
        "Range", absl::StrCat("bytes=", range.offset, "-", range.offset + range.size - 1));
    calls.push_back(std::move(call));
  }
  LB_ASSIGN_OR_RETURN(std::vector<HttpAnswer> answers, Run(calls));
  std::vector<std::string> bodies;
  for (size_t k = 0; k < answers.size(); ++k) {
    if (answers[k].body.size() != static_cast<size_t>(ranges[k].size)) {
      return absl::DataLossError(absl::StrCat("GET ", NameOf(key), ": ", answers[k].body.size(),
                                              " bytes instead of ", ranges[k].size));
    }
    bodies.push_back(std::move(answers[k].body));
  }
  return bodies;
}

absl::Status S3Client::Put(const std::string& key, std::span<const std::byte> bytes) {
  if (static_cast<int64_t>(bytes.size()) > options_.part_bytes) return PutParts(key, bytes);
  return RunOne({.method = "PUT", .key = key, .body = bytes}).status();
}

absl::Status S3Client::PutParts(const std::string& key, std::span<const std::byte> bytes) {
  LB_ASSIGN_OR_RETURN(const HttpAnswer created,
                      RunOne({.method = "POST", .key = key, .query = {{"uploads", ""}}}));
  const std::string upload_id = Element(created.body, "UploadId");
  absl::StatusOr<std::string> parts = UploadParts(key, upload_id, bytes);
  absl::Status status = parts.status();
  if (status.ok()) {
    const auto body = std::as_bytes(std::span(parts->data(), parts->size()));
    const auto completed =
        RunOne({.method = "POST", .key = key, .query = {{"uploadId", upload_id}}, .body = body});
    status = completed.status();
    // S3 may find out that it cannot after it has begun to answer 200.
    if (completed.ok() && absl::StrContains(completed->body, "<Error>")) {
      status = absl::UnavailableError(
          absl::StrCat("POST ", NameOf(key), ": ", Element(completed->body, "Code")));
    }
  }
  if (status.ok()) return status;
  const absl::Status aborted =
      RunOne({.method = "DELETE", .key = key, .query = {{"uploadId", upload_id}}}).status();
  if (!aborted.ok()) {
    base::LogWarning(absl::StrCat("parts may be left over: ", aborted.ToString()));
  }
  return status;
}

int64_t S3Client::PartBytes(int64_t size_bytes) const {
  return std::max(options_.part_bytes, (size_bytes + kMaxParts - 1) / kMaxParts);
}

// The list of parts that completes the upload.
absl::StatusOr<std::string> S3Client::UploadParts(const std::string& key,
                                                  const std::string& upload_id,
                                                  std::span<const std::byte> bytes) {
  const auto size = static_cast<int64_t>(bytes.size());
  const int64_t part_bytes = PartBytes(size);
  std::string list = "<CompleteMultipartUpload>";
  int number = 0;
  for (int64_t begin = 0; begin < size;) {
    std::vector<Call> calls;
    for (; begin < size && calls.size() < static_cast<size_t>(options_.num_parallel);
         begin += part_bytes) {
      const int64_t length = std::min(part_bytes, size - begin);
      const std::string part = absl::StrCat(number + static_cast<int>(calls.size()) + 1);
      calls.push_back(
          {.method = "PUT",
           .key = key,
           .query = {{"partNumber", part}, {"uploadId", upload_id}},
           .body = bytes.subspan(static_cast<size_t>(begin), static_cast<size_t>(length))});
    }
    LB_ASSIGN_OR_RETURN(const std::vector<HttpAnswer> answers, Run(calls));
    for (const HttpAnswer& answer : answers) {
      const auto tag = answer.headers.find("etag");
      if (tag == answer.headers.end()) {
        return absl::InternalError(absl::StrCat("PUT ", NameOf(key), ": no etag of a part"));
      }
      absl::StrAppend(&list, "<Part><PartNumber>", ++number, "</PartNumber><ETag>", tag->second,
                      "</ETag></Part>");
    }
  }
  return absl::StrCat(list, "</CompleteMultipartUpload>");
}

absl::Status S3Client::Delete(const std::string& key) {
  const absl::Status status = RunOne({.method = "DELETE", .key = key}).status();
  return absl::IsNotFound(status) ? absl::OkStatus() : status;
}

absl::StatusOr<bool> S3Client::DeleteIfNotNewer(const std::string& key, absl::Time time) {
  const absl::StatusOr<S3Object> object = Find(key);
  if (absl::IsNotFound(object.status())) return true;
  if (!object.ok()) return object.status();
  if (object->modified > time) return false;
  const absl::Status status =
      RunOne({.method = "DELETE", .key = key, .is_repeated = false}).status();
  if (status.ok() || absl::IsNotFound(status)) return true;
  return status;
}

absl::StatusOr<S3Page> S3Client::List(const std::string& prefix, const std::string& token) {
  Call call;
  call.query = {{"list-type", "2"}, {"prefix", absl::StrCat(prefix_, prefix)}};
  if (!token.empty()) call.query["continuation-token"] = token;
  LB_ASSIGN_OR_RETURN(const HttpAnswer answer, RunOne(call));
  S3Page page;
  for (size_t position = 0;;) {
    const std::string content = NextElement(answer.body, "Contents", position);
    if (content.empty()) break;
    S3Object object;
    object.key = Element(content, "Key");
    std::string error;
    if (!absl::StartsWith(object.key, prefix_) ||
        !absl::SimpleAtoi(Element(content, "Size"), &object.size_bytes) ||
        !absl::ParseTime(absl::RFC3339_full, Element(content, "LastModified"), &object.modified,
                         &error)) {
      return absl::InternalError(
          absl::StrCat("GET s3://", bucket_, ": a list that makes no sense"));
    }
    object.key = object.key.substr(prefix_.size());
    page.objects.push_back(std::move(object));
  }
  page.next_token = Element(answer.body, "NextContinuationToken");
  return page;
}

}  // namespace liquidblend::store
