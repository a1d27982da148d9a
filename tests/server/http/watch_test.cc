// WatchOperation over HTTP: lines of JSON.
#include <nlohmann/json.hpp>
#include <thread>

#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "tests/server/http/port_testing.h"

namespace liquidblend::http::watch_test {
namespace {

using nlohmann::json;
using testing::HasSubstr;

class WatchTest : public PortTest {
 protected:
  // A watch of this operation whose header has been read.
  HttpReply Watch(HttpClient& client, const std::string& id) {
    return client.Get(absl::StrCat("/v1/operations/", id, ":watch"));
  }
  int NumWatched() const { return backends_.operation_looks.num_looks(); }
};

TEST_F(WatchTest, EachChangeIsALineAndTheLastOneIsDone) {
  const store::pb::JobRecord job = SubmitImport("drop");
  HttpClient client(port_->port());
  HttpReply reply = Watch(client, job.id());
  EXPECT_EQ(reply.code, 200);
  EXPECT_EQ(reply.headers["content-type"], "application/x-ndjson");
  EXPECT_EQ(reply.headers["transfer-encoding"], "chunked");
  const std::string first = client.ReadChunk();
  EXPECT_EQ(first.find('\n'), first.size() - 1);
  EXPECT_EQ(json::parse(first)["metadata"]["progress"]["stage"], "queued");
  const store::Lease lease = TakeJob();
  EXPECT_FALSE(json::parse(client.ReadChunk()).contains("done"));
  ASSERT_TRUE(catalog_->FailJob(lease.lease_id, absl::DataLossError("torn"), false).ok());
  const json last = json::parse(client.ReadChunk());
  EXPECT_EQ(last["done"], true);
  EXPECT_EQ(last["error"]["message"], "torn");
  EXPECT_EQ(client.ReadChunk(), "");
  EXPECT_EQ(client.Get("/healthz").body, "ok\n") << "the connection goes on";
}

TEST_F(WatchTest, WhatIsNotThereIsNotFound) {
  HttpClient client(port_->port());
  const HttpReply reply = Watch(client, "none");
  EXPECT_EQ(reply.code, 404);
  EXPECT_THAT(reply.body, HasSubstr(R"("resource": "operations/none")"));
  const store::pb::JobRecord job = SubmitImport("drop");
  EXPECT_EQ(client.Get("/v1/operations/" + job.id() + ":watch?x=1").code, 400);
  EXPECT_EQ(client.Request("HEAD", "/v1/operations/" + job.id() + ":watch").code, 200);
  EXPECT_EQ(client.Get("/healthz").body, "ok\n");
}

TEST_F(WatchTest, AClientThatLeavesIsLookedForNoLonger) {
  const store::pb::JobRecord job = SubmitImport("drop");
  {
    HttpClient client(port_->port());
    EXPECT_EQ(Watch(client, job.id()).code, 200);
    EXPECT_NE(client.ReadChunk(), "");
    EXPECT_EQ(NumWatched(), 1);
  }
  while (NumWatched() > 0) std::this_thread::yield();
}

TEST_F(WatchTest, AServerThatStopsSaysSo) {
  const store::pb::JobRecord job = SubmitImport("drop");
  HttpClient client(port_->port());
  EXPECT_EQ(Watch(client, job.id()).code, 200);
  EXPECT_NE(client.ReadChunk(), "");
  port_->Drain();
  const json line = json::parse(client.ReadChunk());
  EXPECT_EQ(line["error"]["code"], 14);
  EXPECT_EQ(line["error"]["details"][0]["reason"], "SHUTTING_DOWN");
  EXPECT_EQ(client.ReadChunk(), "");
  port_->Stop(absl::Seconds(10));
}

TEST_F(WatchTest, OldClientsGetLinesWithoutChunks) {
  const store::pb::JobRecord job = SubmitImport("drop");
  ASSERT_TRUE(catalog_->RequestCancel(job.id()).ok());
  HttpClient client(port_->port());
  client.Send(absl::StrCat("GET /v1/operations/", job.id(), ":watch HTTP/1.0\r\n\r\n"));
  const HttpReply reply = client.ReadReply();
  EXPECT_EQ(reply.code, 200);
  EXPECT_FALSE(reply.headers.contains("transfer-encoding"));
  EXPECT_THAT(client.ReadRest(), HasSubstr("\"done\":true"));
}

}  // namespace
}  // namespace liquidblend::http::watch_test
