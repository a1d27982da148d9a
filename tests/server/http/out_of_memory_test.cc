// Wherever memory runs out for an answer, its client hears of it and the server goes on.
#include <functional>
#include <string>

#include "absl/synchronization/notification.h"
#include "server/http/exchange/replies.h"
#include "server/http/router.h"
#include "tests/failing_new.h"
#include "tests/server/http/port_testing.h"

namespace liquidblend::http::out_of_memory_test {
namespace {

using testing::HasSubstr;
using testing_memory::FailingNew;
using testing_memory::FailingOnce;

class OutOfMemoryTest : public PortTest {
 protected:
  OutOfMemoryTest() : PortTest(OneIoThread()) {}

  static server::BackendsOptions OneIoThread() {
    server::BackendsOptions options = Options();
    options.num_io_threads = 1;
    return options;
  }

  // With a body that is never sent.
  static Request Registration() {
    Request request;
    request.method = "POST";
    request.target = "/v1/families";
    request.content_type = "application/json";
    request.request_id = std::string(40, 'r');
    request.peer = "127.0.0.1:50000";
    request.has_body = true;
    return request;
  }

  // Runs work on the thread that waits for the catalog, of which there is one.
  void RunOnIo(std::function<void()> work) {
    absl::Notification done;
    ASSERT_TRUE(backends_.io
                    .Post([&] {
                      work();
                      done.Notify();
                    })
                    .ok());
    done.WaitForNotification();
  }
};

TEST_F(OutOfMemoryTest, EachAnswerIsGivenNevertheless) {
  LB_SKIP_UNLESS_ALLOCATIONS_MAY_FAIL();
  Router router(*api_, {});
  bool has_failed = true;
  for (int n = 0; has_failed; ++n) {
    int num_answers = 0;
    Response answer;
    const ExchangePtr exchange = router.Answer(Registration(), [&](Response response) {
      ++num_answers;
      answer = std::move(response);
    });
    ASSERT_FALSE(exchange->is_finished());
    Response made = TextReply("made");
    {
      const FailingOnce failing(n);
      EXPECT_NO_THROW(exchange->Finish(std::move(made))) << n;
      has_failed = FailingOnce::has_failed();
    }
    EXPECT_EQ(num_answers, 1) << n;
    if (answer.code == 200) {
      EXPECT_EQ(answer.body, "made") << n;
    } else {
      EXPECT_EQ(answer.code, 429) << n;
    }
    EXPECT_TRUE(has_failed || answer.code == 200) << n;
  }
}

// Two copies of a long header are the only large allocations of the answer.
TEST_F(OutOfMemoryTest, NoClientWaitsForAnAnswerThatCannotBeWritten) {
  LB_SKIP_UNLESS_ALLOCATIONS_MAY_FAIL();
  PortOptions options;
  options.router.allowed_origin = "https://" + std::string(60'000, 'a');
  Start(options);
  constexpr int kMaxFailures = 10;
  bool has_failed = true;
  int num_failures = 0;
  for (int n = 0; has_failed && n < kMaxFailures; ++n) {
    HttpClient client(port_->port());
    const FailingNew failing(50'000, n);
    ASSERT_TRUE(client.Send("GET /v1/families HTTP/1.1\r\nHost: localhost\r\n\r\n"));
    const int code = client.ReadCode();
    has_failed = FailingNew::has_failed();
    if (has_failed) ++num_failures;
    EXPECT_EQ(code == 200, !has_failed) << n;
    EXPECT_TRUE(code == 200 || code == 429 || client.IsClosed()) << n;
  }
  EXPECT_FALSE(has_failed) << "not every place was tried";
  EXPECT_GE(num_failures, 2);
}

// Of all that the thread does which answers the call: the last thing is to hand the answer over.
TEST_F(OutOfMemoryTest, NoClientWaitsForAnAnswerThatCannotBeHandedOver) {
  LB_SKIP_UNLESS_ALLOCATIONS_MAY_FAIL();
  // Protocol Buffers, which cannot take a failure where they set up a type, do so here.
  ASSERT_EQ(HttpClient(port_->port()).Get("/v1/families").code, 200);
  int num_lost = 0;
  // Now and then the thread refreshes families, and the failure may be in that.
  for (int round = 0; round < 3 && num_lost == 0; ++round) {
    bool has_failed = true;
    for (int n = 0; has_failed; ++n) {
      ASSERT_LT(n, 2000);
      HttpClient client(port_->port());
      RunOnIo([n] { testing_memory::num_before_own_failure = n; });
      ASSERT_TRUE(client.Send("GET /v1/families HTTP/1.1\r\nHost: localhost\r\n\r\n"));
      const int code = client.ReadCode();
      RunOnIo([&has_failed] {
        has_failed = testing_memory::num_before_own_failure < 0;
        testing_memory::num_before_own_failure = -1;
      });
      num_lost += code == 0;
      EXPECT_TRUE(code != 0 || client.IsClosed()) << n;
      EXPECT_TRUE(has_failed || code == 200) << n << ": " << code;
    }
  }
  EXPECT_GE(num_lost, 1) << "not every place was tried";
}

// It is told of by a destructor.
TEST_F(OutOfMemoryTest, AStreamsEndIsToldIfThereIsMemory) {
  LB_SKIP_UNLESS_ALLOCATIONS_MAY_FAIL();
  Router router(*api_, {});
  const server::Caller caller = CallerOf(Registration());
  const std::string reason(100, 'a');
  bool has_failed = true;
  for (int n = 0; has_failed; ++n) {
    const FailingOnce failing(n);
    EXPECT_NO_THROW(router.NoteStream(caller, 4400, reason, absl::Seconds(2))) << n;
    has_failed = FailingOnce::has_failed();
  }
  EXPECT_THAT(backends_.metrics.Text({}), HasSubstr(R"(code="4400")"));
  const std::string kind = "liquidblend_http_connections{kind=\"websocket\"} ";
  {
    const FailingOnce failing(0);
    EXPECT_NO_THROW(backends_.metrics.AddConnections("websocket", 1));
  }
  EXPECT_THAT(backends_.metrics.Text({}), HasSubstr(kind + "1\n"));
}

}  // namespace
}  // namespace liquidblend::http::out_of_memory_test
