// What all programs have in common: --version, exit statuses, defaults in --help.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cstdio>
#include <fstream>
#include <iterator>
#include <regex>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/ascii.h"
#include "absl/strings/match.h"
#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_split.h"
#include "client/cli/print/exit_code.h"
#include "core/base/exit_status.h"
#include "tests/core/store/store_testing.h"
#include "tests/e2e/process.h"
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
  const std::string tables = GetParam() == std::string("liquidblend")
                                 ? ""
                                 : ", tables [0-9]+ of SQLite, [0-9]+ of PostgreSQL";
  EXPECT_THAT(result.output,
              MatchesRegex(absl::StrCat(GetParam(), " [0-9]+\\.[0-9]+\\.[0-9]+ \\(commit ",
                                        "([0-9a-f]{7,40}(-dirty)?|unknown)\\)", tables, "\n")));
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

// The programs' help, and that of each of their subcommands.
std::vector<std::string> AllHelps(const std::string& program) {
  std::vector<std::string> helps = {RunProgram(program, "--help").output};
  const std::string top = helps[0];
  const size_t begin = top.find("Subcommands:");
  if (begin == std::string::npos) return helps;
  const std::regex name("\n  ([a-z]+) ");
  const std::string names = top.substr(begin, top.find("\n\n", begin) - begin);
  for (std::sregex_iterator found(names.begin(), names.end(), name), end; found != end; ++found) {
    helps.push_back(RunProgram(program, absl::StrCat((*found)[1].str(), " --help")).output);
  }
  return helps;
}

struct Option {
  std::string head;  // "--max-upload INT:SIZE=64GiB"
  std::string text;
};

// Of a help text: lines that begin with "-", and what is indented below them.
std::vector<Option> OptionsIn(const std::string& help) {
  std::vector<Option> options;
  bool goes_on = false;
  for (const std::string& line : std::vector<std::string>(absl::StrSplit(help, '\n'))) {
    const bool begins = absl::StartsWith(line, "  -");
    goes_on = begins || (goes_on && absl::StartsWith(line, "     "));
    if (!goes_on) continue;
    const size_t end_of_head = begins ? std::min(line.find("  ", 2), line.size()) : 0;
    if (begins) options.push_back({line.substr(2, end_of_head - 2), ""});
    absl::StrAppend(&options.back().text, " ",
                    std::string(absl::StripAsciiWhitespace(line.substr(end_of_head))));
  }
  return options;
}

// In its head, or by a phrase that has the value, or in brackets: "Iterations (16; with --refine
// 6)".
bool TellsItsDefault(const Option& option) {
  static const std::regex takes_a_value("(-[a-z],)?--[a-z0-9-]+ (?!\\(Env|Needs|Excludes).*");
  static const std::regex head("=[^ ]|REQUIRED");
  static const std::regex text(
      "[A-Za-z],? unless given|otherwise [-A-Za-z]|[Dd]efault ([0-9]|the family's)|"
      "\\((on|fastest|[0-9.]+|the family's)[;,)]");
  return !std::regex_match(option.head, takes_a_value) || std::regex_search(option.head, head) ||
         std::regex_search(option.head + option.text, text);
}

TEST(DefaultsInHelps, AreValuesInsteadOfTheWord) {
  for (const char* const text :
       {"Frames per second; default 24", "Frames per second; default the family's",
        "PEM file; none unless given", "The mode (linear, unless given)",
        "Its name; otherwise the host's", "Iterations (16; with --refine 6)"}) {
    EXPECT_TRUE(TellsItsDefault({"--option TEXT", text})) << text;
  }
  for (const char* const text :
       {"Frames per second", "Frames per second; has a default", "The server's default is taken",
        "By default it is chosen", "Unless given, it is chosen", "What to do otherwise",
        "Frames per second; default", "A share (of all)"}) {
    EXPECT_FALSE(TellsItsDefault({"--option TEXT", text})) << text;
  }
  EXPECT_TRUE(TellsItsDefault({"--option INT=3", "A number"}));
  EXPECT_TRUE(TellsItsDefault({"--flag", "Takes no value"}));
}

TEST_P(ProgramsTest, TellTheDefaultOfEachOptionInEachHelp) {
  int num_options = 0;
  for (const std::string& help : AllHelps(GetParam())) {
    for (const Option& option : OptionsIn(help)) {
      ++num_options;
      EXPECT_TRUE(TellsItsDefault(option)) << option.head << option.text;
    }
  }
  EXPECT_GT(num_options, 10);
}

