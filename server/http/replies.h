// What methods return -> answers of HTTP.
#pragma once

#include <string>

#include "absl/status/status.h"
#include "core/base/version.h"
#include "google/protobuf/message.h"
#include "liquidblend/v1/liquidblend.pb.h"
#include "server/http/messages.h"

namespace liquidblend::http {

// The code of HTTP that says the same, as Google's APIs map them.
int HttpCode(absl::StatusCode code);

// google.rpc.Status as JSON, with the code's own headers (Retry-After, WWW-Authenticate).
// http_code 0: HttpCode(). Requires: !error.ok().
Response ErrorReply(const absl::Status& error, int http_code = 0);

Response TextReply(std::string text);

// protobuf's JSON of the message.
Response JsonReply(const google::protobuf::Message& message);

// A strong entity tag, quotes included: the same for all requests that this program answers with
// the same bytes for the same reason, and another one for another version of family or program, or
// for other content: after a backup was restored, a version may come again with other content.
//   generation  of the family that frames are made from
//   program     the build that makes them
std::string FrameTag(v1::GetFrameRequest request, int64_t version, const std::string& generation,
                     const std::string& program = base::Version());

// Whether the value of If-None-Match has the tag, or is "*".
bool HasTag(const std::string& if_none_match, const std::string& tag);

// The newest version that its tags name; 0 if none does.
int64_t NewestTagged(const std::string& if_none_match);

// The frame's bytes, in the format that was asked for, with what else it says in headers.
Response FrameReply(v1::Frame frame, v1::Encoding::Format format);

// Codes 200 and 304 of a frame: tag, and for how long it may be kept. A version that was asked for
// never changes; without one it has to be asked for again.
//   is_private  the answer depended on who asks
void AddCaching(const v1::GetFrameRequest& request, const std::string& tag, bool is_private,
                Response& response);

// How a WebSocket ends that carried a stream which ended so: 1000, or 4000 and the code of HTTP;
// and its reason, cut to the 123 bytes that fit.
int CloseCode(const absl::Status& end);
std::string CloseReason(const absl::Status& end);

// Of FrameReply() and AddCaching(), for scripts of other origins.
extern const char kExposedHeaders[];

}  // namespace liquidblend::http
