#include "server/access/token_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>

#include "absl/strings/str_cat.h"
#include "tests/core/store/store_testing.h"

namespace liquidblend::server::token_file_test {
namespace {

using store::Fails;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::Not;

constexpr char kHashOfHello[] = "2cf24dba5fb0a30e26e83b2ac5b9e29e1b161e5c1fa7425e73043362938b9824";

// A file with one principal, with more fields.
std::string File(const std::string& more, const std::string& hash = kHashOfHello) {
  return absl::StrCat(R"({"principals": [{"name": "studio", "token_sha256": [")", hash, R"("])",
                      more, "}]}");
}

TEST(TokenFile, HoldsPrincipalsWithTheirScopesAndLimits) {
  const auto file = ParseTokenFile(File(R"(, "certificate_subject": "CN=render-1",
      "scopes": ["frames", "register"],
      "limits": {"max_upload_bytes": 1000, "max_streams": 2, "requests_per_second": 0.5,
                 "max_stored_bytes": 5000000000000, "max_queued_jobs": 7})"));
  ASSERT_TRUE(file.ok()) << file.status();
  ASSERT_EQ(file->entries.size(), 1U);
  const TokenEntry& entry = file->entries[0];
  EXPECT_EQ(entry.principal.name, "studio");
  EXPECT_THAT(entry.principal.scopes, ElementsAre(Scope::kFrames, Scope::kRegister));
  EXPECT_EQ(entry.principal.limits.max_upload_bytes, 1000);
  EXPECT_EQ(entry.principal.limits.max_streams, 2);
  EXPECT_EQ(entry.principal.limits.requests_per_second, 0.5);
  EXPECT_EQ(entry.principal.limits.max_stored_bytes, 5'000'000'000'000);
  EXPECT_EQ(entry.principal.limits.max_queued_jobs, 7);
  EXPECT_THAT(entry.token_hashes, ElementsAre(HashToken("hello")));
  EXPECT_EQ(entry.certificate_subject, "CN=render-1");
  EXPECT_FALSE(file->anonymous.has_value());
}

TEST(TokenFile, MayLetAnonymousCallersIn) {
  const auto file = ParseTokenFile(R"({"anonymous": {"scopes": ["frames"]}})");
  ASSERT_TRUE(file.ok()) << file.status();
  EXPECT_THAT(file->anonymous->scopes, ElementsAre(Scope::kFrames));
  EXPECT_TRUE(file->entries.empty());
}

TEST(TokenFile, NamesWhatIsWrong) {
  const auto message = [](const std::string& text) {
    const absl::Status status = ParseTokenFile(text).status();
    EXPECT_EQ(status.code(), absl::StatusCode::kInvalidArgument) << text;
    return std::string(status.message());
  };
  const std::string scopes = R"(, "scopes": ["frames"])";
  EXPECT_THAT(message("{"), HasSubstr("JSON"));
  EXPECT_THAT(message("[]"), HasSubstr("the file: must be an object"));
  EXPECT_THAT(message(R"({"principals": {}})"), HasSubstr("must be a list"));
  EXPECT_THAT(message(R"({"principal": []})"), HasSubstr("unknown field 'principal'"));
  EXPECT_THAT(message(File(", \"scope\": 1")), HasSubstr("principals[0]: has an unknown field"));
  EXPECT_THAT(message(File("")), HasSubstr("at least one"));
  EXPECT_THAT(message(File(R"(, "scopes": "frames")")), HasSubstr("list of strings"));
  EXPECT_THAT(message(File(R"(, "scopes": ["all"])")), HasSubstr("'all'"));
  EXPECT_THAT(message(File(scopes, "12")), HasSubstr("64 hexadecimal"));
  EXPECT_THAT(message(File(scopes + R"(, "limits": {"max_streams": -1})")),
              HasSubstr("principals[0].limits: limit max_streams"));
  EXPECT_THAT(message(File(scopes + R"(, "limits": {"max_streams": 1.5})")),
              HasSubstr("max_streams must be a number"));
  EXPECT_THAT(message(File(scopes + R"(, "limits": {"max_stored_bytes": -1})")),
              HasSubstr("limit max_stored_bytes is out of range: -1"));
  EXPECT_THAT(message(File(scopes + R"(, "limits": {"max_queued_jobs": -1})")),
              HasSubstr("limit max_queued_jobs is out of range: -1"));
  EXPECT_THAT(message(File(scopes + R"(, "limits": {"max_queued_jobs": "7"})")),
              HasSubstr("max_queued_jobs must be a number"));
  EXPECT_THAT(message(File(scopes + R"(, "limits": {"streams": 1})")), HasSubstr("'streams'"));
  EXPECT_THAT(message(R"({"principals": [{"name": "a", "scopes": ["write"]}]})"),
              HasSubstr("token_sha256 or a certificate_subject"));
  EXPECT_THAT(message(R"({"principals": [{"name": "anonymous", "certificate_subject": "a",
                         "scopes": ["write"]}]})"),
              HasSubstr("name must be"));
  EXPECT_THAT(message(R"({"principals": [
      {"name": "a", "certificate_subject": "s", "scopes": ["write"]},
      {"name": "b", "certificate_subject": "s", "scopes": ["write"]}]})"),
              HasSubstr("b: has a certificate_subject that is there already"));
}

TEST(TokenFile, ErrorsDoNotShowWhatMightBeAToken) {
  const absl::Status status =
      ParseTokenFile(File(R"(, "scopes": ["write"])", "a-token-by-mistake")).status();
  EXPECT_THAT(std::string(status.message()), Not(HasSubstr("a-token-by-mistake")));
}

TEST(TokenFile, ReadingNamesThePath) {
  const store::TemporaryFolder folder;
  EXPECT_THAT(ReadTokenFile(folder.path() + "/none").status(),
              Fails(absl::StatusCode::kNotFound, "none"));
  std::ofstream(folder.path() + "/tokens.json") << "no";
  EXPECT_THAT(ReadTokenFile(folder.path() + "/tokens.json").status(),
              Fails(absl::StatusCode::kInvalidArgument, "tokens.json"));
}

TEST(MakeToken, GivesAnEntryThatKnowsTheToken) {
  const auto made = MakeToken("studio", {"frames", "write"});
  ASSERT_TRUE(made.ok()) << made.status();
  EXPECT_EQ(made->token.size(), 43U);
  const auto file = ParseTokenFile(absl::StrCat(R"({"principals": [)", made->entry, "]}"));
  ASSERT_TRUE(file.ok()) << file.status() << made->entry;
  EXPECT_EQ(file->entries[0].principal.name, "studio");
  EXPECT_THAT(file->entries[0].token_hashes, ElementsAre(HashToken(made->token)));
  EXPECT_THAT(made->entry, Not(HasSubstr(made->token)));
  EXPECT_NE(MakeToken("studio", {"frames"})->token, made->token);
  EXPECT_THAT(MakeToken("studio", {"all"}).status(),
              Fails(absl::StatusCode::kInvalidArgument, "'all'"));
  EXPECT_THAT(MakeToken("", {"frames"}).status(),
              Fails(absl::StatusCode::kInvalidArgument, "name"));
}

}  // namespace
}  // namespace liquidblend::server::token_file_test
