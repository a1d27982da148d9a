// docs/registration-options.md is what core/mesh/registration_options.h says. To write it anew:
//   LIQUIDBLEND_WRITE_DOCS=1 build/release/tests/client_cli_test --gtest_filter=RegistrationFlags*
#include "client/cli/flags/registration_flags.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdlib>
#include <fstream>
#include <iterator>
#include <optional>
#include <string>
#include <vector>

#include "absl/strings/str_cat.h"

namespace liquidblend::cli {
namespace {

using ::testing::HasSubstr;

constexpr char kIntroduction[] =
    R"(# Registration options
Flags of `liquidblend register` and fields of the API's `RegistrationOptions`. A field that is not set, or 0, has the default. Written by `tests/client/cli/flags/registration_flags_test.cc` from `core/mesh/registration_options.h`; to write it anew: `LIQUIDBLEND_WRITE_DOCS=1 build/release/tests/client_cli_test --gtest_filter=RegistrationFlags*`.

| flag | field | range | default | what |
| --- | --- | --- | --- | --- |
)";

std::string Table() {
  std::string text = kIntroduction;
  for (const OptionText& option : DescribeRegistrationOptions()) {
    absl::StrAppend(&text, "| `", option.flag, "` | `", option.field, "` | ", option.range, " | ",
                    option.default_value, " | ", option.description, " |\n");
  }
  return text;
}

TEST(RegistrationFlags, AreThoseOfTheDocumentation) {
  const std::string path = LIQUIDBLEND_SOURCE_DIR "/docs/registration-options.md";
  if (getenv("LIQUIDBLEND_WRITE_DOCS") != nullptr) std::ofstream(path) << Table();
  std::ifstream stream(path, std::ios::binary);
  const std::string documented{std::istreambuf_iterator<char>(stream), {}};
  EXPECT_EQ(documented, Table());
}

// Parses one flag; returns CLI11's message, or "".
std::string Parse(const std::string& flag, const std::string& value, RegistrationOptions& options) {
  CLI::App app;
  AddRegistrationFlags(options, app);
  std::vector<std::string> arguments = {value, flag};  // CLI11 takes them from the back
  try {
    app.parse(arguments);
  } catch (const CLI::ParseError& error) {
    return error.what();
  }
  return "";
}

TEST(RegistrationFlags, SetTheOptions) {
  RegistrationOptions options;
  EXPECT_EQ(Parse("--iterations", "200", options), "");
  EXPECT_EQ(Parse("--node-spacing", "7.5", options), "");
  EXPECT_EQ(Parse("--sample-share", "0.25", options), "");
  EXPECT_EQ(Parse("--smoothness", "0.5", options), "");
  EXPECT_EQ(Parse("--thin-sheets-from", "0.75", options), "");
  EXPECT_EQ(Parse("--seed", "18446744073709551615", options), "");
  EXPECT_EQ(Parse("--automatic-correspondences", "off", options), "");
  EXPECT_EQ(options.max_iterations, 200);
  EXPECT_EQ(options.node_spacing_edges, 7.5);
  EXPECT_EQ(options.sample_share, 0.25);
  EXPECT_EQ(options.final_smoothness, 0.5);
  EXPECT_EQ(options.thin_sheets_from, 0.75);
  EXPECT_EQ(options.seed, ~uint64_t{0});
  EXPECT_EQ(options.automatic_correspondences, std::optional<bool>(false));
}

TEST(RegistrationFlags, RefuseWhatIsOutOfRange) {
  RegistrationOptions options;
  EXPECT_THAT(Parse("--iterations", "0", options), HasSubstr("must be in [1, 200], got 0"));
  EXPECT_THAT(Parse("--iterations", "201", options), HasSubstr("must be in [1, 200], got 201"));
  EXPECT_THAT(Parse("--sample-share", "nan", options), HasSubstr("got nan"));
  EXPECT_THAT(Parse("--thin-sheets-from", "-0.5", options), HasSubstr("[0, 1], got -0.5"));
  EXPECT_NE(Parse("--automatic-correspondences", "some", options), "");
  EXPECT_EQ(options.max_iterations, 0);
}

TEST(RegistrationFlags, HelpHasRangesAndDefaults) {
  RegistrationOptions options;
  CLI::App app;
  AddRegistrationFlags(options, app);
  const std::string help = app.help();
  EXPECT_THAT(help, HasSubstr("Distance of deformation nodes in mean edge lengths; 1 to 100 (5)"));
  EXPECT_THAT(help, HasSubstr("Seed of the random samples; any (1)"));
  EXPECT_THAT(help, HasSubstr("on|off"));
}

}  // namespace
}  // namespace liquidblend::cli
