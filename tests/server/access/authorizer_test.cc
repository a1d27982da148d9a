#include "server/access/authorizer.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/stat.h>

#include <filesystem>
#include <fstream>

#include "absl/strings/str_cat.h"
#include "server/access/access_controller.h"
#include "tests/server/backends_testing.h"

namespace liquidblend::server {
namespace {

using store::Fails;
using testing::HasSubstr;
using testing::Not;

// UndefinedBehaviorSanitizer opens a pipe to look at an object of a type that is new to it.
#if defined(__has_feature)
#if __has_feature(undefined_behavior_sanitizer)
#define LIQUIDBLEND_NEEDS_PIPES 1
#endif
#endif
#ifndef LIQUIDBLEND_NEEDS_PIPES
#define LIQUIDBLEND_NEEDS_PIPES 0
#endif

// Meanwhile no file can be opened, as if too many were.
class NoFilesLeft {
 public:
  static constexpr bool kIsPossible = LIQUIDBLEND_NEEDS_PIPES == 0;

  NoFilesLeft() {
    EXPECT_EQ(getrlimit(RLIMIT_NOFILE, &before_), 0);
    const rlimit none = {0, before_.rlim_max};
    EXPECT_EQ(setrlimit(RLIMIT_NOFILE, &none), 0);
  }
  ~NoFilesLeft() { EXPECT_EQ(setrlimit(RLIMIT_NOFILE, &before_), 0); }
  NoFilesLeft(const NoFilesLeft&) = delete;
  NoFilesLeft& operator=(const NoFilesLeft&) = delete;

 private:
  rlimit before_ = {};
};

class AuthorizerTest : public testing::Test {
 protected:
  // A file with the principal `name`, whose token is returned.
  std::string Write(const std::string& name, const std::string& more = "") {
    const NewToken made = *MakeToken(name, {"frames"});
    Replace(absl::StrCat(R"({"principals": [)", made.entry, more, "]}"));
    return made.token;
  }

  // As programs do that care: whole or not at all.
  void Replace(const std::string& text) const {
    std::ofstream(path() + ".new") << text;
    std::filesystem::rename(path() + ".new", path());
  }

  std::string path() const { return folder_.path() + "/tokens.json"; }