// Numbers of "Exit status: 0 done; 1 failed; ..." and of the table in docs/operations/running.md.
std::set<int> StatusesIn(const std::string& help) {
  std::set<int> statuses;
  const size_t begin = help.find("Exit status: ");
  if (begin == std::string::npos) return statuses;
  const std::string text = help.substr(begin);
  const std::regex number("[:;]\\s+([0-9]+) ");
  for (std::sregex_iterator found(text.begin(), text.end(), number), end; found != end; ++found) {
    statuses.insert(std::stoi((*found)[1].str()));
  }
  return statuses;
}

std::set<int> StatusesInTheTable(const std::string& program) {
  std::set<int> statuses;
  bool is_there = false;
  std::ifstream page(paths::Source("docs/operations/running.md"));
  for (std::string line; std::getline(page, line);) {
    if (absl::StartsWith(line, "## ")) is_there = line == "## Exit statuses";
    const std::vector<std::string> cells = absl::StrSplit(line, " | ");
    int status = -1;
    if (!is_there || cells.size() != 3 || !absl::SimpleAtoi(cells[0].substr(2), &status)) continue;
    const std::string quoted = absl::StrCat("`", program, "`");
    const bool is_its = absl::StartsWith(cells[2], "all") || absl::StrContains(cells[2], quoted);
    if (is_its) statuses.insert(status);
  }
  return statuses;
}

// By the enumerators that a header lists: "kExitUsage = 2".
std::set<int> StatusesInTheEnum(const std::string& header) {
  std::ifstream file(paths::Source(header));
  const std::string text((std::istreambuf_iterator<char>(file)), {});
  const std::regex enumerator("kExit\\w+ = ([0-9]+)");
  std::set<int> statuses;
  for (std::sregex_iterator found(text.begin(), text.end(), enumerator), end; found != end;
       ++found) {
    statuses.insert(std::stoi((*found)[1].str()));
  }
  return statuses;
}

TEST_P(ProgramsTest, HaveTheExitStatusesOfTheTableInTheCode) {
  const bool is_client = std::string(GetParam()) == "liquidblend";
  EXPECT_EQ(
      StatusesInTheEnum(is_client ? "client/cli/print/exit_code.h" : "core/base/exit_status.h"),
      StatusesInTheTable(GetParam()));
}

TEST(ExitStatuses, HaveOneMeaningInAllPrograms) {
  EXPECT_EQ(int{base::kExitDone}, int{cli::kExitOk});
  EXPECT_EQ(int{base::kExitFailed}, int{cli::kExitFailed});
  EXPECT_EQ(int{base::kExitUsage}, int{cli::kExitUsage});
  EXPECT_EQ(int{base::kExitUnreachable}, int{cli::kExitUnreachable});
  EXPECT_EQ(int{base::kExitDamaged}, int{cli::kExitDamaged});
}

TEST_P(ProgramsTest, HaveTheExitStatusesOfTheTableInEachHelp) {
  const std::set<int> expected = StatusesInTheTable(GetParam());
  EXPECT_GE(expected.size(), 5u);
  for (const std::string& help : AllHelps(GetParam())) {
    EXPECT_EQ(StatusesIn(help), expected) << help.substr(0, help.find('\n'));
  }
}

INSTANTIATE_TEST_SUITE_P(All, ProgramsTest,
                         ::testing::Values("liquidblend", "liquidblend-admin", "liquidblend-server",
                                           "liquidblend-worker"));

TEST(AdminProgramTest, AMistypedCommandIsNamedWithTheNearestOne) {
  const Result result = RunProgram("liquidblend-admin", "chek --data /nowhere");
  EXPECT_EQ(result.exit_status, 2);
  EXPECT_EQ(result.output,
            "liquidblend-admin: there is no command 'chek'; did you mean 'check'?\n"
            "`liquidblend-admin --help` lists all commands.\n");
}

TEST(ServerProgramTest, ARefusedValueIsUsage) {
  const Result result = RunProgram("liquidblend-server", "--data /nowhere --http 0.0.0.0:1");
  EXPECT_EQ(result.exit_status, 2) << result.output;
}

TEST(CheckOfPrograms, TellsARefusedFlagFromAServiceThatIsAway) {
  EXPECT_EQ(RunProgram("liquidblend-server", "--check --listen 127.0.0.1:1").exit_status, 1);
  EXPECT_EQ(RunProgram("liquidblend-server", "--check --threads many").exit_status, 2);
  EXPECT_EQ(RunProgram("liquidblend-worker", "--check --data /nowhere --poll often").exit_status,
            2);
}

// Nothing listens on port 1.
class UnreachableStore : public ::testing::TestWithParam<const char*> {};

