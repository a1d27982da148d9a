// The flag --up.
#pragma once

#include <CLI/CLI.hpp>
#include <map>
#include <string>

#include "liquidblend/up.h"

namespace liquidblend::cli {

// Values as in NameOf(), "-y" too.
inline CLI::Option* AddUp(Up& up, const std::string& help, CLI::App& command) {
  std::map<std::string, Up> names;
  for (const Up value : {Up::kX, Up::kY, Up::kZ, Up::kMinusX, Up::kMinusY, Up::kMinusZ}) {
    names[NameOf(value)] = value;
  }
  return command.add_option("--up", up, help)
      ->transform(CLI::CheckedTransformer(names))
      ->type_name("x|y|z|-x|-y|-z");
}

}  // namespace liquidblend::cli