  const store::TemporaryFolder folder_;
};

TEST_F(AuthorizerTest, WithoutAFileEveryoneMayDoEverything) {
  const Authorizer authorizer;
  const auto anyone = authorizer.Check("some token", "", "ipv4:10.0.0.1:1234");
  ASSERT_TRUE(anyone.ok());
  EXPECT_EQ(anyone->name, "anonymous");
  EXPECT_EQ(anyone->key, "anonymous@10.0.0.1");
  for (const Scope scope : {Scope::kFrames, Scope::kWrite, Scope::kRegister}) {
    EXPECT_TRUE(CheckScope(*anyone, scope).ok());
  }
  EXPECT_EQ(authorizer.Check("", "CN=render-1", "")->name, "CN=render-1");
}

TEST_F(AuthorizerTest, ATokenIsWhoeverTheFileSays) {
  const std::string token = Write("viewer");
  const auto authorizer = Authorizer::Open(path());
  ASSERT_TRUE(authorizer.ok()) << authorizer.status();
  const auto viewer = (*authorizer)->Check(token, "CN=other", "ipv6:[::1]:5");
  ASSERT_TRUE(viewer.ok()) << viewer.status();
  EXPECT_EQ(viewer->key, "viewer");
  EXPECT_TRUE(CheckScope(*viewer, Scope::kFrames).ok());
  const absl::Status denied = CheckScope(*viewer, Scope::kWrite);
  EXPECT_THAT(denied, Fails(absl::StatusCode::kPermissionDenied, "'viewer' lacks the scope write"));
  EXPECT_EQ(ReasonOf(denied), "SCOPE_MISSING");
}

TEST_F(AuthorizerTest, ToldApartAreNoTokenAWrongOneAndAnUnknownCertificate) {
  Write("viewer");
  const auto authorizer = *Authorizer::Open(path());
  const auto refusal = [&](absl::string_view token, absl::string_view subject) {
    const absl::Status status = authorizer->Check(token, subject, "ipv4:1.2.3.4:5").status();
    EXPECT_EQ(status.code(), absl::StatusCode::kUnauthenticated);
    EXPECT_THAT(std::string(status.message()), Not(HasSubstr("wrong-token")));
    return ReasonOf(status);
  };
  EXPECT_EQ(refusal("", ""), "TOKEN_MISSING");
  EXPECT_EQ(refusal("wrong-token", ""), "TOKEN_UNKNOWN");
  EXPECT_EQ(refusal("", "CN=who"), "CERTIFICATE_UNKNOWN");
}

TEST_F(AuthorizerTest, ACertificateStandsInForAToken) {
  Write("viewer",
        R"(, {"name": "farm", "certificate_subject": "CN=render-1", "scopes": ["write"]})");
  const auto authorizer = *Authorizer::Open(path());
  EXPECT_EQ(authorizer->Check("", "CN=render-1", "")->name, "farm");
}

TEST_F(AuthorizerTest, ShownNothingTheFilesAnonymousCounts) {
  Replace(R"({"anonymous": {"scopes": ["frames"], "limits": {"max_streams": 3}}})");
  const auto authorizer = *Authorizer::Open(path());
  const auto anyone = authorizer->Check("", "", "ipv4:1.2.3.4:5");
  ASSERT_TRUE(anyone.ok()) << anyone.status();
  EXPECT_EQ(anyone->key, "anonymous@1.2.3.4");
  EXPECT_EQ(anyone->limits.max_streams, 3);
  EXPECT_FALSE(authorizer->Check("wrong", "", "").ok());
}

TEST_F(AuthorizerTest, KnowsThePrincipalsOfItsFile) {
  EXPECT_TRUE(Authorizer().Principals().empty());
  Replace(R"({"principals": [{"name": "farm", "certificate_subject": "CN=render-1",
                             "scopes": ["write"], "limits": {"max_queued_jobs": 5}}],
             "anonymous": {"scopes": ["frames"]}})");
  const std::vector<Principal> principals = (*Authorizer::Open(path()))->Principals();
  ASSERT_EQ(principals.size(), 2);
  EXPECT_EQ(principals[0].name, "farm");
  EXPECT_EQ(principals[0].limits.max_queued_jobs, 5);
  EXPECT_EQ(principals[1].name, "anonymous");
}

TEST_F(AuthorizerTest, ANewFileCountsFromItsReloadOn) {
  const std::string before = Write("before");
  const auto authorizer = *Authorizer::Open(path());
  const std::string after = Write("after");
  EXPECT_TRUE(authorizer->Check(before, "", "").ok());
  ASSERT_TRUE(authorizer->ReloadIfChanged().ok());
  EXPECT_FALSE(authorizer->Check(before, "", "").ok());
  EXPECT_EQ(authorizer->Check(after, "", "")->name, "after");
}

TEST_F(AuthorizerTest, ABrokenNewFileIsToldOfOnceAndTheFormerOneStays) {
  const std::string token = Write("viewer");
  const auto authorizer = *Authorizer::Open(path());
  Replace("{\"principals\": [{]}");
  EXPECT_THAT(authorizer->ReloadIfChanged(),
              Fails(absl::StatusCode::kInvalidArgument, "tokens.json"));
  EXPECT_TRUE(authorizer->ReloadIfChanged().ok());
  EXPECT_TRUE(authorizer->Check(token, "", "").ok());
  std::filesystem::remove(path());
  EXPECT_THAT(authorizer->ReloadIfChanged(), Fails(absl::StatusCode::kNotFound, "tokens.json"));
  EXPECT_TRUE(authorizer->Check(token, "", "").ok());
}

TEST_F(AuthorizerTest, AFileThatCannotBeReadForAMomentIsReadLater) {
  if (!NoFilesLeft::kIsPossible) GTEST_SKIP() << "the sanitizer needs files";
  const std::string revoked = Write("revoked");
  const auto authorizer = *Authorizer::Open(path());
  const std::string after = Write("after");
  absl::Status reloaded;
  bool is_still_known = false;
  {
    const NoFilesLeft none;
    reloaded = authorizer->ReloadIfChanged();
    is_still_known = authorizer->Check(revoked, "", "").ok();
  }
  EXPECT_THAT(reloaded,
              Fails(absl::StatusCode::kFailedPrecondition, "tokens.json: Too many open files"));
  EXPECT_TRUE(is_still_known);
  EXPECT_TRUE(authorizer->ReloadIfChanged().ok());
  ASSERT_FALSE(authorizer->Check(revoked, "", "").ok());
  EXPECT_EQ(authorizer->Check(after, "", "")->name, "after");
}

