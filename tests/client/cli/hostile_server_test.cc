// The command against a server that answers what no honest one does. What it sends to players and
// exports is tested with the rooms that read it.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <sys/wait.h>

#include <cstdlib>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "absl/strings/str_cat.h"
#include "tests/allocation_testing.h"
#include "tests/client/cli/served_command.h"
#include "tests/paths.h"

namespace liquidblend::cli {
namespace {

using nlohmann::json;
using ::testing::AllOf;
using testing::CommandResult;
using ::testing::HasSubstr;
using ::testing::Not;

// A title, the clipboard, an erased line, DEL, C1 as UTF-8 and a false line.
constexpr char kHostile[] =
    "\x1B]2;t\x07\x1B]52;c;aGk=\x07\x1B[2K\x7F\xC2\x9B"
    "A\nfalse: version 9";
constexpr char kShown[] = "?]2;t??]52;c;aGk=?\?[2K??A?false: version 9";

class HostileServer : public ServedCommand {
 protected:
  // Nothing that a terminal obeys but newlines.
  static void ExpectClean(const std::string& text) {
    for (const char c : text) {
      const auto byte = static_cast<unsigned char>(c);
      EXPECT_TRUE(byte == '\n' || (byte >= 0x20 && byte < 0x7F)) << int{byte} << " in " << text;
    }
    EXPECT_THAT(text, Not(HasSubstr("\nfalse")));
  }
};

TEST_F(HostileServer, HasNoControlOverTheTerminal) {
  server_.SetWords(kHostile);
  for (const char* name : {"families/drops", "animations/drops-a"}) {
    const CommandResult result = Run({"inspect", name});
    EXPECT_EQ(result.exit_code, 0) << result.err;
    EXPECT_THAT(result.out, HasSubstr(kShown)) << name;
    ExpectClean(result.out + result.err);
  }
  const CommandResult operation = Run({"operations", "register-1"});
  EXPECT_EQ(operation.exit_code, 0) << operation.err;
  EXPECT_THAT(operation.out, HasSubstr(kShown));
  ExpectClean(operation.out + operation.err);
}

TEST_F(HostileServer, ErrorsAreALineWithoutControlCharacters) {
  server_.FailNext("GetFamily", 1, absl::InternalError(kHostile));
  const CommandResult result = Run({"inspect", "families/drops"});
  EXPECT_EQ(result.exit_code, 1);
  EXPECT_THAT(result.err, HasSubstr(kShown));
  ExpectClean(result.err);
}

TEST_F(HostileServer, JsonHoldsTheWordsEscaped) {
  server_.SetWords(kHostile);
  for (const std::vector<std::string>& command :
       {std::vector<std::string>{"inspect", "families/drops"}, {"operations", "register-1"}}) {
    std::vector<std::string> arguments = {"--json"};
    arguments.insert(arguments.end(), command.begin(), command.end());
    const CommandResult result = Run(arguments);
    EXPECT_EQ(result.exit_code, 0) << result.err;
    ExpectClean(result.out);
    const json parsed = json::parse(result.out);
    const std::string word = parsed.contains("targets") ? parsed["targets"][0] : parsed["name"];
    EXPECT_EQ(word.substr(word.find('/') + 1), kHostile);
  }
}

TEST_F(HostileServer, NoCommandToCopyHoldsANameThatAShellRuns) {
  const std::vector<std::string> arguments = {"register", "drops",    "--source",
                                              "drops-a",  "--target", "drops-b"};
  for (const char* name : {"a; rm b", "`rm b`", "$(rm b)", "--wait\nb"}) {
    server_.SetWords(name);
    const CommandResult result = Run(arguments);
    EXPECT_EQ(result.exit_code, 0) << result.err;
    EXPECT_EQ(result.err, "Its name is not one to copy; `liquidblend operations` lists all.\n");
  }
  server_.SetWords("a; rm b");
  std::vector<std::string> waiting = {"--patience", "0"};
  waiting.insert(waiting.end(), arguments.begin(), arguments.end());
  waiting.push_back("--wait");
  server_.FailNext("WatchOperation", 100, absl::UnavailableError("gone"));
  EXPECT_THAT(Run(waiting).err, AllOf(HasSubstr("may go on nevertheless: `liquidblend operations` "
                                                "lists it"),
                                      Not(HasSubstr("operations operations/"))));
  server_.SetWords("register-2");
  EXPECT_THAT(Run(arguments).err,
              HasSubstr("`liquidblend operations operations/register-2 --wait`"));
}

// A server may be silent, with a stream that stands still too.
TEST_F(HostileServer, AStreamEndsWhenItsTimeIsOver) {
  server_.HoldNextStream(1);
  const CommandResult result = Run({"stream", "drops", "--seconds", "0.5", "--json"});
  EXPECT_EQ(result.exit_code, 0) << result.err;
  EXPECT_EQ(json::parse(result.out)["num_frames"], 1);
}

// The mesh is one of this machine: what a server sends is bounded elsewhere.
TEST_F(HostileServer, ShortageOfMemoryIsAnErrorOfOneLine) {
  if (LIQUIDBLEND_SANITIZED_HEAP != 0) GTEST_SKIP() << "sanitizers take the address space";
  const std::string mesh = dir_.Write("m.ply", "ply\n");
  std::filesystem::resize_file(mesh, 1'500'000'000);  // of no blocks
  const std::string command =
      absl::StrCat("ulimit -v 1000000; exec ", paths::Program("liquidblend"), " inspect ", mesh,
                   " 2> ", dir_.File("err"));
  const int status = std::system(command.c_str());
  EXPECT_TRUE(WIFEXITED(status));
  EXPECT_EQ(WEXITSTATUS(status), 1);
  EXPECT_EQ(testing::ReadBytes(dir_.File("err")),
            "liquidblend: this machine has not enough memory for that\n");
}

TEST_F(HostileServer, ANameIsCutWhereItIsDrawn) {
  server_.SetWords(std::string(80'000, 'x'));
  const CommandResult result =
      Run({"render", "drops", "-w", "1", "--times", "0", "--size", "240x180", "--samples", "1",
           "--json", "-o", dir_.File("sheet.png")});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  EXPECT_LT(json::parse(result.out)["width"], 2000);
}

}  // namespace
}  // namespace liquidblend::cli
