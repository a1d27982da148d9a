// Messages <-> their JSON (protobuf's JSON mapping).
#pragma once

#include <google/protobuf/message.h>

#include <string>
#include <string_view>

#include "absl/status/status.h"
#include "absl/status/statusor.h"

namespace liquidblend::transcode {

// Sets the message to what the text says; empty text is an empty message. Names of fields are those
// of the proto or of its JSON; of a name that comes twice the last value counts.
// Errors: kInvalidArgument, naming the place: a violation of the field, or REQUEST_MALFORMED for
// text that is no JSON object. Safe for any bytes: objects within objects up to a depth of 100.
// Cost: O(text); memory up to 60 times its size.
absl::Status ParseJson(std::string_view text, google::protobuf::Message& message);

// In many lines, for people, or in a single one.
enum class JsonLayout { kLines, kOneLine };
// Errors: kInternal for an Any of a type that this program does not know.
absl::StatusOr<std::string> JsonOf(const google::protobuf::Message& message,
                                   JsonLayout layout = JsonLayout::kLines);

}  // namespace liquidblend::transcode
