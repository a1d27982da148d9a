// A test of the command against a server with canned answers.
#pragma once

#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "tests/client/fake_server.h"
#include "tests/client/run_command.h"
#include "tests/client/temp_files.h"

namespace liquidblend::cli {

class ServedCommand : public ::testing::Test {
 protected:
  // Runs `liquidblend --server SERVER arguments`.
  testing::CommandResult Run(std::vector<std::string> arguments) {
    arguments.insert(arguments.begin(), {"--server", server_.target()});
    return testing::RunLiquidblend(arguments);
  }

  testing::FakeServer server_;
  testing::TempDir dir_;
};

}  // namespace liquidblend::cli
