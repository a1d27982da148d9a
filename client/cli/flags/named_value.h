// Flags whose values have names.
#pragma once

#include <CLI/CLI.hpp>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/str_join.h"

namespace liquidblend::cli {

// Accepts the names alone, in any case. Otherwise: "'w' is not one of x, y, z".
CLI::Validator OneOf(const std::vector<std::string>& names);

// The position of `text` in `names`, in any case; -1 if it is not there.
int IndexOf(const std::vector<std::string>& names, const std::string& text);

// A flag that sets `value`, a V or std::optional<V>, to one of `choices`.
template <typename V, typename Value>
CLI::Option* AddNamedValue(const std::string& flag, Value& value, const std::string& help,
                           const std::vector<std::pair<std::string, V>>& choices,
                           CLI::App& command) {
  std::vector<std::string> names;
  names.reserve(choices.size());
  for (const auto& choice : choices) names.push_back(choice.first);
  const auto set = [&value, choices, names](const std::string& text) {
    value = choices[static_cast<size_t>(IndexOf(names, text))].second;
  };
  return command.add_option_function<std::string>(flag, set, help)
      ->check(OneOf(names))
      ->type_name(absl::StrJoin(names, "|"));
}

// A flag for a bool or std::optional<bool>.
template <typename Value>
CLI::Option* AddOnOff(const std::string& flag, Value& value, const std::string& help,
                      CLI::App& command) {
  return AddNamedValue<bool>(flag, value, help, {{"on", true}, {"off", false}}, command);
}

}  // namespace liquidblend::cli
