#include "core/store/blobs/s3_transport.h"

#include <algorithm>
#include <numeric>
#include <optional>

#include "absl/strings/ascii.h"
#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "absl/time/clock.h"
#include "core/base/log.h"
#include "core/base/retry.h"
#include "core/base/status_macros.h"
#include "core/store/blobs/s3_xml.h"

namespace liquidblend::store {
namespace {

// Clock differences up to this are not why S3 refuses a request: it tolerates 15 minutes.
constexpr absl::Duration kSkew = absl::Minutes(5);

using Verdict = S3Verdict;

// The host of an endpoint, with the port.
std::string HostOf(const std::string& endpoint) { return endpoint.substr(endpoint.find("//") + 2); }

constexpr size_t kMaxMessage = 300;
constexpr double kJitter = 0.25;
constexpr char kNoSuchBucket[] = "NoSuchBucket";
constexpr char kWrongRegion[] = "AuthorizationHeaderMalformed";

// Text of S3's messages for logs and records, without unprintable bytes.
std::string Printable(std::string text) {
  text.resize(std::min(text.size(), kMaxMessage));
  for (char& c : text) {
    if (!absl::ascii_isprint(static_cast<unsigned char>(c))) c = '?';
  }
  return text;
}

std::string S3ErrorCode(const HttpAnswer& answer) {
  return Printable(XmlElement(answer.body, "Code"));
}

bool HasWholeBody(const S3Call& call, const HttpAnswer& answer) {
  if (call.answer_bytes >= 0 && static_cast<int64_t>(answer.body.size()) != call.answer_bytes) {
    return false;
  }
  return call.closing_tag.empty() || absl::StrContains(answer.body, call.closing_tag);
}

bool IsQuota(const HttpAnswer& answer) {
  return answer.status == 507 || S3ErrorCode(answer) == "QuotaExceeded";
}

// Whether S3 itself says that there is no such object or upload: a proxy's 404 says nothing.
bool IsMissing(const S3Call& call, const HttpAnswer& answer) {
  if (answer.status != 404) return false;
  const std::string code = S3ErrorCode(answer);
  if (call.method == "HEAD" || code == "NoSuchUpload") return true;
  return code == "NoSuchKey" && (call.method == "GET" || call.method == "DELETE");
}

bool IsTransient(const HttpAnswer& answer) {
  const int status = answer.status;
  const std::string code = S3ErrorCode(answer);
  if (status < 400 || status == 408 || status == 409 || status == 429 || status >= 500) return true;
  if (status == 404) return code != kNoSuchBucket;
  return status == 400 && (code == "RequestTimeout" || code == "IncompleteBody");
}

bool IsRefused(const S3Call& call, const HttpAnswer& answer) {
  if (answer.status == 401 || answer.status == 403) return true;
  const std::string code = S3ErrorCode(answer);
  if (answer.status == 404) return code == kNoSuchBucket;
  if (answer.status != 400) return false;
  // A HEAD has no body that gives the reason; its status 400 counts as a refusal, since nothing
  // else can be wrong with it.
  return call.method == "HEAD" || code == "ExpiredToken" || code == "InvalidToken" ||
         code == "TokenRefreshRequired" || code == "RequestExpired" || code == kWrongRegion;
}

absl::StatusCode FailureOf(const HttpAnswer& answer, const std::string& code) {
  const int status = answer.status;
  if (IsQuota(answer)) return absl::StatusCode::kResourceExhausted;
  if (code == "NoSuchUpload") return absl::StatusCode::kAborted;
  if (status == 404) return absl::StatusCode::kNotFound;
  if (status == 412) return absl::StatusCode::kAlreadyExists;
  return absl::StatusCode::kInternal;
}

// Advice for the operator; empty if the answer's own message suffices.
const char* AdviceFor(const HttpAnswer& answer, const std::string& code) {
  if (code == kNoSuchBucket) return "; create the bucket, or correct the name in --blobs";
  if ((answer.status >= 300 && answer.status < 400) || code == kWrongRegion) {
    return "; AWS_REGION and AWS_ENDPOINT_URL must be those of the bucket";
  }
  return answer.status == 404 && code.empty() ? "; the answer is not one of S3" : "";
}

}  // namespace

S3Verdict JudgeS3Answer(const S3Call& call, const absl::StatusOr<HttpAnswer>& answer) {
  if (!answer.ok()) {
    return absl::IsUnavailable(answer.status()) ? Verdict::kTransient : Verdict::kFailed;
  }
  if (answer->status < 300)
    return HasWholeBody(call, *answer) ? Verdict::kDone : Verdict::kTransient;
  if (IsQuota(*answer) || IsMissing(call, *answer)) return Verdict::kFailed;
  if (IsTransient(*answer)) return Verdict::kTransient;
  return IsRefused(call, *answer) ? Verdict::kRefused : Verdict::kFailed;
}

absl::Status S3ErrorOf(const S3Call& call, const absl::StatusOr<HttpAnswer>& answer,
                       S3Verdict verdict) {
  const std::string what = absl::StrCat(call.method, " s3:/", call.path);
  if (!answer.ok()) {
    return absl::Status(answer.status().code(),
                        absl::StrCat(what, ": ", answer.status().message()));
  }
  const std::string code = S3ErrorCode(*answer);
  absl::StatusCode result = FailureOf(*answer, code);
  if (verdict == Verdict::kRefused) result = absl::StatusCode::kPermissionDenied;
  if (verdict == Verdict::kTransient) result = absl::StatusCode::kUnavailable;
  return absl::Status(result,
                      absl::StrCat(what, ": HTTP status ", answer->status,
                                   answer->status < 300 ? ", an answer that is cut short" : "",
                                   code.empty() ? "" : ", ", code, code.empty() ? "" : ": ",
                                   Printable(XmlElement(answer->body, "Message")),
                                   call.method == "HEAD" ? "" : AdviceFor(*answer, code)));
}

// Results of one round of requests.
struct S3Transport::Round {
  std::vector<size_t> open;  // still; in the order of the calls
  absl::Status error;        // of the last one that is
  bool is_slow_down = false;
  bool is_refused = false;
  Signer signer;
  std::optional<absl::Time> server_time;  // of a refusal
};

// Remedies that were tried after refusals.
struct S3Transport::Remedies {
  bool is_clock_set = false;
  bool is_renewed = false;
};

S3Transport::S3Transport(const S3Options& options)
    : options_(options),
      credentials_({options.access_key_id, options.secret_access_key, options.session_token}),
      http_(HttpOptions{.ca_file = options.ca_file,
                        .connect_timeout = options.connect_timeout,
                        .stall_timeout = options.stall_timeout}) {}

absl::Time S3Transport::Now() const {
  return absl::Now() + absl::Microseconds(clock_ahead_us_.load());
}

HttpRequest S3Transport::RequestOf(const S3Call& call, const Signer& signer) const {
  AwsRequest signed_part;
  signed_part.method = call.method;
  signed_part.host = HostOf(options_.endpoint);
  signed_part.path = call.path;
  signed_part.query = call.query;
  signed_part.body_sha256 = Sha256Hex(call.body);  // S3 compares it with what arrives
  HttpRequest request;
  request.method = call.method;
  request.url = absl::StrCat(options_.endpoint, UriEncode(call.path, EncodeSlashes::kNo),
                             call.query.empty() ? "" : "?", EncodeQuery(call.query));
  request.headers = call.headers;
  for (const auto& [name, value] :
       SignRequest(signed_part, signer.credentials, options_.region, signer.now)) {
    request.headers.emplace_back(name, value);
  }
  request.body = call.body;
  request.max_answer_bytes = call.max_answer_bytes;
  request.drip_limit = call.drip_limit;
  return request;
}

absl::StatusOr<std::string> S3Transport::Presign(const S3Call& call,
                                                 const std::map<std::string, std::string>& headers,
                                                 absl::Duration expires) {
  LB_ASSIGN_OR_RETURN(const AwsCredentials credentials, credentials_.Get());
  const std::string& endpoint = options_.client_endpoint;
  AwsRequest request;
  request.method = call.method;
  request.host = HostOf(endpoint);
  request.path = call.path;
  request.query = call.query;
  return absl::StrCat(endpoint, UriEncode(request.path, EncodeSlashes::kNo), "?",
                      PresignQuery(request, headers, credentials, options_.region, Now(), expires));
}

absl::StatusOr<S3Transport::Round> S3Transport::RunOpen(std::span<const S3Call> calls,
                                                        const std::vector<size_t>& open,
                                                        std::vector<HttpAnswer>& answers) {
  Round round;
  LB_ASSIGN_OR_RETURN(round.signer.credentials, credentials_.Get());
  round.signer.now = Now();
  std::vector<HttpRequest> requests;
  for (const size_t k : open) requests.push_back(RequestOf(calls[k], round.signer));
  std::vector<absl::StatusOr<HttpAnswer>> results = http_.Run(requests);
  for (size_t r = 0; r < results.size(); ++r) {
    const S3Call& call = calls[open[r]];
    const Verdict verdict = JudgeS3Answer(call, results[r]);
    if (verdict == Verdict::kDone) {
      answers[open[r]] = *std::move(results[r]);
      continue;
    }
    absl::Status error = S3ErrorOf(call, results[r], verdict);
    if (verdict == Verdict::kFailed) return error;
    round.open.push_back(open[r]);
    if (results[r].ok() && S3ErrorCode(*results[r]) == "SlowDown") round.is_slow_down = true;
    if (round.is_refused) continue;
    round.error = std::move(error);
    if (verdict != Verdict::kRefused) continue;
    round.is_refused = true;
    absl::Time time;
    std::string parse_error;
    const auto date = results[r]->headers.find("date");
    if (date != results[r]->headers.end() &&
        absl::ParseTime("%a, %d %b %Y %H:%M:%S GMT", date->second, &time, &parse_error)) {
      round.server_time = time;
    }
  }
  return round;
}

// Whether the requests that were refused are worth another try.
bool S3Transport::Remedy(const Round& round, Remedies& tried) {
  if (!tried.is_clock_set && round.server_time.has_value() &&
      absl::AbsDuration(*round.server_time - round.signer.now) > kSkew) {
    tried.is_clock_set = true;
    const absl::Duration ahead = *round.server_time - absl::Now();
    base::LogWarning(absl::StrCat("this machine's clock is off by ",
                                  absl::FormatDuration(absl::Trunc(ahead, absl::Seconds(1))),
                                  ": requests are signed with the time of S3"));
    clock_ahead_us_ = absl::ToInt64Microseconds(ahead);
    return true;
  }
  if (tried.is_renewed) return false;
  tried.is_renewed = true;
  return credentials_.Renew(round.signer.credentials);
}

absl::StatusOr<std::vector<HttpAnswer>> S3Transport::Run(std::span<const S3Call> calls) {
  std::vector<HttpAnswer> answers(calls.size());
  std::vector<size_t> open(calls.size());
  std::iota(open.begin(), open.end(), size_t{0});
  Remedies tried;
  for (int num_failures = 0;;) {
    LB_ASSIGN_OR_RETURN(Round round, RunOpen(calls, open, answers));
    open = std::move(round.open);
    if (open.empty()) return answers;
    if (round.is_refused) {
      if (!Remedy(round, tried)) return round.error;
      continue;
    }
    ++num_failures;
    if (num_failures >= options_.max_attempts || !calls[open.front()].is_repeated) {
      return round.error;
    }
    base::LogInfo(absl::StrCat("attempt ", num_failures, ": ", round.error.ToString()));
    absl::SleepFor(base::Jittered(options_.PauseAfter(num_failures, round.is_slow_down), kJitter));
  }
}

bool IsNoSuchBucket(const absl::Status& error) {
  return absl::IsPermissionDenied(error) &&
         absl::StrContains(error.message(), absl::StrCat(", ", kNoSuchBucket));
}

absl::StatusOr<HttpAnswer> S3Transport::RunOne(const S3Call& call) {
  LB_ASSIGN_OR_RETURN(std::vector<HttpAnswer> answers, Run({&call, 1}));
  return std::move(answers.front());
}

void S3Transport::PauseAfter(int num_failures) const {
  absl::SleepFor(
      base::Jittered(options_.PauseAfter(num_failures, /*is_slow_down=*/false), kJitter));
}

}  // namespace liquidblend::store