TEST_F(AuthorizerTest, AFileThatCannotBeReadIsToldOfOnceForEachChange) {
  if (!NoFilesLeft::kIsPossible) GTEST_SKIP() << "the sanitizer needs files";
  Write("before");
  const auto authorizer = *Authorizer::Open(path());
  for (const char* name : {"one", "other"}) {
    Write(name);
    const NoFilesLeft none;
    EXPECT_FALSE(authorizer->ReloadIfChanged().ok()) << name;
    for (int look = 0; look < 3; ++look) EXPECT_TRUE(authorizer->ReloadIfChanged().ok()) << name;
  }
  EXPECT_TRUE(authorizer->ReloadIfChanged().ok());
  Write("last");
  const NoFilesLeft none;
  EXPECT_FALSE(authorizer->ReloadIfChanged().ok()) << "in between it was read";
}

// A pipe would keep whoever opens it.
TEST_F(AuthorizerTest, OnlyAFileIsRead) {
  ASSERT_EQ(mkfifo(path().c_str(), 0600), 0);
  EXPECT_THAT(Authorizer::Open(path()).status(),
              Fails(absl::StatusCode::kFailedPrecondition, "not a regular file"));
  EXPECT_FALSE(Authorizer::Open(folder_.path()).ok());
}

TEST_F(AuthorizerTest, ABrokenFileAtTheStartIsRefused) {
  Replace("no");
  EXPECT_FALSE(Authorizer::Open(path()).ok());
  EXPECT_FALSE(Authorizer::Open(folder_.path() + "/none").ok());
}

TEST_F(AuthorizerTest, AnonymousAddressesOfOneNetworkShareTheirLimits) {
  Replace(R"({"anonymous": {"scopes": ["frames"], "limits": {"requests_per_second": 0.001}}})");
  const auto authorizer = *Authorizer::Open(path());
  AccessController access(*authorizer);
  const auto admit = [&](absl::string_view peer) {
    AccessGrant grant;
    return access.Admit({"", "", peer}, {Scope::kFrames, false}, grant);
  };
  EXPECT_TRUE(admit("[2001:db8:0:1::1]:5000").ok());
  EXPECT_THAT(admit("[2001:db8:0:1:ffff::2]:5000"),
              Fails(absl::StatusCode::kResourceExhausted, "0.001 calls per second"));
  EXPECT_TRUE(admit("[2001:db8:0:2::1]:5000").ok());
}

TEST(HostOfPeer, IsTheAddressWithoutItsPortAndOfIpv6TheNetwork) {
  EXPECT_EQ(HostOfPeer("10.0.0.1:50"), "10.0.0.1");
  EXPECT_EQ(HostOfPeer("ipv4:10.0.0.1:50"), "10.0.0.1");
  EXPECT_EQ(HostOfPeer("localhost:50"), "localhost");
  EXPECT_EQ(HostOfPeer("[2001:db8:0:1:2:3:4:5]:50"), "2001:db8:0:1::/64");
  EXPECT_EQ(HostOfPeer("ipv6:[2001:db8:0:1::9]:50"), "2001:db8:0:1::/64");
  EXPECT_EQ(HostOfPeer("ipv6:%5B2001:db8:0:1::9%5D:50"), "2001:db8:0:1::/64");
  EXPECT_EQ(HostOfPeer("ipv6:%5Bfe80::1%25eth0%5D:50"), "fe80::/64");
  EXPECT_EQ(HostOfPeer("[::ffff:10.0.0.1]:50"), "10.0.0.1");
  EXPECT_EQ(HostOfPeer("[no address]:50"), "[no address]");
  EXPECT_EQ(HostOfPeer("unix:/tmp/socket"), "unix");
  EXPECT_EQ(HostOfPeer(""), "");
}

TEST(BearerToken, IsWhatFollowsTheScheme) {
  EXPECT_EQ(BearerToken("Bearer abc"), "abc");
  EXPECT_EQ(BearerToken("bearer  abc "), "abc");
  EXPECT_EQ(BearerToken("Basic abc"), "");
  EXPECT_EQ(BearerToken(""), "");
}

}  // namespace
}  // namespace liquidblend::server
