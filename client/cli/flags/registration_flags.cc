#include "client/cli/flags/registration_flags.h"

#include <cstdint>
#include <optional>
#include <string_view>
#include <type_traits>

#include "absl/strings/str_cat.h"
#include "client/cli/flags/named_value.h"
#include "client/cli/flags/number_checks.h"
#include "core/mesh/registration_options.h"

namespace liquidblend::cli {
namespace {

template <typename T>
OptionText TextOf(const mesh::OptionInfo& info, T default_value) {
  OptionText text{absl::StrCat("--", info.flag), info.name, "any", absl::StrCat(default_value),
                  info.description};
  if constexpr (std::is_same_v<T, bool>) {
    text.range = "on or off";
    text.default_value = default_value ? "on" : "off";
  } else if constexpr (!std::is_same_v<T, uint64_t>) {
    text.range = absl::StrCat(info.range.min, " to ", info.range.max);
  }
  return text;
}

template <typename T>
void AddFlag(const OptionText& text, const mesh::Range& range, T& option, CLI::App& command) {
  const std::string help =
      absl::StrCat(text.description, "; ", text.range, " (", text.default_value, ")");
  command.add_option(text.flag, option, help)->check(Within(range.min, range.max));
}

void AddFlag(const OptionText& text, const mesh::Range&, std::optional<bool>& option,
             CLI::App& command) {
  const std::string help = absl::StrCat(text.description, " (", text.default_value, ")");
  AddOnOff(text.flag, option, help, command);
}

}  // namespace

void AddRegistrationFlags(RegistrationOptions& options, CLI::App& command) {
  const mesh::RegistrationOptions defaults;
  const auto add = [&](const mesh::OptionInfo& info, const auto& value, const auto&...) {
    RegistrationOptions::ForEach(options, [&](std::string_view name, auto& option) {
      if (name == info.name) AddFlag(TextOf(info, value), info.range, option, command);
    });
  };
  mesh::RegistrationOptions::ForEach(defaults, add);
}

std::vector<OptionText> DescribeRegistrationOptions() {
  std::vector<OptionText> texts;
  const mesh::RegistrationOptions defaults;
  const auto add = [&](const mesh::OptionInfo& info, const auto& value, const auto&...) {
    texts.push_back(TextOf(info, value));
  };
  mesh::RegistrationOptions::ForEach(defaults, add);
  return texts;
}

}  // namespace liquidblend::cli
