#include "server/base/names.h"

#include <algorithm>

#include "absl/strings/ascii.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/strip.h"
#include "server/base/errors.h"

namespace liquidblend::server {
namespace {

constexpr size_t kMaxIdLength = 63;
constexpr size_t kMaxShown = 80;  // of a wrong name, in a message

bool IsLowerOrDigit(char c) { return absl::ascii_islower(c) || absl::ascii_isdigit(c); }

absl::StatusOr<std::string> IdIn(absl::string_view collection, absl::string_view field,
                                 absl::string_view name) {
  const absl::string_view id = absl::StripPrefix(name, absl::StrCat(collection, "/"));
  if (IsResourceId(id)) return std::string(id);
  return InvalidField(
      field, absl::StrCat("must be ", collection, "/NAME or NAME, of at most ", kMaxIdLength,
                          " small letters, digits, '_', '.' and '-', with a letter or digit first; "
                          "got '",
                          name.substr(0, kMaxShown), "'"));
}

std::string NameIn(absl::string_view collection, absl::string_view id) {
  const std::string prefix = absl::StrCat(collection, "/");
  return absl::StrCat(prefix, absl::StripPrefix(id, prefix));
}

}  // namespace

bool IsResourceId(absl::string_view id) {
  return !id.empty() && id.size() <= kMaxIdLength && IsLowerOrDigit(id[0]) &&
         std::all_of(id.begin(), id.end(),
                     [](char c) { return IsLowerOrDigit(c) || c == '_' || c == '.' || c == '-'; });
}

absl::StatusOr<std::string> AnimationId(absl::string_view field, absl::string_view name) {
  return IdIn("animations", field, name);
}

absl::StatusOr<std::string> FamilyId(absl::string_view field, absl::string_view name) {
  return IdIn("families", field, name);
}

absl::StatusOr<std::string> OperationId(absl::string_view field, absl::string_view name) {
  return IdIn("operations", field, name);
}

std::string AnimationName(absl::string_view id) { return NameIn("animations", id); }
std::string FamilyName(absl::string_view id) { return NameIn("families", id); }
std::string OperationName(absl::string_view id) { return NameIn("operations", id); }

}  // namespace liquidblend::server
