// A figure of a verdict and an option of a registration are defined once: counts the product files
// that name each field of these messages.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cctype>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <map>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "absl/strings/str_split.h"
#include "absl/strings/string_view.h"

namespace liquidblend {
namespace {

namespace fs = std::filesystem;
using testing::ElementsAre;
using testing::IsEmpty;
using testing::IsSupersetOf;
using testing::UnorderedElementsAre;

const fs::path kRoot = LIQUIDBLEND_SOURCE_DIR;
constexpr char kApi[] = "proto/liquidblend/v1/liquidblend.proto";

std::string Read(const fs::path& path) {
  std::ifstream stream(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(stream), {}};
}

// Fields of a message of the API, in their order.
std::vector<std::string> FieldsOf(const std::string& message, const std::string& proto) {
  const size_t begin = proto.find(absl::StrCat("\nmessage ", message, " {\n"));
  if (begin == std::string::npos) return {};
  const std::string body = proto.substr(begin, proto.find("\n}\n", begin) - begin);
  std::vector<std::string> names;
  for (const absl::string_view line : absl::StrSplit(body, '\n')) {
    // "  repeated double volume_errors = 11;" of the message itself, not of one within it
    const bool is_outer = absl::StartsWith(line, "  ") && !absl::StartsWith(line, "   ");
    std::vector<absl::string_view> words = absl::StrSplit(line, ' ', absl::SkipEmpty());
    if (!words.empty() && (words[0] == "repeated" || words[0] == "optional")) {
      words.erase(words.begin());
    }
    if (is_outer && words.size() > 3 && words[2] == "=") names.emplace_back(words[1]);
  }
  return names;
}

// Comments are left out: some fields have names that are ordinary words.
std::set<std::string> WordsOf(const std::string& text) {
  std::set<std::string> words;
  const auto is_letter = [](char c) {
    return std::isalnum(static_cast<unsigned char>(c)) || c == '_';
  };
  for (size_t begin = 0; begin < text.size();) {
    if (text.compare(begin, 2, "//") == 0) begin = std::min(text.find('\n', begin), text.size());
    size_t end = begin;
    while (end < text.size() && is_letter(text[end])) ++end;
    if (end > begin) words.insert(text.substr(begin, end - begin));
    begin = end + 1;
  }
  return words;
}

// A generated setter or getter names its field, too.
bool Names(const std::set<std::string>& words, const std::string& field) {
  for (const char* prefix : {"", "set_", "has_", "add_", "mutable_", "clear_"}) {
    if (words.contains(prefix + field)) return true;
  }
  return words.contains(field + "_size");
}

// The words of each product file, by its path.
std::map<std::string, std::set<std::string>> LoadProduct() {
  std::map<std::string, std::set<std::string>> files;
  for (const char* top : {"client", "core", "proto", "server", "worker"}) {
    for (fs::recursive_directory_iterator at(kRoot / top), end; at != end; ++at) {
      if (at->path().filename() == "node_modules") at.disable_recursion_pending();
      const std::string extension = at->path().extension();
      if (extension != ".cc" && extension != ".h" && extension != ".proto") continue;
      files[fs::relative(at->path(), kRoot).generic_string()] = WordsOf(Read(at->path()));
    }
  }
  return files;
}

// A line for each field that more files name than may.
std::vector<std::string> TooOften(const std::string& message, size_t most,
                                  const std::set<std::string>& left_out) {
  static const auto* const files = new std::map(LoadProduct());
  std::vector<std::string> faults;
  for (const std::string& field : FieldsOf(message, Read(kRoot / kApi))) {
    if (left_out.contains(field)) continue;
    std::vector<std::string> found;
    for (const auto& [path, words] : *files) {
      if (Names(words, field)) found.push_back(path);
    }
    if (found.size() <= most) continue;
    faults.push_back(absl::StrCat(field, ": ", absl::StrJoin(found, " ")));
  }
  return faults;
}

// The messages of API and store, the struct of core, and the worker that computes it.
TEST(Definitions, AFigureOfAVerdictIsNamedInFourFiles) {
  const std::set<std::string> left_out = {
      "grade", "reason", "worst",          // clients show them, each in its own way
      "fit_energy", "smoothness_energy"};  // also of each iteration, and of the progress
  EXPECT_THAT(TooOften("Verdict", 4, left_out), IsEmpty());
}

// The messages of API and store, the table of core, the public header of the client library, and
// the step of the registration that uses it.
TEST(Definitions, AnOptionOfARegistrationIsNamedInFiveFiles) {
  const std::set<std::string> left_out = {"seed"};  // of any random numbers
  EXPECT_THAT(TooOften("RegistrationOptions", 5, left_out), IsEmpty());
}

TEST(Definitions, FieldsAreFoundAndCounted) {
  EXPECT_THAT(FieldsOf("Verdict", Read(kRoot / kApi)),
              IsSupersetOf({"grade", "stretch", "residual_histogram"}));
  EXPECT_THAT(FieldsOf("RegistrationOptions", Read(kRoot / kApi)),
              IsSupersetOf({"seed", "automatic_correspondences"}));
  EXPECT_THAT(FieldsOf("A", "\nmessage A {\n  int32 b = 1;\n  repeated x.Y c_d = 2;\n}\n"),
              ElementsAre("b", "c_d"));
  EXPECT_TRUE(Names(WordsOf("message.set_stretch(1);"), "stretch"));
  EXPECT_FALSE(Names(WordsOf("stretched, mean_stretch"), "stretch"));
  EXPECT_THAT(WordsOf("a = 1;  // can stretch\n  // stretch\nb"),
              UnorderedElementsAre("a", "1", "b"));
  EXPECT_THAT(TooOften("Verdict", 1, {}),
              testing::SizeIs(FieldsOf("Verdict", Read(kRoot / kApi)).size()));
}

}  // namespace
}  // namespace liquidblend
