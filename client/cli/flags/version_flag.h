// The flag --version, of a family.
#pragma once

#include <CLI/CLI.hpp>
#include <cstdint>

#include "client/cli/flags/number_checks.h"

namespace liquidblend::cli {

// Defines it on `command`.
inline void AddVersionFlag(int64_t& version, CLI::App& command) {
  command
      .add_option("--version", version,
                  "Version of the family, which is published or kept; 0: the published one")
      ->check(NonNegative())
      ->capture_default_str();
}

}  // namespace liquidblend::cli
