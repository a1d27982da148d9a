#include "server/http/answers/page.h"

#include <gmock/gmock.h>

#include <fstream>
#include <map>
#include <string>
#include <thread>
#include <vector>

#include "server/access/token_file.h"
#include "tests/server/http/port_testing.h"

namespace liquidblend::http {

PageFiles FakePage();  // the files of dist/

namespace page_test {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::StartsWith;

std::map<std::string, std::string> HeadersOf(const Response& response) {
  return {response.headers.begin(), response.headers.end()};
}

TEST(PackPage, TakesTheIndexAndWhatIsBelow) {
  std::vector<std::string> paths, types;
  for (const PageFile& file : FakePage()) {
    paths.emplace_back(file.path);
    types.emplace_back(file.type);
  }
  EXPECT_THAT(paths, ElementsAre("/", "/page/decoder-3c4d.wasm", "/page/main-1a2b.js"));
  EXPECT_THAT(types, ElementsAre("text/html; charset=utf-8", "application/wasm",
                                 "text/javascript; charset=utf-8"));
  const auto time_of = [](const PageFile& file) { return file.gzip.substr(4, 4); };
  EXPECT_EQ(time_of(FakePage()[0]), std::string(4, '\0')) << "the program repeats";
}

TEST(Page, FilesComeWithTheirTypeAndTheirLife) {
  const Page page(FakePage());
  Request request;
  const Response index = page.Reply("/", request);
  EXPECT_EQ(index.code, 200);
  EXPECT_THAT(index.body, StartsWith("<!doctype html>"));
  auto headers = HeadersOf(index);
  EXPECT_EQ(headers["Cache-Control"], "no-cache");
  EXPECT_THAT(headers["Content-Security-Policy"],
              HasSubstr("script-src 'self' 'wasm-unsafe-eval';"));
  EXPECT_EQ(headers["Referrer-Policy"], "no-referrer");
  EXPECT_FALSE(headers.contains("Content-Encoding"));
  request.accept_encoding = "br, gzip;q=0.8";
  const Response script = page.Reply("/page/main-1a2b.js", request);
  headers = HeadersOf(script);
  EXPECT_EQ(headers["Content-Encoding"], "gzip");
  EXPECT_EQ(script.body, FakePage()[2].gzip);
  EXPECT_EQ(headers["Cache-Control"], "public, immutable, max-age=31536000");
  request.if_none_match = headers["ETag"];
  EXPECT_EQ(page.Reply("/page/main-1a2b.js", request).code, 304);
  EXPECT_EQ(page.Reply("/", request).code, 200);
}

// Whoever asks for it needs no token.
TEST(Page, AFileIsUnpackedOnce) {
  std::string gzip(FakePage()[0].gzip);
  const PageFile file = {"/", "text/html", gzip, "\"tag\""};
  const Page page(PageFiles(&file, 1));
  std::vector<std::string> bodies(8);
  {
    std::vector<std::jthread> clients;
    for (std::string& body : bodies) {
      clients.emplace_back([&] { body = page.Reply("/", {}).body; });
    }
  }
  gzip.assign(gzip.size(), '\1');
  bodies.push_back(page.Reply("/", {}).body);
  for (const std::string& body : bodies) EXPECT_EQ(body, bodies[0]);
  EXPECT_THAT(bodies[0], StartsWith("<!doctype html>"));
}

TEST(Page, HeadUnpacksNothing) {
  const size_t size = Page(FakePage()).Reply("/", {}).body.size();
  std::string gzip(FakePage()[0].gzip);
  const size_t num_spoilt = gzip.size() - 4;  // the size is behind them
  gzip.replace(0, num_spoilt, num_spoilt, 'x');
  const PageFile file = {"/", "text/html", gzip, "\"tag\""};
  const Page page(PageFiles(&file, 1));
  Request request;
  request.method = "HEAD";
  Response head = page.Reply("/", request);
  EXPECT_EQ(head.left_out_bytes, size);
  EXPECT_EQ(head.body, "");
  request.accept_encoding = "gzip";
  head = page.Reply("/", request);
  EXPECT_EQ(head.left_out_bytes, gzip.size());
  EXPECT_EQ(head.body, "");
}

TEST(Page, WhatIsNotThereIsNotFound) {
  const Page page(FakePage());
  EXPECT_EQ(page.Reply("/page/none.js", {}).code, 404);
  const Response left_out = Page({}).Reply("/", {});
  EXPECT_EQ(left_out.code, 404);
  EXPECT_THAT(left_out.body, HasSubstr("was left out of this program"));
}

class PageTest : public PortTest {
 protected:
  void SetUp() override {
    PortOptions options;
    options.router.page = FakePage();
    Start(options);
  }
};

TEST_F(PageTest, IsServedAtTheRoot) {
  HttpClient client(port_->port());
  EXPECT_THAT(client.Get("/").body, HasSubstr("<title>liquidblend</title>"));
  EXPECT_THAT(client.Get("/?family=splash&family=%ff").body, HasSubstr("<title>"))
      << "its state is there";
  for (const char* encoding : {"", "Accept-Encoding: gzip\r\n"}) {
    const HttpReply get = client.Get("/", encoding);
    HttpReply head = client.Request("HEAD", "/", encoding);
    EXPECT_EQ(head.code, 200);
    EXPECT_EQ(head.headers["content-length"], absl::StrCat(get.body.size())) << encoding;
  }
  EXPECT_EQ(client.Get("/page/decoder-3c4d.wasm").body.size(), 8U);
  for (const char* target : {"/page/", "/page/../index.html", "/index.html", "/page", "//"}) {
    EXPECT_EQ(client.Get(target).code, 404) << target;
  }
  EXPECT_EQ(client.Request("POST", "/", "Content-Length: 0\r\n").code, 405);
}

// It has nothing that others may not know, and a token is typed into it.
TEST_F(PageTest, NeedsNoTokenButAKnownHost) {
  const store::TemporaryFolder folder;
  const std::string path = folder.path() + "/tokens.json";
  std::ofstream(path) << R"({"principals": [)" << server::MakeToken("a", {"frames"})->entry << "]}";
  const auto authorizer = *server::Authorizer::Open(path);
  server::AccessController guarded(*authorizer);
  const auto api = server::MakeApi(backends_, guarded, import_roots_);
  PortOptions options;
  options.listen = "127.0.0.1:0";
  options.router.page = FakePage();
  const auto port = *Port::Start(*api, options);
  HttpClient client(port->port());
  EXPECT_EQ(client.Get("/").code, 200);
  EXPECT_EQ(client.Get("/page/main-1a2b.js").code, 200);
  EXPECT_EQ(client.Get("/v1/families").code, 401);
  HttpClient rebound(port->port());
  rebound.Send("GET / HTTP/1.1\r\nHost: evil.example\r\n\r\n");
  EXPECT_EQ(rebound.ReadReply().code, 403);
}

}  // namespace
}  // namespace page_test
}  // namespace liquidblend::http
