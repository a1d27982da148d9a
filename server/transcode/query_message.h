// Fields of a query -> a message, by reflection.
#pragma once

#include <google/protobuf/message.h>

#include <string>

#include "server/base/errors.h"
#include "server/transcode/query.h"

namespace liquidblend::transcode {

// Sets the field that `query.name` names: in the spelling of the proto or of its JSON, fields of
// messages within by dots ("header.options.framesPerSecond"). Values: numbers, true or false, the
// names of an enum in any case, RFC 3339 times and durations ("5s") as in JSON; those of a repeated
// field between commas.
// Adds a violation that names the query's field if there is no such field, if it cannot stand in a
// query (messages, bytes, maps), or if the value cannot be read. Ranges are checked by the method.
void SetField(const QueryField& query, google::protobuf::Message& message,
              server::FieldViolations& violations);

}  // namespace liquidblend::transcode
