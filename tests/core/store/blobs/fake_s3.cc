#include "tests/core/store/blobs/fake_s3.h"

#include <openssl/evp.h>

#include <cstdlib>
#include <utility>

#include "absl/strings/escaping.h"
#include "absl/strings/match.h"
#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_split.h"
#include "absl/time/clock.h"

namespace liquidblend::store {
namespace {

constexpr size_t kPageSize = 3;  // small, so that there are several
constexpr absl::Duration kDripPause = absl::Milliseconds(50);
constexpr size_t kNumSpaces = 80;
constexpr size_t kLongBodyBytes = size_t{17} << 20;
constexpr int kNumHeaders = 1024;
constexpr size_t kHeaderBytes = 1024;
constexpr absl::Duration kMostSkew = absl::Minutes(15);
constexpr char kHttpDate[] = "%a, %d %b %Y %H:%M:%S GMT";

std::string ErrorXml(absl::string_view code) {
  return absl::StrCat("<Error><Code>", code, "</Code><Message>planned</Message></Error>");
}

std::string Md5(absl::string_view bytes) {
  unsigned char digest[16];
  EVP_Digest(bytes.data(), bytes.size(), digest, nullptr, EVP_md5(), nullptr);
  return std::string(reinterpret_cast<const char*>(digest), sizeof(digest));
}

std::string Md5Hex(absl::string_view bytes) { return absl::BytesToHexString(Md5(bytes)); }

// Whether the fault damages the body of an answer.
bool IsOfAnswer(FakeS3::Fault fault) {
  using Fault = FakeS3::Fault;
  return fault == Fault::kTruncate || fault == Fault::kErrorInBody || fault == Fault::kFlip ||
         fault == Fault::kDrip;
}

std::string EtagLine(absl::string_view etag) { return absl::StrCat("ETag: \"", etag, "\"\r\n"); }

}  // namespace

FakeS3::FakeS3()
    : http_(std::make_unique<HttpFake>(
          HttpFake::RawHandler([this](HttpFake::Connection& connection, Request request) {
            Handle(connection, std::move(request));
          }))) {}

FakeS3::~FakeS3() {
  {
    const absl::MutexLock lock(&mutex_);
    faults_.clear();
  }
  StopHanging();
  http_.reset();
}

void FakeS3::Plan(const std::string& kind, std::vector<Fault> faults) {
  const absl::MutexLock lock(&mutex_);
  faults_[kind].assign(faults.begin(), faults.end());
}

void FakeS3::SetFault(Fault fault) {
  const absl::MutexLock lock(&mutex_);
  fault_of_all_ = fault;
}

void FakeS3::StopHanging() {
  const absl::MutexLock lock(&mutex_);
  if (fault_of_all_ == Fault::kHang) fault_of_all_ = Fault::kNone;
  ++hang_round_;
}

void FakeS3::SetClockAhead(absl::Duration ahead) {
  const absl::MutexLock lock(&mutex_);
  clock_ahead_ = ahead;
}

void FakeS3::SetKeyId(const std::string& key_id) {
  const absl::MutexLock lock(&mutex_);
  key_id_ = key_id;
}

void FakeS3::ExpireToken(const std::string& token) {
  const absl::MutexLock lock(&mutex_);
  expired_tokens_.insert(token);
}

void FakeS3::SetListLag(absl::Duration lag) {
  const absl::MutexLock lock(&mutex_);
  list_lag_ = lag;
}

int FakeS3::Count(const std::string& kind) {
  const absl::MutexLock lock(&mutex_);
  return counts_[kind];
}

int FakeS3::NumMet(Fault fault) {
  const absl::MutexLock lock(&mutex_);
  return num_met_[fault];
}

void FakeS3::CountMet(Fault fault) {
  const absl::MutexLock lock(&mutex_);
  ++num_met_[fault];
}

int FakeS3::NumHanging() {
  const absl::MutexLock lock(&mutex_);
  return num_hanging_;
}

std::map<std::string, std::string> FakeS3::Objects() {
  const absl::MutexLock lock(&mutex_);
  std::map<std::string, std::string> contents;
  for (const auto& [key, object] : objects_) contents[key] = object.content;
  return contents;
}

int FakeS3::NumOpenUploads() {
  const absl::MutexLock lock(&mutex_);
  return static_cast<int>(uploads_.size());
}

absl::Time FakeS3::Now() const { return absl::Now() + clock_ahead_; }

void FakeS3::Hang() {
  const absl::MutexLock lock(&mutex_);
  ++num_hanging_;
  const auto is_over = [this, round = hang_round_] {
    mutex_.AssertHeld();
    return hang_round_ != round;
  };
  mutex_.Await(absl::Condition(&is_over));
  --num_hanging_;
}

void FakeS3::Drip(HttpFake::Connection& connection, const Answer& answer, size_t num_slow) {
  connection.Send(answer, 0);
  const absl::MutexLock lock(&mutex_);
  const auto is_over = [this, round = hang_round_] {
    mutex_.AssertHeld();
    return hang_round_ != round;
  };
  for (size_t k = 0; k < num_slow; ++k) {
    if (!connection.SendMore(answer.body.substr(k, 1))) return;
    if (mutex_.AwaitWithTimeout(absl::Condition(&is_over), kDripPause)) return;
  }
  connection.SendMore(answer.body.substr(num_slow));
}

void FakeS3::Handle(HttpFake::Connection& connection, Request request) {
  const Fault fault = NextFault(request);
  if (!IsOfAnswer(fault) && fault != Fault::kUploadVanished) CountMet(fault);
  if (fault == Fault::kReset) return connection.Reset();
  if (fault == Fault::kHang) {
    Hang();
    return connection.Reset();
  }
  if (fault == Fault::kUploadVanished) {
    const absl::MutexLock lock(&mutex_);
    num_met_[fault] += static_cast<int>(uploads_.erase(request.query["uploadId"]));
  }
  Answer answer;
  if (fault == Fault::kStatus500) answer = {500, ErrorXml("InternalError")};
  if (fault == Fault::kStatus503) answer = {503, ErrorXml("SlowDown")};
  if (fault == Fault::kStatus403) answer = {403, ErrorXml("AccessDenied")};
  if (fault == Fault::kExpiredToken) answer = {403, ErrorXml("ExpiredToken")};
  if (fault == Fault::kNoSuchBucket) answer = {404, ErrorXml("NoSuchBucket")};
  if (fault == Fault::kPlain404) answer = {404, "<html>default backend</html>"};
  if (fault == Fault::kRedirect) answer = {301, ErrorXml("PermanentRedirect")};
  if (fault == Fault::kWrongRegion) answer = {400, ErrorXml("AuthorizationHeaderMalformed")};
  if (answer.status == 200) answer = Do(request);
  if (fault == Fault::kAnswerLost) return connection.Reset();
  Send(connection, request, fault, std::move(answer));
}

void FakeS3::Send(HttpFake::Connection& connection, const Request& request, Fault fault,
                  Answer answer) {
  {
    const absl::MutexLock lock(&mutex_);
    absl::StrAppend(&answer.headers,
                    "Date: ", absl::FormatTime(kHttpDate, Now(), absl::UTCTimeZone()), "\r\n");
  }
  if (IsOfAnswer(fault) && !answer.body.empty() && request.method != "HEAD") CountMet(fault);
  if (fault == Fault::kFlip && !answer.body.empty()) answer.body[answer.body.size() / 2] ^= 4;
  if (fault == Fault::kErrorInBody) {
    answer.body = answer.body.substr(0, answer.body.size() / 2) + ErrorXml("InternalError");
  }
  if (fault == Fault::kDrip && request.method != "HEAD") {
    return Drip(connection, answer, answer.body.size());
  }
  if (fault == Fault::kSpaces) {
    answer.body.insert(0, kNumSpaces, ' ');
    return Drip(connection, answer, kNumSpaces);
  }
  if (fault == Fault::kLongBody) answer.body.append(kLongBodyBytes, ' ');
  if (fault == Fault::kManyHeaders) {
    for (int k = 0; k < kNumHeaders; ++k) {
      absl::StrAppend(&answer.headers, "X-", k, ": ", std::string(kHeaderBytes, 'x'), "\r\n");
    }
  }
  size_t num_sent = request.method == "HEAD" ? 0 : answer.body.size();
  if (fault == Fault::kTruncate) num_sent /= 2;
  connection.Send(answer, num_sent);
}

std::string FakeS3::KindOf(const Request& request) {
  if (request.query.count("uploads") > 0) {
    return request.method == "GET" ? "list uploads" : "create upload";
  }
  if (request.query.count("list-type") > 0) return "list";
  if (request.query.count("uploadId") == 0) return "";
  if (request.method == "PUT") return "upload part";
  return request.method == "POST" ? "complete upload" : "abort upload";
}

FakeS3::Fault FakeS3::TakePlanned(const std::string& kind) {
  ++counts_[kind];
  std::deque<Fault>& faults = faults_[kind];
  if (faults.empty()) return Fault::kNone;
  const Fault fault = faults.front();
  faults.pop_front();
  return fault;
}

FakeS3::Fault FakeS3::NextFault(const Request& request) {
  const absl::MutexLock lock(&mutex_);
  const Fault of_method = TakePlanned(request.method);
  const std::string kind = KindOf(request);
  const Fault of_kind = kind.empty() ? Fault::kNone : TakePlanned(kind);
  if (of_method != Fault::kNone) return of_method;
  return of_kind != Fault::kNone ? of_kind : fault_of_all_;
}

FakeS3::Answer FakeS3::Refusal(const Request& request) {
  const auto header = [&](const char* name) {
    const auto found = request.headers.find(name);
    return found == request.headers.end() ? std::string() : found->second;
  };
  absl::Time date;
  std::string error;
  if (absl::ParseTime("%E4Y%m%dT%H%M%SZ", header("x-amz-date"), &date, &error) &&
      absl::AbsDuration(date - Now()) > kMostSkew) {
    return {403, ErrorXml("RequestTimeTooSkewed")};
  }
  if (expired_tokens_.count(header("x-amz-security-token")) > 0) {
    return {400, ErrorXml("ExpiredToken")};
  }
  if (!key_id_.empty() &&
      !absl::StrContains(header("authorization"), absl::StrCat("Credential=", key_id_, "/"))) {
    return {403, ErrorXml("InvalidAccessKeyId")};
  }
  return {};
}

FakeS3::Answer FakeS3::Do(const Request& request) {
  const absl::MutexLock lock(&mutex_);
  Answer refusal = Refusal(request);
  if (refusal.status != 200) return refusal;
  const std::string bucket = "/bucket";
  if (!absl::StartsWith(request.path, bucket)) return {404, ErrorXml("NoSuchBucket")};
  const std::string key =
      request.path.size() > bucket.size() ? request.path.substr(bucket.size() + 1) : "";
  if (key.empty()) return request.query.count("uploads") > 0 ? ListUploads(request) : List(request);
  if (request.query.count("uploads") + request.query.count("uploadId") > 0) {
    return DoUpload(request, key);
  }
  return DoObject(request, key);
}

FakeS3::Answer FakeS3::DoObject(const Request& request, const std::string& key) {
  const auto object = objects_.find(key);
  if (request.method == "PUT") {
    if (object != objects_.end() && request.headers.count("if-none-match") > 0) {
      return {412, ErrorXml("PreconditionFailed")};
    }
    objects_[key] = {request.body, Md5Hex(request.body), Now()};
    return {200, "", EtagLine(objects_[key].etag)};
  }
  if (request.method == "DELETE")
    return objects_.erase(key) > 0 ? Answer{204} : Answer{404, ErrorXml("NoSuchKey")};
  if (object == objects_.end()) return {404, ErrorXml("NoSuchKey")};
  const std::string& content = object->second.content;
  const auto range = request.headers.find("range");
  if (range == request.headers.end()) {
    const std::string modified =
        absl::FormatTime(kHttpDate, object->second.modified, absl::UTCTimeZone());
    return {200, content,
            absl::StrCat("Last-Modified: ", modified, "\r\n", EtagLine(object->second.etag))};
  }
  size_t begin = 0, last = 0;
  const std::vector<std::string> ends =
      absl::StrSplit(range->second.substr(std::string("bytes=").size()), '-');
  if (!absl::SimpleAtoi(ends[0], &begin) || !absl::SimpleAtoi(ends[1], &last) ||
      begin >= content.size()) {
    return {416, ErrorXml("InvalidRange")};
  }
  return {206, content.substr(begin, last - begin + 1)};
}

FakeS3::Answer FakeS3::DoUpload(const Request& request, const std::string& key) {
  if (request.query.count("uploads") > 0) {
    const std::string id = absl::StrCat("upload ", ++num_uploads_);
    uploads_[id] = {key, Now(), {}};
    return {200, absl::StrCat("<InitiateMultipartUploadResult><UploadId>", id,
                              "</UploadId></InitiateMultipartUploadResult>")};
  }
  const auto upload = uploads_.find(request.query.at("uploadId"));
  if (upload == uploads_.end()) return {404, ErrorXml("NoSuchUpload")};
  if (request.method == "PUT") {
    int number = 0;
    if (!absl::SimpleAtoi(request.query.at("partNumber"), &number)) return {400};
    upload->second.parts[number] = request.body;
    return {200, "", EtagLine(Md5Hex(request.body))};
  }
  if (request.method == "POST") return Complete(request, key);
  uploads_.erase(upload);
  return {204};
}

FakeS3::Answer FakeS3::Complete(const Request& request, const std::string& key) {
  const auto upload = uploads_.find(request.query.at("uploadId"));
  std::string whole, digests;
  for (const auto& [number, part] : upload->second.parts) {
    if (!absl::StrContains(request.body, absl::StrCat("<PartNumber>", number, "</PartNumber><ETag>",
                                                      "\"", Md5Hex(part), "\""))) {
      return {400, ErrorXml("InvalidPart")};
    }
    whole += part;
    digests += Md5(part);
  }
  const std::string etag = absl::StrCat(Md5Hex(digests), "-", upload->second.parts.size());
  uploads_.erase(upload);
  objects_[key] = {std::move(whole), etag, Now()};
  return {200, absl::StrCat("<CompleteMultipartUploadResult><ETag>\"", etag,
                            "\"</ETag></CompleteMultipartUploadResult>")};
}

// In the order of their ids, not of their keys.
FakeS3::Answer FakeS3::ListUploads(const Request& request) {
  const auto get = [&](const char* name) {
    const auto found = request.query.find(name);
    return found == request.query.end() ? std::string() : found->second;
  };
  std::string body = "<ListMultipartUploadsResult>";
  size_t count = 0;
  std::string last_key, last_id;
  for (const auto& [id, upload] : uploads_) {
    if (!absl::StartsWith(upload.key, get("prefix")) || id <= get("upload-id-marker")) continue;
    if (count++ == kPageSize) {
      absl::StrAppend(&body, "<IsTruncated>true</IsTruncated><NextKeyMarker>", last_key,
                      "</NextKeyMarker><NextUploadIdMarker>", last_id, "</NextUploadIdMarker>");
      break;
    }
    last_key = upload.key;
    last_id = id;
    absl::StrAppend(&body, "<Upload><Key>", upload.key, "</Key><UploadId>", id,
                    "</UploadId><Initiated>",
                    absl::FormatTime("%Y-%m-%dT%H:%M:%S.000Z", upload.begun, absl::UTCTimeZone()),
                    "</Initiated></Upload>");
  }
  return {200, body + "</ListMultipartUploadsResult>"};
}

FakeS3::Answer FakeS3::List(const Request& request) {
  const auto get = [&](const char* name) {
    const auto found = request.query.find(name);
    return found == request.query.end() ? std::string() : found->second;
  };
  std::string body = "<ListBucketResult>";
  size_t count = 0;
  std::string last;
  for (const auto& [key, object] : objects_) {
    if (!absl::StartsWith(key, get("prefix")) || key <= get("continuation-token")) continue;
    if (list_lag_ > absl::ZeroDuration() && object.modified > Now() - list_lag_) continue;
    if (count++ == kPageSize) {
      absl::StrAppend(&body, "<NextContinuationToken>", last, "</NextContinuationToken>");
      break;
    }
    last = key;
    absl::StrAppend(
        &body, "<Contents><Key>", key, "</Key><LastModified>",
        absl::FormatTime("%Y-%m-%dT%H:%M:%S.000Z", object.modified, absl::UTCTimeZone()),
        "</LastModified><Size>", object.content.size(), "</Size></Contents>");
  }
  return {200, body + "</ListBucketResult>"};
}

}  // namespace liquidblend::store
