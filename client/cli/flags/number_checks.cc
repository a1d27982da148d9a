#include "client/cli/flags/number_checks.h"

#include <cmath>
#include <string>

#include "absl/strings/ascii.h"
#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"

namespace liquidblend::cli {
namespace {

//   holds  whether a finite number is right
template <typename Holds>
CLI::Validator Check(const Holds& holds, const std::string& rule, const char* name) {
  const auto check = [=](const std::string& text) {
    double value = 0.0;
    const bool is_number = absl::SimpleAtod(text, &value) && std::isfinite(value);
    if (is_number && holds(value)) return std::string();
    const bool has_unit = !is_number && !text.empty() && absl::ascii_isdigit(text[0]);
    return absl::StrCat("must be ", rule, has_unit ? ", without a unit" : "", ", got ", text);
  };
  return CLI::Validator(check, name);
}

}  // namespace

CLI::Validator Positive() {
  return Check([](double value) { return value > 0; }, "above 0", "POSITIVE");
}

CLI::Validator NonNegative() {
  return Check([](double value) { return value >= 0; }, "0 or more", "NONNEGATIVE");
}

CLI::Validator Within(double min, double max) {
  return Check([=](double value) { return value >= min && value <= max; },
               absl::StrCat("in [", min, ", ", max, "]"), "");
}

}  // namespace liquidblend::cli
