#include "client/src/servers.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdlib>
#include <iterator>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/time/clock.h"
#include "tests/client/fake_server.h"
#include "tests/client/temp_files.h"
#include "tests/e2e/faults/fault_proxy.h"

namespace liquidblend::servers_test {
namespace {

using ::testing::ElementsAre;
using testing::FakeServer;
using ::testing::HasSubstr;

const absl::Status kAway = absl::UnavailableError("going away");
constexpr absl::Duration kPatience = absl::Seconds(20);

// The variables that gRPC reads a proxy from; those of the test's caller come back at the end.
class ProxyVariables {
 public:
  ProxyVariables() {
    for (const char* name : kNames) {
      const char* const value = getenv(name);
      former_.push_back(value == nullptr ? std::nullopt : std::optional<std::string>(value));
      unsetenv(name);
    }
  }
  ~ProxyVariables() {
    for (size_t k = 0; k < std::size(kNames); ++k) {
      unsetenv(kNames[k]);
      if (former_[k].has_value()) setenv(kNames[k], former_[k]->c_str(), 1);
    }
  }
  ProxyVariables(const ProxyVariables&) = delete;
  ProxyVariables& operator=(const ProxyVariables&) = delete;

 private:
  static constexpr const char* kNames[] = {"grpc_proxy", "https_proxy",   "http_proxy",
                                           "no_proxy",   "no_grpc_proxy", "no_https_proxy"};
  std::vector<std::optional<std::string>> former_;
};

TEST(Servers, AreReachedWithoutAProxyOnThisMachine) {
  FakeServer server;
  const ProxyVariables variables;
  setenv("http_proxy", "http://127.0.0.1:1", 1);  // where nobody listens
  ConnectOptions options;
  options.target = server.target();
  const auto client = Client::Connect(options);
  ASSERT_TRUE(client.ok()) << client.status();
  EXPECT_TRUE((*client)->GetFamily("drops").ok());
}

TEST(AddressesIn, SplitsAtCommasUnlessGrpcKnowsTheList) {
  EXPECT_THAT(client::AddressesIn("a:1"), ElementsAre("a:1"));
  EXPECT_THAT(client::AddressesIn("a:1,b:2"), ElementsAre("a:1", "b:2"));
  EXPECT_THAT(client::AddressesIn("ipv4:1.2.3.4:1,1.2.3.5:1"),
              ElementsAre("ipv4:1.2.3.4:1,1.2.3.5:1"));
}

// Two servers and a client of both. Waiting before a call is repeated would take longer than a test
// may.
class ServersTest : public ::testing::Test {
 protected:
  ServersTest() {
    options_.target = absl::StrCat(first_->target(), ",", second_.target());
    options_.retry.initial_backoff = absl::Hours(1);
    options_.retry.max_backoff = absl::Hours(1);
    Connect();
  }

  // Returns when both are reached, so that calls go to them in turn.
  void Connect() {
    client_ = *Client::Connect(options_);
    if (!first_.has_value()) return;
    const int before = NumCalls("GetAnimation", *first_), other = NumCalls("GetAnimation", second_);
    while (NumCalls("GetAnimation", *first_) == before ||
           NumCalls("GetAnimation", second_) == other) {
      ASSERT_TRUE(client_->GetAnimation("drops-a").ok());
    }
  }

  static int NumCalls(const std::string& method, const FakeServer& server) {
    return server.NumCalls(method);
  }

