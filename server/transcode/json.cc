#include "server/transcode/json.h"

#include <google/protobuf/util/json_util.h>

#include <algorithm>
#include <optional>
#include <utility>

#include "absl/strings/ascii.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/string_view.h"
#include "absl/strings/strip.h"
#include "server/base/errors.h"

namespace liquidblend::transcode {
namespace {

namespace util = google::protobuf::util;

bool IsName(absl::string_view text) {
  return !text.empty() && std::all_of(text.begin(), text.end(), [](char c) {
    return absl::ascii_isalnum(static_cast<unsigned char>(c)) || c == '_';
  });
}

// The field and what is wrong with it, of protobuf's "(options.seed): text" for a value, and
// "(options) seeds: text" or "seeds: text" for a name.
std::optional<std::pair<std::string, std::string>> FieldAndText(absl::string_view error) {
  absl::string_view path;
  if (absl::ConsumePrefix(&error, "(")) {
    path = error.substr(0, error.find(')'));
    error.remove_prefix(std::min(path.size() + 1, error.size()));
  }
  const size_t colon = error.find(": ");
  if (colon == absl::string_view::npos) return std::nullopt;
  const absl::string_view name = absl::StripAsciiWhitespace(error.substr(0, colon));
  if (path.empty() && !IsName(name)) return std::nullopt;
  const char* dot = path.empty() || name.empty() ? "" : ".";
  return std::pair(server::CleanText(absl::StrCat(path, dot, name)),
                   server::CleanText(error.substr(colon + 2)));
}

// Of what is no JSON, protobuf tells the place in lines of its own.
absl::Status ErrorOf(const std::string& error, const std::string& type) {
  const auto field = FieldAndText(error);
  if (field.has_value()) return server::InvalidField(field->first, field->second);
  std::string place = error;
  std::replace(place.begin(), place.end(), '\n', ' ');
  return server::WithReason(
      absl::InvalidArgumentError(
          absl::StrCat("the body is not the JSON of a ", type, ": ", server::CleanText(place))),
      "REQUEST_MALFORMED");
}

}  // namespace

absl::Status ParseJson(std::string_view text, google::protobuf::Message& message) {
  message.Clear();
  if (text.empty()) return absl::OkStatus();
  const auto status = util::JsonStringToMessage({text.data(), text.size()}, &message);
  if (status.ok()) return absl::OkStatus();
  const std::string error(status.message().data(), status.message().size());
  return ErrorOf(error, message.GetDescriptor()->name());
}

absl::StatusOr<std::string> JsonOf(const google::protobuf::Message& message, JsonLayout layout) {
  util::JsonPrintOptions options;
  options.add_whitespace = layout == JsonLayout::kLines;
  std::string json;
  const auto status = util::MessageToJsonString(message, &json, options);
  if (status.ok()) return json;
  const std::string why(status.message().data(), status.message().size());
  return absl::InternalError(absl::StrCat("the ", message.GetDescriptor()->name(),
                                          " cannot be written as JSON: ", server::CleanText(why)));
}

}  // namespace liquidblend::transcode
