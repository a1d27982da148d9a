#include "client/cli/parse.h"

#include <cmath>

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
      return absl::InvalidArgumentError(absl::StrCat(
          flag, " ", text, ": \"", part, "\" is no number; write for example ", flag, " 0.25,0.5"));
    }
    numbers.push_back(number);
  }
  return numbers;
}

std::string FormatNumbers(const std::vector<double>& numbers) {
  return absl::StrJoin(numbers, ", ");
}

}  // namespace liquidblend::cli
