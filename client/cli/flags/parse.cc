#include "client/cli/flags/parse.h"

#include <cmath>
#include <set>

#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "absl/strings/str_split.h"

namespace liquidblend::cli {

absl::StatusOr<std::vector<double>> ParseNumbers(const std::string& flag, const std::string& text) {
  std::vector<double> numbers;
  for (const absl::string_view part : absl::StrSplit(text, ',')) {
    double number = 0.0;
    if (!absl::SimpleAtod(part, &number) || !std::isfinite(number)) {
      return absl::InvalidArgumentError(absl::StrCat(flag, " ", text, ": \"", part,
                                                     "\" is not a number; write for example ", flag,
                                                     " 0.25,0.5"));
    }
    numbers.push_back(number);
  }
  return numbers;
}

absl::StatusOr<std::vector<std::pair<std::string, double>>> ParseAssignments(
    const std::string& flag, const std::string& text) {
  std::vector<std::pair<std::string, double>> assignments;
  std::set<std::string> names;
  for (const absl::string_view part : absl::StrSplit(text, ',')) {
    const std::vector<std::string> sides = absl::StrSplit(part, '=');
    double value = 0.0;
    if (sides.size() != 2 || sides[0].empty() || !absl::SimpleAtod(sides[1], &value) ||
        !std::isfinite(value)) {
      return absl::InvalidArgumentError(absl::StrCat(flag, " ", text, ": \"", part,
                                                     "\" is not NAME=NUMBER; write for example ",
                                                     "wall_width=0.5,drop_height=1.2"));
    }
    if (!names.insert(sides[0]).second) {
      return absl::InvalidArgumentError(absl::StrCat(flag, " ", text, ": ", sides[0], " is twice"));
    }
    assignments.emplace_back(sides[0], value);
  }
  return assignments;
}

std::string FormatNumbers(const std::vector<double>& numbers) {
  return absl::StrJoin(numbers, ", ");
}

}  // namespace liquidblend::cli
