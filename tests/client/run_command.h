// Runs the command `liquidblend` as a person would.
#pragma once

#include <functional>
#include <string>
#include <vector>

namespace liquidblend::testing {

struct CommandResult {
  int exit_code = -1;  // 128 + signal if a signal ended it
  std::string out;
  std::string err;
};

// `arguments` without the program's name. The environment has no LIQUIDBLEND_SERVER.
CommandResult RunLiquidblend(const std::vector<std::string>& arguments);

// Likewise, but sends SIGINT (Ctrl-C) as soon as standard error holds `text`. Standard output is
// not kept.
CommandResult InterruptLiquidblend(const std::vector<std::string>& arguments,
                                   const std::string& text);

// Likewise, but calls `action` as soon as standard error holds `text`; the command goes on.
CommandResult RunLiquidblendUntil(const std::vector<std::string>& arguments,
                                  const std::string& text, const std::function<void()>& action);

}  // namespace liquidblend::testing
