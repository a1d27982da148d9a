// Results of methods -> answers of HTTP.
#pragma once

#include <string>

#include "absl/status/status.h"
#include "core/base/version.h"
#include "google/protobuf/message.h"
#include "liquidblend/v1/liquidblend.pb.h"
#include "server/http/exchange/messages.h"
#include "server/transcode/json.h"

namespace liquidblend::http {

// The code of HTTP for a status code, as Google's APIs map them.
int HttpCode(absl::StatusCode code);

// google.rpc.Status as JSON, with the code's own headers (Retry-After, WWW-Authenticate).
// http_code 0: HttpCode(). Requires: !error.ok().
Response ErrorReply(const absl::Status& error, int http_code = 0);

// The same JSON alone.
std::string ErrorJson(const absl::Status& error, transcode::JsonLayout layout);

Response TextReply(std::string text);

// protobuf's JSON of the message, or why it has none.
Response JsonReply(const google::protobuf::Message& message);

// A strong entity tag, quotes included. It is a function of the request, the family's version and
// content, and the program. The content counts because after a backup was restored, a version
// number may come again with other content.
//   generation  of the family that frames are made from
//   program     the build that makes them
std::string FrameTag(v1::GetFrameRequest request, int64_t version, const std::string& generation,
                     const std::string& program = base::Version());

// Whether the value of If-None-Match has the tag, or is "*".
bool HasTag(const std::string& if_none_match, const std::string& tag);

// The newest version among the value's tags; 0 if there is none.
int64_t NewestTagged(const std::string& if_none_match);

// The frame's bytes in the requested format, and its other fields as headers.
Response FrameReply(v1::Frame frame, v1::Encoding::Format format);

// Likewise of an animation's frame; 304 if the client has it.
//   is_private  the answer depends on the caller
Response AnimationFrameReply(v1::AnimationFrame& frame, v1::Encoding::Format format,
                             const std::string& if_none_match, bool is_private);

// Adds headers for codes 200 and 304 of a frame: tag, and how long it may be cached. A frame of a
// requested version never changes; other frames have to be revalidated.
//   is_private  the answer depends on the caller
void AddCaching(const v1::GetFrameRequest& request, const std::string& tag, bool is_private,
                Response& response);

// Close code of a WebSocket whose stream ended with this status: 1000, or 4000 and the code of
// HTTP; and the reason, cut to 123 bytes.
int CloseCode(const absl::Status& end);
std::string CloseReason(const absl::Status& end);

// Code under which the close frame of a client is counted and logged. 1000, 1001, 1005 (without a
// code) and 1006 (no close frame came, as for 0) are themselves. The others are kOtherClose:
// clients may choose among 62,000, some of which would look like errors of the server.
int ClientCloseCode(int code);
inline constexpr int kOtherClose = 4000;  // CloseCode() never is

// Headers of FrameReply() and AddCaching() that scripts of other origins may read.
extern const char kExposedHeaders[];

}  // namespace liquidblend::http