TEST_P(UnreachableStore, HasItsOwnExitStatus) {
  const std::vector<std::string> words = absl::StrSplit(GetParam(), absl::MaxSplits(' ', 1));
  const store::TemporaryFolder cache;
  const Result result = RunProgram(
      words[0], absl::StrCat(words.size() > 1 ? words[1] : "",
                             " --store postgresql://nobody@127.0.0.1:1/none --blobs s3://b/p",
                             " --cache '", cache.path(), "'"));
  EXPECT_EQ(result.exit_status, 3) << result.output;
  EXPECT_THAT(result.output, HasSubstr("127.0.0.1"));
}

// A worker that is to drain waits for its store as long as it has time, other than with --once.
TEST(WorkerProgramTest, IsStoppedByTheEndOfItsTimeWhileItsStoreIsAway) {
  const store::TemporaryFolder cache;
  const Result result =
      RunProgram("liquidblend-worker",
                 absl::StrCat("--drain --max-time 5100ms --stopped-status 75 --store "
                              "postgresql://nobody@127.0.0.1:1/none --blobs s3://b/p --cache '",
                              cache.path(), "'"));
  EXPECT_EQ(result.exit_status, 75) << result.output;
  EXPECT_THAT(result.output, HasSubstr("waits for its store"));
  EXPECT_THAT(result.output, HasSubstr("stopping: --max-time is nearly over"));
}

TEST(WorkerProgramTest, RefusesTimesAndFlagsThatContradictEachOther) {
  for (const auto& [flags, message] :
       {std::pair("--max-time 5s", "--max-time must be longer than the 5s"),
        std::pair("--max-time soon", "--max-time must be a duration"),
        std::pair("--max-time 1h --idle-time 1s", "--idle-time requires --drain"),
        std::pair("--drain --idle-time -1s", "idle_time is out of range"),
        std::pair("--drain --once", "excludes"), std::pair("--max-jobs -1", "--max-jobs")}) {
    const Result result = RunProgram("liquidblend-worker", absl::StrCat("--data /nowhere ", flags));
    EXPECT_EQ(result.exit_status, 2) << flags << ": " << result.output;
    EXPECT_THAT(result.output, HasSubstr(message));
  }
}

// What cannot start tells which build it is, too.
TEST(LogOfPrograms, BeginsWithTheirVersion) {
  const std::string store =
      " --store postgresql://nobody@127.0.0.1:1/none --blobs s3://b/p --cache /nowhere";
  for (const char* const program :
       {"liquidblend-server --workers 0", "liquidblend-worker --once"}) {
    const std::vector<std::string> words = absl::StrSplit(program, ' ');
    const std::string version(
        absl::StripTrailingAsciiWhitespace(RunProgram(words[0], "--version").output));
    const std::string log =
        RunProgram(words[0], absl::StrCat(program + words[0].size(), store)).output;
    EXPECT_THAT(log.substr(0, log.find('\n')), ::testing::EndsWith(version)) << log;
  }
}

INSTANTIATE_TEST_SUITE_P(All, UnreachableStore,
                         ::testing::Values("liquidblend-server --listen 127.0.0.1:0 --workers 0",
                                           "liquidblend-worker --once", "liquidblend-admin check",
                                           "liquidblend-admin queue"));

TEST(ServerProgramTest, APortInUseIsAFailureThatNamesTheAddress) {
  const store::TemporaryFolder folder;
  Process first("liquidblend-server", {"--data", folder.path() + "/first", "--workers", "0",
                                       "--listen", "127.0.0.1:0", "--http", "127.0.0.1:0"});
  const std::string address = first.ReadLine().substr(std::string("listening on ").size());
  const std::string http_address = first.ReadLine().substr(std::string("http on ").size());
  const auto second = [&](const std::string& listen, const std::string& http) {
    return RunProgram("liquidblend-server",
                      absl::StrCat("--data '", folder.path(), "/second' --workers 0 --listen ",
                                   listen, " --http ", http));
  };
  const Result on_port = second(address, "127.0.0.1:0");
  EXPECT_EQ(on_port.exit_status, 1) << on_port.output;
  EXPECT_THAT(on_port.output, HasSubstr(absl::StrCat("cannot listen on ", address)));
  const Result on_http_port = second("127.0.0.1:0", http_address);
  EXPECT_EQ(on_http_port.exit_status, 1) << on_http_port.output;
  EXPECT_THAT(on_http_port.output, HasSubstr(absl::StrCat("cannot serve HTTP on ", http_address)));
}

}  // namespace
}  // namespace liquidblend::e2e
