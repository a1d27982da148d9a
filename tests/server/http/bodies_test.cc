// Bodies of requests over a real connection.
#include <nlohmann/json.hpp>
#include <thread>

#include "absl/strings/str_cat.h"
#include "absl/time/clock.h"
#include "tests/server/http/port_testing.h"

namespace liquidblend::http::bodies_test {
namespace {

using testing::HasSubstr;

constexpr char kJson[] = "Content-Type: application/json\r\n";
constexpr char kRegistration[] =
    R"({"familyId": "new", "source": "animations/a", "targets": ["animations/b"]})";

class BodiesTest : public PortTest {
 protected:
  std::string Chunked(const std::string& body, size_t piece) {
    std::string bytes;
    for (size_t begin = 0; begin < body.size(); begin += piece) {
      const std::string chunk = body.substr(begin, piece);
      absl::StrAppend(&bytes, absl::Hex(chunk.size()), "\r\n", chunk, "\r\n");
    }
    return bytes + "0\r\n\r\n";
  }

  HttpReply Post(HttpClient& client, const std::string& target, const std::string& body,
                 const std::string& headers = "") {
    client.Send(absl::StrCat("POST ", target, " HTTP/1.1\r\nHost: localhost\r\n", kJson, headers,
                             "Content-Length: ", body.size(), "\r\n\r\n", body));
    return client.ReadReply();
  }
};

TEST_F(BodiesTest, ARegistrationIsSubmittedAndItsOperationCancelled) {
  HttpClient client(port_->port());
  const HttpReply reply = Post(client, "/v1/families", kRegistration);
  EXPECT_EQ(reply.code, 200) << reply.body;
  const std::string name = nlohmann::json::parse(reply.body)["name"];
  const auto shown = nlohmann::json::parse(client.Get("/v1/" + name).body);
  EXPECT_EQ(shown["metadata"]["@type"],
            "type.googleapis.com/liquidblend.v1.RegisterFamilyMetadata");
  EXPECT_EQ(shown["metadata"]["family"], "families/new");
  const HttpReply waited =
      Post(client, absl::StrCat("/v1/", name, ":wait"), R"({"timeout": "0s"})");
  EXPECT_EQ(waited.code, 200) << waited.body;
  EXPECT_FALSE(nlohmann::json::parse(waited.body).contains("done"));
  EXPECT_EQ(Post(client, absl::StrCat("/v1/", name, ":cancel"), "").body, "{}\n");
  EXPECT_EQ(nlohmann::json::parse(client.Get("/v1/" + name).body)["error"]["code"], 1);
  EXPECT_EQ(client.Request("DELETE", "/v1/" + name).code, 200);
  EXPECT_EQ(client.Get("/v1/" + name).code, 404);
}

TEST_F(BodiesTest, ChunksOfAnySizeMakeABody) {
  for (const size_t piece : {1, 7, 1000}) {
    HttpClient client(port_->port());
    client.Send(absl::StrCat("POST /v1/families HTTP/1.1\r\nHost: localhost\r\n", kJson,
                             "Transfer-Encoding: chunked\r\n\r\n",
                             Chunked(R"({"familyId": "No!"})", piece)));
    const HttpReply reply = client.ReadReply();
    EXPECT_EQ(reply.code, 400) << piece;
    EXPECT_THAT(reply.body, HasSubstr("family_id")) << piece;
    EXPECT_EQ(client.Get("/healthz").body, "ok\n") << "the connection goes on";
  }
}

TEST_F(BodiesTest, ABodyBehindAnotherRequestIsWhole) {
  HttpClient client(port_->port());
  const std::string body = absl::StrCat(R"({"familyId": )", std::string(200'000, ' '), R"("No!"})");
  for (int k = 0; k < 10; ++k) {
    client.Send(absl::StrCat("GET /healthz HTTP/1.1\r\nHost: localhost\r\n\r\n",
                             "POST /v1/families HTTP/1.1\r\nHost: localhost\r\n", kJson,
                             "Content-Length: ", body.size(), "\r\n\r\n"));
    EXPECT_EQ(client.ReadReply().body, "ok\n");
    for (size_t begin = 0; begin < body.size(); begin += 10'000) {
      client.Send(body.substr(begin, 10'000));
    }
    const HttpReply reply = client.ReadReply();
    EXPECT_EQ(reply.code, 400);
    ASSERT_THAT(reply.body, HasSubstr("family_id")) << k;
  }
}

TEST_F(BodiesTest, RequestsBehindABodyAreAnswered) {
  HttpClient client(port_->port());
  std::string requests;
  for (int k = 0; k < 3; ++k) {
    absl::StrAppend(&requests, "POST /v1/families HTTP/1.1\r\nHost: localhost\r\n", kJson,
                    "Content-Length: 2\r\n\r\n{}");
  }
  ASSERT_TRUE(client.Send(absl::StrCat(requests, "GET /healthz HTTP/1.1\r\nHost: a\r\n\r\n")));
  for (int k = 0; k < 3; ++k) EXPECT_EQ(client.ReadReply().code, 400);
  EXPECT_EQ(client.ReadReply().body, "ok\n");
}

TEST_F(BodiesTest, WhoAsksBeforeSendingIsToldToGoOn) {
  HttpClient client(port_->port());
  const std::string head = absl::StrCat("POST /v1/families HTTP/1.1\r\nHost: localhost\r\n",
                                        "Expect: 100-continue\r\nContent-Length: 2\r\n");
  client.Send(absl::StrCat(head, kJson, "\r\n"));
  EXPECT_EQ(client.ReadReply().code, 100);
  client.Send("{}");
  EXPECT_EQ(client.ReadReply().code, 400);
  client.Send(absl::StrCat(head, "Content-Type: text/plain\r\n\r\n"));
  EXPECT_EQ(client.ReadReply().code, 415) << "and nobody has to send for nothing";
}

TEST_F(BodiesTest, ALargeBodyIsRefusedBeforeItIsRead) {
  PortOptions options;
  options.router.max_body_bytes = 1000;
  Start(options);
  HttpClient client(port_->port());
  client.Send(absl::StrCat("POST /v1/families HTTP/1.1\r\nHost: localhost\r\n", kJson,
                           "Content-Length: 99999999999\r\n\r\n"));
  EXPECT_EQ(client.ReadReply().code, 413);
  EXPECT_TRUE(client.IsClosed());
  HttpClient chunks(port_->port());
  chunks.Send(absl::StrCat("POST /v1/families HTTP/1.1\r\nHost: localhost\r\n", kJson,
                           "Transfer-Encoding: chunked\r\n\r\n",
                           Chunked(std::string(2000, ' '), 100)));
  EXPECT_EQ(chunks.ReadReply().code, 413);
  EXPECT_TRUE(chunks.IsClosed());
}

// A byte now and then does not help.
TEST_F(BodiesTest, SlowBodiesAreDisconnected) {
  PortOptions options;
  options.idle_timeout = absl::Milliseconds(200);
  Start(options);
  HttpClient slow(port_->port());
  ASSERT_TRUE(slow.Send(absl::StrCat("POST /v1/families HTTP/1.1\r\nHost: localhost\r\n", kJson,
                                     "Content-Length: 1000000\r\n\r\n")));
  const absl::Time begin = absl::Now();
  while (slow.Send(" ") && absl::Now() - begin < absl::Seconds(20)) {
    absl::SleepFor(absl::Milliseconds(10));
  }
  EXPECT_LT(absl::Now() - begin, absl::Seconds(10));
}

TEST_F(BodiesTest, ABodyThatBreaksOffLeavesNothing) {
  {
    HttpClient client(port_->port());
    client.Send(absl::StrCat("POST /v1/families HTTP/1.1\r\nHost: localhost\r\n", kJson,
                             "Content-Length: ", sizeof(kRegistration) + 1, "\r\n\r\n",
                             kRegistration));
  }
  HttpClient chunks(port_->port());
  chunks.Send(absl::StrCat("POST /v1/families HTTP/1.1\r\nHost: localhost\r\n", kJson,
                           "Transfer-Encoding: chunked\r\n\r\nnot a size\r\n"));
  EXPECT_TRUE(chunks.IsClosed());
  port_->Stop(absl::Seconds(10));
  EXPECT_EQ(catalog_->GetFamily("new").status().code(), absl::StatusCode::kNotFound);
}

}  // namespace
}  // namespace liquidblend::http::bodies_test
