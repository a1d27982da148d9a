// Flags of `liquidblend register` for the options of core/mesh/registration_options.h.
#pragma once

#include <CLI/App.hpp>
#include <string>
#include <vector>

#include "liquidblend/family.h"

namespace liquidblend::cli {

void AddRegistrationFlags(RegistrationOptions& options, CLI::App& command);

// How an option reads in --help and in docs/registration-options.md.
struct OptionText {
  std::string flag;           // "--smoothness"
  std::string field;          // of the API
  std::string range;          // "1 to 200", "on or off", "any"
  std::string default_value;  // "20", "on"
  std::string description;
};
std::vector<OptionText> DescribeRegistrationOptions();

}  // namespace liquidblend::cli
