// The flag --priority of jobs.
#pragma once

#include <CLI/App.hpp>

namespace liquidblend::cli {

inline void AddPriority(int& priority, CLI::App& command) {
  command.add_option("--priority", priority, "-100 to 100 (0); larger ones are worked on first")
      ->check(CLI::Range(-100, 100));
}

}  // namespace liquidblend::cli
