// What all programs have in common: --version, exit statuses, defaults in --help.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <cstdio>
#include <regex>
#include <string>

#include "absl/strings/str_cat.h"
#include "tests/paths.h"

namespace liquidblend::e2e {
namespace {

using ::testing::HasSubstr;
using ::testing::MatchesRegex;

struct Result {
  int exit_status = -1;
  std::string output;  // both streams
};

Result RunProgram(const std::string& program, const std::string& arguments) {
  Result result;
  const std::string command = absl::StrCat("'", paths::Program(program), "' ", arguments, " 2>&1");
  std::FILE* const pipe = popen(command.c_str(), "r");
  if (pipe == nullptr) return result;
  std::array<char, 4096> buffer;
  while (const size_t size = std::fread(buffer.data(), 1, buffer.size(), pipe)) {
    result.output.append(buffer.data(), size);
  }
  result.exit_status = WEXITSTATUS(pclose(pipe));
  return result;
}

class ProgramsTest : public ::testing::TestWithParam<const char*> {};

TEST_P(ProgramsTest, TellTheirVersion) {
  const Result result = RunProgram(GetParam(), "--version");
  EXPECT_EQ(result.exit_status, 0);
  EXPECT_THAT(result.output, MatchesRegex(absl::StrCat(GetParam(), " [0-9]+\\.[0-9]+\\.[0-9]+\n")));
}

TEST_P(ProgramsTest, RefuseAnUnknownFlagWithTheStatusOfUsage) {
  EXPECT_EQ(RunProgram(GetParam(), "--no-such-flag").exit_status, 2);
}

TEST_P(ProgramsTest, ListExitStatusesInTheirHelp) {
  const Result result = RunProgram(GetParam(), "--help");
  EXPECT_EQ(result.exit_status, 0);
  EXPECT_THAT(result.output, HasSubstr("Exit status: 0 "));
  EXPECT_THAT(result.output, HasSubstr("2 a flag or value that is refused"));
}

// "--max-upload INT:SIZE=64GiB", not "--max-upload INT:SIZE".
TEST_P(ProgramsTest, TellTheDefaultOfEachNumberInTheirHelp) {
  const std::string help = RunProgram(GetParam(), "--help").output;
  const std::regex number("--[a-z-]+ (INT|FLOAT)[^=\n]*\n");
  for (std::sregex_iterator found(help.begin(), help.end(), number), end; found != end; ++found) {
    if (found->str().find("--parent ") == 0) continue;  // none unless given
    ADD_FAILURE() << found->str();
  }
}

INSTANTIATE_TEST_SUITE_P(All, ProgramsTest,
                         ::testing::Values("liquidblend", "liquidblend-admin", "liquidblend-server",
                                           "liquidblend-worker"));

TEST(ServerProgramTest, ARefusedValueIsUsage) {
  const Result result = RunProgram("liquidblend-server", "--data /nowhere --http 0.0.0.0:1");
  EXPECT_EQ(result.exit_status, 2) << result.output;
}

}  // namespace
}  // namespace liquidblend::e2e
