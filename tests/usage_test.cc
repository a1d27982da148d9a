// Every script of deploy/ and tests/ tells how it is used, and refuses what it does not know before
// it does anything.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <set>
#include <string>
#include <vector>

#include "absl/strings/str_cat.h"

namespace liquidblend {
namespace {

namespace fs = std::filesystem;
using testing::AllOf;
using testing::HasSubstr;
using testing::StartsWith;

// PostgreSQL's arguments, and those of lb_accuracy.
const std::set<std::string> kPassArgumentsOn = {"deploy/images/postgres.sh",
                                                "tests/accuracy/run.sh"};

// From the repository's root. Without those that are only read by others.
std::vector<std::string> Scripts() {
  const fs::path root = LIQUIDBLEND_SOURCE_DIR;
  std::vector<std::string> scripts;
  for (const char* folder : {"deploy", "tests"}) {
    for (fs::recursive_directory_iterator at(root / folder), end; at != end; ++at) {
      if (at->path().filename() == "node_modules") at.disable_recursion_pending();
      const bool is_executable =
          (at->status().permissions() & fs::perms::owner_exec) != fs::perms::none;
      if (at->path().extension() == ".sh" && is_executable) {
        scripts.push_back(fs::relative(at->path(), root).string());
      }
    }
  }
  std::sort(scripts.begin(), scripts.end());
  return scripts;
}

struct Said {
  int exit_code = -1;
  std::string text;
};

class UsageTest : public testing::Test {
 protected:
  UsageTest() : folder_(MakeFolder()) {
    for (const char* tool : {"bash", "dirname", "env", "sed"}) {
      fs::create_symlink(absl::StrCat("/usr/bin/", tool), fs::path(folder_) / tool);
    }
  }
  ~UsageTest() override { fs::remove_all(folder_); }

  // In another directory, and with hardly a program to be found: a script that goes on does no
  // harm.
  Said Run(const std::string& script, const std::string& argument, const std::string& redirection) {
    const std::string command =
        absl::StrCat("cd '", folder_, "' && PATH='", folder_, "' '", LIQUIDBLEND_SOURCE_DIR, "/",
                     script, "' ", argument, " ", redirection);
    Said said;
    FILE* const pipe = popen(command.c_str(), "r");
    std::array<char, 4096> buffer;
    for (size_t size = 0; (size = fread(buffer.data(), 1, buffer.size(), pipe)) > 0;) {
      said.text.append(buffer.data(), size);
    }
    const int status = pclose(pipe);
    if (WIFEXITED(status)) said.exit_code = WEXITSTATUS(status);
    return said;
  }

 private:
  static std::string MakeFolder() {
    std::string folder = (fs::temp_directory_path() / "usage_XXXXXX").string();
    if (mkdtemp(folder.data()) == nullptr) std::abort();
    return folder;
  }

  const std::string folder_;
};

TEST_F(UsageTest, HelpIsTheUsageAndNoMistake) {
  const std::vector<std::string> scripts = Scripts();
  EXPECT_GT(scripts.size(), 15U);
  for (const std::string& script : scripts) {
    if (script == "deploy/images/postgres.sh") continue;
    const Said said = Run(script, "--help", "2>/dev/null");
    EXPECT_EQ(said.exit_code, 0) << script;
    EXPECT_THAT(said.text, HasSubstr(fs::path(script).filename().string())) << script;
  }
}

TEST_F(UsageTest, AnUnknownArgumentIsNamedAndTheUsageToldOnStandardError) {
  for (const std::string& script : Scripts()) {
    if (kPassArgumentsOn.contains(script)) continue;
    const Said said = Run(script, "--no-such-flag", "2>&1 >/dev/null");
    const std::string name = fs::path(script).filename();
    EXPECT_EQ(said.exit_code, 2) << script;
    EXPECT_THAT(said.text,
                AllOf(StartsWith(name + ": "), HasSubstr("--no-such-flag\n"), HasSubstr("\n  ")))
        << script;
  }
}

}  // namespace
}  // namespace liquidblend
