#include "client/cli/flags/named_value.h"

#include <algorithm>

#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"

namespace liquidblend::cli {

CLI::Validator OneOf(const std::vector<std::string>& names) {
  const auto check = [names](const std::string& text) {
    if (IndexOf(names, text) >= 0) return std::string();
    return absl::StrCat("'", text, "' is not one of ", absl::StrJoin(names, ", "));
  };
  return CLI::Validator(check, "");
}

int IndexOf(const std::vector<std::string>& names, const std::string& text) {
  const auto found = std::find_if(names.begin(), names.end(), [&](const std::string& name) {
    return absl::EqualsIgnoreCase(name, text);
  });
  return found == names.end() ? -1 : static_cast<int>(found - names.begin());
}

}  // namespace liquidblend::cli
