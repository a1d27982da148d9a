// The flag --up.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "client/cli/flags/named_value.h"
#include "liquidblend/up.h"

namespace liquidblend::cli {

// Values as in NameOf(), "-y" too.
inline CLI::Option* AddUp(Up& up, const std::string& help, CLI::App& command) {
  std::vector<std::pair<std::string, Up>> choices;
  for (const Up value : {Up::kX, Up::kY, Up::kZ, Up::kMinusX, Up::kMinusY, Up::kMinusZ}) {
    choices.emplace_back(NameOf(value), value);
  }
  return AddNamedValue("--up", up, help, choices, command);
}

}  // namespace liquidblend::cli
