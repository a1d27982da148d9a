#include "server/http/exchange/replies.h"

#include <algorithm>
#include <utility>
#include <vector>

#include "absl/strings/ascii.h"
#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "absl/strings/str_join.h"
#include "absl/strings/str_split.h"
#include "absl/strings/strip.h"
#include "absl/time/time.h"
#include "server/base/errors.h"
#include "server/base/status_details.h"
#include "server/transcode/json.h"

namespace liquidblend::http {
namespace {

constexpr char kContentType[] = "Content-Type";
constexpr int kCloseWithoutError = 1000;
constexpr int kFirstOwnClose = 4000;
constexpr int kClientLeaves = 1001;
constexpr int kCloseWithoutCode = 1005;
constexpr int kNoCloseFrame = 1006;
constexpr size_t kMaxReason = 123;

// FNV-1a.
uint64_t Hash(const std::string& bytes) {
  uint64_t hash = 0xcbf29ce484222325;
  for (const char c : bytes) hash = (hash ^ static_cast<unsigned char>(c)) * 0x100000001b3;
  return hash;
}

// In whole seconds, which is all that HTTP knows; at least one.
int64_t RetryAfterSeconds(const absl::Status& error) {
  const absl::Duration delay = absl::Ceil(server::RetryDelay(error), absl::Seconds(1));
  return std::max<int64_t>(1, absl::ToInt64Seconds(delay));
}

// PLY has no registered type.
const char* TypeOf(v1::Encoding::Format format) {
  if (format == v1::Encoding::PLY) return "application/octet-stream";
  if (format == v1::Encoding::MESHOPT) return "application/x-protobuf";
  return format == v1::Encoding::OBJ ? "model/obj" : "model/vnd.draco";
}

Response JsonText(std::string json) {
  Response response;
  response.headers = {{kContentType, "application/json"}, {"Cache-Control", "no-cache"}};
  response.body = std::move(json);
  return response;
}

std::string BoundsText(const v1::Bounds& bounds) {
  const v1::Vector3 &min = bounds.min(), &max = bounds.max();
  return absl::StrJoin({min.x(), min.y(), min.z(), max.x(), max.y(), max.z()}, ",");
}

}  // namespace

const char kExposedHeaders[] =
    "ETag, X-Liquidblend-Version, X-Liquidblend-Frame-Number, X-Liquidblend-Time, "
    "X-Liquidblend-Weights, "
    "X-Liquidblend-Extrapolated, X-Liquidblend-Clamped, X-Liquidblend-Vertices, "
    "X-Liquidblend-Triangles, X-Liquidblend-Bounds, X-Request-Id";

int HttpCode(absl::StatusCode code) {
  switch (code) {
    case absl::StatusCode::kOk:
      return 200;
    case absl::StatusCode::kInvalidArgument:
    case absl::StatusCode::kOutOfRange:
    case absl::StatusCode::kFailedPrecondition:
      return 400;
    case absl::StatusCode::kUnauthenticated:
      return 401;
    case absl::StatusCode::kPermissionDenied:
      return 403;
    case absl::StatusCode::kNotFound:
      return 404;
    case absl::StatusCode::kAlreadyExists:
    case absl::StatusCode::kAborted:
      return 409;
    case absl::StatusCode::kResourceExhausted:
      return 429;
    case absl::StatusCode::kCancelled:
      return 499;
    case absl::StatusCode::kUnimplemented:
      return 501;
    case absl::StatusCode::kUnavailable:
      return 503;
    case absl::StatusCode::kDeadlineExceeded:
      return 504;
    default:
      return 500;
  }
}

std::string ErrorJson(const absl::Status& error, transcode::JsonLayout layout) {
  google::rpc::Status details = server::ToStatusDetails(error);
  // Details from a newer worker may be of types that this program does not know.
  absl::StatusOr<std::string> json = transcode::JsonOf(details, layout);
  if (json.ok()) return *std::move(json);
  details.clear_details();
  json = transcode::JsonOf(details, layout);
  return json.ok() ? *std::move(json) : "{}";  // the message is not UTF-8
}

Response ErrorReply(const absl::Status& error, int http_code) {
  Response response = JsonText(ErrorJson(error, transcode::JsonLayout::kLines));
  response.code = http_code == 0 ? HttpCode(error.code()) : http_code;
  response.error = server::CleanText(error.message());
  if (response.code == 429 || response.code == 503) {
    response.headers.emplace_back("Retry-After", absl::StrCat(RetryAfterSeconds(error)));
  }
  if (response.code == 401) response.headers.emplace_back("WWW-Authenticate", "Bearer");
  return response;
}

int CloseCode(const absl::Status& end) {
  return end.ok() ? kCloseWithoutError : kFirstOwnClose + HttpCode(end.code());
}

std::string CloseReason(const absl::Status& end) {
  if (end.ok()) return "the animation has ended";
  return server::CleanText(end.message(), kMaxReason);
}

int ClientCloseCode(int code) {
  switch (code) {
    case 0:
    case kNoCloseFrame:
      return kNoCloseFrame;
    case kCloseWithoutError:
    case kClientLeaves:
    case kCloseWithoutCode:
      return code;
    default:
      return kOtherClose;
  }
}

Response TextReply(std::string text) {
  Response response;
  response.headers = {{kContentType, "text/plain; charset=utf-8"}, {"Cache-Control", "no-store"}};
  response.body = std::move(text);
  return response;
}

Response JsonReply(const google::protobuf::Message& message) {
  absl::StatusOr<std::string> json = transcode::JsonOf(message);
  return json.ok() ? JsonText(*std::move(json)) : ErrorReply(json.status());
}

std::string FrameTag(v1::GetFrameRequest request, int64_t version, const std::string& generation,
                     const std::string& program) {
  request.set_version(version);
  const uint64_t hash =
      Hash(absl::StrCat(program, "\n", generation, "\n", request.SerializeAsString()));
  return absl::StrFormat("\"%d-%016x\"", version, hash);
}

bool HasTag(const std::string& if_none_match, const std::string& tag) {
  const std::vector<std::string> tags = absl::StrSplit(if_none_match, ',');
  return std::any_of(tags.begin(), tags.end(), [&](const std::string& text) {
    const absl::string_view one = absl::StripPrefix(absl::StripAsciiWhitespace(text), "W/");
    return one == tag || one == "*";
  });
}

int64_t NewestTagged(const std::string& if_none_match) {
  int64_t newest = 0;
  for (const absl::string_view text : absl::StrSplit(if_none_match, ',')) {
    absl::string_view tag = absl::StripPrefix(absl::StripAsciiWhitespace(text), "W/");
    int64_t version = 0;
    const bool is_quoted = absl::ConsumePrefix(&tag, "\"");
    const bool is_ours = is_quoted && absl::SimpleAtoi(tag.substr(0, tag.find('-')), &version);
    if (is_ours) newest = std::max(newest, version);
  }
  return newest;
}

Response FrameReply(v1::Frame frame, v1::Encoding::Format format) {
  Response response;
  response.headers = {{kContentType, TypeOf(format)},
                      {"X-Liquidblend-Version", absl::StrCat(frame.version())},
                      {"X-Liquidblend-Time", absl::StrCat(frame.time_s())},
                      {"X-Liquidblend-Weights", absl::StrJoin(frame.weights(), ",")},
                      {"X-Liquidblend-Vertices", absl::StrCat(frame.num_vertices())},
                      {"X-Liquidblend-Triangles", absl::StrCat(frame.num_triangles())}};
  if (frame.has_bounds()) {
    response.headers.emplace_back("X-Liquidblend-Bounds", BoundsText(frame.bounds()));
  }
  if (frame.extrapolated()) response.headers.emplace_back("X-Liquidblend-Extrapolated", "true");
  if (frame.clamped()) response.headers.emplace_back("X-Liquidblend-Clamped", "true");
  response.body = std::move(*frame.mutable_data());
  response.is_frame = true;
  return response;
}

Response AnimationFrameReply(v1::AnimationFrame& frame, v1::Encoding::Format format,
                             const std::string& if_none_match, bool is_private) {
  Response response;
  const std::string tag = absl::StrFormat("\"%016x\"", Hash(frame.data()));
  response.headers = {{kContentType, TypeOf(format)},
                      {"ETag", tag},
                      {"Cache-Control", is_private ? "private, no-cache" : "public, no-cache"},
                      {"X-Liquidblend-Frame-Number", absl::StrCat(frame.frame_number())},
                      {"X-Liquidblend-Time", absl::StrCat(frame.time_s())},
                      {"X-Liquidblend-Vertices", absl::StrCat(frame.num_vertices())},
                      {"X-Liquidblend-Triangles", absl::StrCat(frame.num_triangles())}};
  if (frame.has_bounds()) {
    response.headers.emplace_back("X-Liquidblend-Bounds", BoundsText(frame.bounds()));
  }
  if (HasTag(if_none_match, tag)) {
    response.code = 304;
    return response;
  }
  response.body = std::move(*frame.mutable_data());
  return response;
}

void AddCaching(const v1::GetFrameRequest& request, const std::string& tag, bool is_private,
                Response& response) {
  const char* const scope = is_private ? "private" : "public";
  response.headers.emplace_back("ETag", tag);
  response.headers.emplace_back(
      "Cache-Control",
      absl::StrCat(scope, request.version() != 0 ? ", immutable, max-age=31536000" : ", no-cache"));
}

}  // namespace liquidblend::http