  std::optional<FakeServer> first_{std::in_place};
  FakeServer second_;
  ConnectOptions options_;
  std::unique_ptr<Client> client_;
};

TEST_F(ServersTest, TakeTurns) {
  for (int k = 0; k < 10; ++k) EXPECT_TRUE(client_->GetFamily("drops").ok());
  EXPECT_EQ(first_->NumCalls("GetFamily"), 5);
  EXPECT_EQ(second_.NumCalls("GetFamily"), 5);
}

TEST_F(ServersTest, ThoseThatAreThereTakeEvenTurnsBesideOneThatIsNot) {
  options_.target = absl::StrCat(first_->target(), ",127.0.0.1:1,", second_.target());
  Connect();
  for (int k = 0; k < 10; ++k) EXPECT_TRUE(client_->GetFamily("drops").ok());
  EXPECT_EQ(first_->NumCalls("GetFamily"), 5);
  EXPECT_EQ(second_.NumCalls("GetFamily"), 5);
}

TEST_F(ServersTest, AnErrorThatEveryServerWouldGiveIsGivenOnce) {
  EXPECT_FALSE(client_->GetFamily("none").ok());
  EXPECT_EQ(first_->NumCalls("GetFamily") + second_.NumCalls("GetFamily"), 1);
}

TEST_F(ServersTest, ACallGoesToTheNextAtOnceAndLaterOnesKeepAwayForAMoment) {
  constexpr absl::Duration kMoment = absl::Seconds(1);
  const auto num_calls = [&] {
    return std::pair(first_->NumCalls("GetFamily"), second_.NumCalls("GetFamily"));
  };
  std::pair<int, int> before;
  absl::Time begin;
  do {
    absl::SleepFor(kMoment);  // then it is asked again
    before = num_calls();
    begin = absl::Now();
    first_->FailNext("GetFamily", 1, kAway);
    for (int k = 0; k < 4; ++k) EXPECT_TRUE(client_->GetFamily("drops").ok());
  } while (absl::Now() - begin >= kMoment);  // the machine was busy
  EXPECT_EQ(num_calls(), std::pair(before.first + 1, before.second + 4));
}

TEST_F(ServersTest, AServerThatIsGoneIsDoneWithout) {
  first_.reset();
  for (int k = 0; k < 3; ++k) EXPECT_TRUE(client_->GetFamily("drops").ok());
}

TEST_F(ServersTest, AServerThatIsNotHealthyGetsNoCalls) {
  first_->SetHealthy(false);
  const auto deadline = absl::Now() + kPatience;
  // Until the client has heard of it.
  for (int num_alone = 0; num_alone < 20 && absl::Now() < deadline;) {
    const int before = first_->NumCalls("GetFamily");
    ASSERT_TRUE(client_->GetFamily("drops").ok());
    num_alone = first_->NumCalls("GetFamily") == before ? num_alone + 1 : 0;
  }
  const int before = first_->NumCalls("GetFamily");
  for (int k = 0; k < 10; ++k) EXPECT_TRUE(client_->GetFamily("drops").ok());
  EXPECT_EQ(first_->NumCalls("GetFamily"), before);
  first_->SetHealthy(true);
  while (first_->NumCalls("GetFamily") == before && absl::Now() < deadline) {
    ASSERT_TRUE(client_->GetFamily("drops").ok());
  }
  EXPECT_GT(first_->NumCalls("GetFamily"), before);
}

// While all of them load families, say: late answers are better than none.
TEST_F(ServersTest, ServersThatAreNotHealthyAreAskedIfNoneIs) {
  first_->SetHealthy(false);
  second_.SetHealthy(false);
  for (int k = 0; k < 20; ++k) EXPECT_TRUE(client_->GetFamily("drops").ok()) << k;
  const auto client = Client::Connect(options_);
  ASSERT_TRUE(client.ok()) << client.status();
  EXPECT_TRUE((*client)->GetFamily("drops").ok());
}

// A server of several behind one name: the next call of the same name may get another one.
TEST_F(ServersTest, AServerThatShutsDownIsAskedAgainAsItsNameMayHaveOthers) {
  options_.target = second_.target();
  first_.reset();
  Connect();
  second_.FailNext("GetFamily", 2, testing::WithReason(kAway, "SHUTTING_DOWN"));
  EXPECT_TRUE(client_->GetFamily("drops").ok());
  EXPECT_EQ(second_.NumCalls("GetFamily"), 3);
}

TEST_F(ServersTest, TheFirstIsAskedAgainWhenTheSecondGoesAway) {
  first_->FailNext("GetFamily", 1, kAway);
  while (first_->NumCalls("GetFamily") == 0) {  // until it is asked first
    EXPECT_TRUE(client_->GetFamily("drops").ok());
  }
  second_.FailNext("GetFamily", 1, kAway);
  EXPECT_TRUE(client_->GetFamily("drops").ok());
  EXPECT_EQ(first_->NumCalls("GetFamily"), 2);
}

TEST_F(ServersTest, AllAwayIsOneAttempt) {
  options_.retry.max_attempts = 2;
  options_.retry.initial_backoff = absl::Milliseconds(1);
  Connect();
  first_->FailNext("GetFamily", 100, kAway);
  second_.FailNext("GetFamily", 100, kAway);
  const absl::Status status = client_->GetFamily("drops").status();
  EXPECT_EQ(status.code(), absl::StatusCode::kUnavailable);
  EXPECT_THAT(std::string(status.message()), HasSubstr("after 2 attempts"));
  EXPECT_EQ(first_->NumCalls("GetFamily"), 2);
  EXPECT_EQ(second_.NumCalls("GetFamily"), 2);
}

TEST_F(ServersTest, ARegistrationHasOneRequestIdOnEveryServer) {
  first_->FailNext("RegisterFamily", 1, kAway);
  second_.FailNext("RegisterFamily", 1, kAway);
  options_.retry.initial_backoff = absl::Milliseconds(1);
  Connect();
  RegisterRequest request;
  request.family = "drops";
  request.source = "drops-a";
  request.targets = {"drops-b"};
  ASSERT_TRUE(client_->RegisterFamily(request).ok());
  std::vector<std::string> ids = first_->RequestIds();
  for (const std::string& id : second_.RequestIds()) ids.push_back(id);
  EXPECT_GE(ids.size(), 3u);
  EXPECT_THAT(ids, ::testing::Each(ids[0]));
}

TEST_F(ServersTest, ADeletionWhoseAnswerWasLostIsDoneAtTheNextServer) {
  absl::Status status;
  while (first_->NumCalls("DeleteFamily") == 0) {  // until it is asked first
    first_->FailNext("DeleteFamily", 1, kAway);
    second_.FailNext("DeleteFamily", 1, absl::NotFoundError("gone"));
    status = client_->DeleteFamily("drops");
  }
  EXPECT_TRUE(status.ok()) << status;
}

TEST_F(ServersTest, AnUploadIsRepeatedWholeAtTheNext) {
  first_->RefuseNextUpload(kAway);
  second_.RefuseNextUpload(kAway);
  options_.retry.initial_backoff = absl::Milliseconds(1);
  Connect();
  const testing::TempDir dir;
  UploadRequest request;
  request.animation = "drops-a";
  request.files = {dir.Write("f_1.ply", "bytes"), dir.Write("f_2.ply", "more")};
  ASSERT_TRUE(client_->UploadAnimation(request).ok());
  std::vector<testing::ReceivedUpload> uploads = first_->Uploads();
  for (const testing::ReceivedUpload& upload : second_.Uploads()) uploads.push_back(upload);
  ASSERT_EQ(uploads.size(), 1u);
  EXPECT_EQ(uploads[0].files.size(), 2u);
}

TEST_F(ServersTest, WatchesAndStreamsGoOnAtTheNext) {
  options_.retry.initial_backoff = absl::Milliseconds(1);
  Connect();
  first_->BreakNextWatch();
  second_.BreakNextWatch();
  const absl::StatusOr<Operation> done = client_->WaitOperation("register-1");
  ASSERT_TRUE(done.ok()) << done.status();

  first_->FailNext("StreamFrames", 1, kAway);
  second_.FailNext("StreamFrames", 1, kAway);
  StreamSettings settings;
  settings.family = "drops";
  settings.weights = {0.5};
  const auto stream = *client_->StreamFrames(settings);
  ASSERT_TRUE(stream->Read().ok());
  EXPECT_EQ(first_->NumCalls("StreamFrames") + second_.NumCalls("StreamFrames"), 3);
}

// A machine that vanishes says nothing, and a watch has no deadline.
TEST_F(ServersTest, AWatchOfAServerThatFallsSilentGoesOnAtTheNext) {
  e2e::FaultProxy one(first_->port()), two(second_.port());
  options_.target = absl::StrCat("127.0.0.1:", one.port(), ",127.0.0.1:", two.port());
  options_.keepalive = absl::Seconds(2);
  options_.retry.initial_backoff = absl::Milliseconds(1);
  Connect();
  int num_updates = 0;
  const auto update = [&](const Operation&) {
    (first_->NumCalls("WatchOperation") > 0 ? one : two).Cut();
    return ++num_updates < 2;
  };
  const absl::Status status =
      client_->WatchOperation("endless-1", update, absl::Minutes(1)).status();
  EXPECT_EQ(status.code(), absl::StatusCode::kCancelled) << status;  // by the second update
  EXPECT_EQ(first_->NumCalls("WatchOperation"), 1);
  EXPECT_EQ(second_.NumCalls("WatchOperation"), 1);
}

// It answers that its catalog is away; what was published it will serve later.
TEST_F(ServersTest, AWaitIsOverWhenEveryServerThatAnswersHasTheVersion) {
  options_.call_timeout = absl::Milliseconds(100);
  client_ = *Client::Connect(options_);
  second_.FailNext("WatchOperation", 3, testing::WithRetryDelay(kAway, absl::Seconds(1)));
  const absl::StatusOr<Operation> done = client_->WaitOperation("register-1");
  ASSERT_TRUE(done.ok()) << done.status();
  EXPECT_EQ(second_.NumCalls("WatchOperation"), 4);
}

TEST_F(ServersTest, AWaitNamesTheServerThatStaysBehind) {
  options_.call_timeout = absl::Milliseconds(100);
  options_.retry.patience = absl::Milliseconds(500);
  client_ = *Client::Connect(options_);
  second_.FailNext("WatchOperation", 1000, testing::WithRetryDelay(kAway, absl::Seconds(1)));
  const absl::Status status = client_->WaitOperation("register-1").status();
  EXPECT_EQ(status.code(), absl::StatusCode::kDeadlineExceeded);
  EXPECT_THAT(std::string(status.message()),
              HasSubstr(absl::StrCat("operations/register-1 has published version 3 of "
                                     "families/drops, but the server at ",
                                     second_.target(), " does not serve it after 500ms: ")));
}

TEST_F(ServersTest, AWatchEndsAtItsTimeoutWhileAServerStaysBehind) {
  Connect();
  second_.FailNext("WatchOperation", 1000, testing::WithRetryDelay(kAway, absl::Seconds(1)));
  const absl::Status status =
      client_->WatchOperation("register-1", nullptr, absl::Seconds(2)).status();
  EXPECT_EQ(status.code(), absl::StatusCode::kDeadlineExceeded);
  EXPECT_THAT(std::string(status.message()),
              HasSubstr(absl::StrCat("the server at ", second_.target(), " does not serve it")));
}

TEST_F(ServersTest, AWaitDoesWithoutAServerThatCannotBeReached) {
  first_.reset();
  client_ = *Client::Connect(options_);
  EXPECT_TRUE(client_->WaitOperation("register-1").ok());
}

TEST_F(ServersTest, ConnectTakesTheOneThatIsThere) {
  first_.reset();
  const auto client = Client::Connect(options_);
  ASSERT_TRUE(client.ok()) << client.status();
  EXPECT_TRUE((*client)->GetFamily("drops").ok());
}

TEST_F(ServersTest, ATokenMustBeSafeOnTheWayToEveryServer) {
  options_.target = absl::StrCat(second_.target(), ",liquid.example:50051");
  options_.security.token = "secret";
  const absl::Status status = Client::Connect(options_).status();
  EXPECT_EQ(status.code(), absl::StatusCode::kInvalidArgument);
  EXPECT_THAT(std::string(status.message()), HasSubstr("liquid.example:50051"));
}

TEST_F(ServersTest, AnEmptyAddressIsRefused) {
  for (const char* target : {",a:1", "a:1,", "a:1,,b:2"}) {
    options_.target = target;
    EXPECT_THAT(Client::Connect(options_).status().ToString(), HasSubstr(target));
  }
}

}  // namespace
}  // namespace liquidblend::servers_test
