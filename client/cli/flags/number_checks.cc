#include "client/cli/flags/number_checks.h"

#include <cmath>
#include <string>

#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"

namespace liquidblend::cli {
namespace {

CLI::Validator Bound(bool may_be_zero, const char* rule, const char* name) {
  const auto check = [=](const std::string& text) {
    double value = 0.0;
    const bool is_number = absl::SimpleAtod(text, &value) && std::isfinite(value);
    const bool is_good = is_number && (value > 0.0 || (may_be_zero && value == 0.0));
    return is_good ? std::string() : absl::StrCat("must be ", rule, ", got ", text);
  };
  return CLI::Validator(check, name);
}

}  // namespace

CLI::Validator Positive() { return Bound(false, "above 0", "POSITIVE"); }
CLI::Validator NonNegative() { return Bound(true, "0 or more", "NONNEGATIVE"); }

}  // namespace liquidblend::cli
