#include "server/http/router.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <map>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <set>
#include <vector>

#include "absl/strings/str_cat.h"
#include "server/base/errors.h"
#include "server/http/exchange/replies.h"

namespace liquidblend::http {
namespace {

using testing::HasSubstr;
using testing::IsEmpty;
using testing::Not;
using testing::StartsWith;

constexpr int64_t kVersion = 3;

// Answers at once, and counts the frames that it makes.
class FakeApi final : public server::Api {
 public:
  absl::Status Admit(const server::Credentials& credentials, const server::AccessRequest& access,
                     server::AccessGrant& grant) override {
    access_requests.push_back(access);
    if (needs_token && credentials.authorization != "Bearer good") {
      return absl::UnauthenticatedError("no token");
    }
    grant.principal.name = needs_token ? "render" : server::kAnonymous;
    grant.principal.key = grant.principal.name;
    return absl::OkStatus();
  }
  Cancel GetFrame(v1::GetFrameRequest request, std::string client, trace::Span,
                  Done<server::MadeFrame> done) override {
    clients.push_back(client);
    last_frame_request = request;
    if (is_slow) {
      return [this, done = std::make_shared<Done<server::MadeFrame>>(std::move(done))] {
        ++num_cancelled;
        (*done)(absl::CancelledError("left"));
      };
    }
    ++num_frames;
    if (!error.ok()) {
      done(error);
      return [] {};
    }
    if (request.version() > published_version) {
      done(absl::NotFoundError("no such version"));
      return [] {};
    }
    server::MadeFrame made;
    v1::Frame& frame = made.frame;
    frame.set_data("DRACO");
    frame.set_version(request.version() == 0 ? served_version : request.version());
    *frame.mutable_weights() = request.weights();
    frame.set_time_s(request.time_s());
    frame.set_num_vertices(8);
    frame.set_num_triangles(12);
    frame.set_clamped(!request.weights().empty() && request.weights(0) < 0);
    frame.mutable_bounds()->mutable_min()->set_x(-1.5);
    frame.mutable_bounds()->mutable_max()->set_z(2);
    made.generation = GenerationOf(frame.version());
    done(std::move(made));
    return [] {};
  }
  absl::Status Post(absl::AnyInvocable<void()> work) override {
    work();
    return absl::OkStatus();
  }
  void FindVersion(const std::string& family, int64_t, Done<server::FamilyVersion> done) override {
    if (family != "families/splash") return done(absl::NotFoundError(family));
    done(server::FamilyVersion{published_version, GenerationOf(published_version)});
  }
  void Call(const server::Method& method, const server::Caller&, Read read,
            server::IsWanted is_wanted, Done<server::MessagePtr> done) override {
    const server::UnaryMethod* unary = server::FindUnaryMethod(method.name);
    last_request = unary != nullptr ? unary->new_request()
                                    : std::make_unique<google::longrunning::WaitOperationRequest>();
    const absl::Status status = read(*last_request);
    if (is_slow)
      return waiting.push_back(
          [is_wanted, done = std::make_shared<Done<server::MessagePtr>>(std::move(done))] {
            EXPECT_FALSE(is_wanted());
            (*done)(absl::CancelledError("left"));
          });
    if (!status.ok()) return done(status);
    if (!error.ok()) return done(error);
    if (method.name == std::string("GetFamily")) return GetFamily(std::move(done));
    if (method.name == std::string("ListFamilies")) return ListFamilies(std::move(done));
    auto operation = std::make_unique<google::longrunning::Operation>();
    operation->set_name("operations/1");
    done(std::move(operation));
  }
  void GetFamily(Done<server::MessagePtr> done) {
    const auto& request = static_cast<const v1::GetFamilyRequest&>(*last_request);
    if (request.name() != "families/splash") return done(absl::NotFoundError(request.name()));
    auto family = std::make_unique<v1::Family>();
    family->set_name(request.name());
    family->set_version(published_version);
    family->set_duration_s(2.5);
    done(std::move(family));
  }
  void ListFamilies(Done<server::MessagePtr> done) {
    const auto& request = static_cast<const v1::ListFamiliesRequest&>(*last_request);
    auto response = std::make_unique<v1::ListFamiliesResponse>();
    response->add_families()->set_name("families/splash");
    response->set_next_page_token("after " + request.page_token());
    done(std::move(response));
  }
  NextOperation WatchOperation(const std::string&, server::IsWanted) override {
    return [](Done<server::SeenOperationPtr> done) { done(absl::NotFoundError("no operation")); };
  }
  std::shared_ptr<server::ArchiveUpload> OpenUpload(v1::UploadAnimationRequest,
                                                    const server::Caller&) override {
    return nullptr;
  }
  std::shared_ptr<server::StreamSession> OpenStream(
      std::string, std::weak_ptr<server::StreamSession::Sink>, trace::Span) override {
    return nullptr;
  }
  void CheckIsReady(Done<std::string> done) override {
    if (!error.ok()) return done(error);
    done(std::string("ok"));
  }
  void GetMetricsText(Done<std::string> done) override { done(metrics_.Text({})); }
  metrics::Metrics& metrics() override { return metrics_; }
  server::CallLog& call_log() override { return call_log_; }
  const trace::Tracer& tracer() override { return tracer_; }

  std::string GenerationOf(int64_t version) const {
    return absl::StrCat("splash/", version, "/", content);
  }

  absl::Status error;
  std::string content = "first";
  int num_frames = 0;
  int64_t published_version = kVersion;
  int64_t served_version = kVersion;  // without a version: older while a new one is being loaded
  bool needs_token = false;
  bool is_slow = false;  // frames are never made
  int num_cancelled = 0;
  std::vector<server::AccessRequest> access_requests;
  server::MessagePtr last_request;
  std::vector<std::function<void()>> waiting;  // calls of a slow API
  std::vector<std::string> clients;
  v1::GetFrameRequest last_frame_request;

 private:
  metrics::Metrics metrics_;
  server::CallLog call_log_{[](absl::Duration, const std::function<void()>&) {}};
  const trace::Tracer tracer_{};
};

struct Reply {
  int code = 0;
  std::map<std::string, std::string> headers;
  std::string body;
};

// A request with a body.
struct Posted {
  Request request;
  std::string body;
};

Posted Post(const std::string& target, const std::string& body) {
  Posted posted;
  posted.request.method = "POST";
  posted.request.target = target;
  posted.request.content_type = "application/json";
  posted.request.has_body = true;
  posted.body = body;
  return posted;
}

constexpr char kFrame[] = "/v1/families/splash/frame.drc?weights=0.5&time=1.25";
constexpr char kFixedFrame[] = "/v1/families/splash/frame.drc?weights=0.5&time=1.25&version=3";

class RouterTest : public testing::Test {
 protected:
  Reply Send(const Request& request) {
    Router router(api_, options_);
    return Send(router, request);
  }

  static Reply Send(Router& router, const Request& request) { return Send(router, {request, ""}); }

  // The body goes in two pieces, as long as it is wanted.
  Reply Send(const Posted& posted) {
    Router router(api_, options_);
    return Send(router, posted);
  }
  static Reply Send(Router& router, const Posted& posted) {
    int num_answers = 0;
    Reply reply;
    const auto exchange = router.Answer(posted.request, [&](Response response) {
      ++num_answers;
      reply = {response.code, {response.headers.begin(), response.headers.end()}, response.body};
    });
    if (exchange->body != nullptr) {
      const size_t half = posted.body.size() / 2;
      bool is_wanted = false;
      exchange->body->Take(posted.body.substr(0, half), false, [&] { is_wanted = true; });
      if (is_wanted) exchange->body->Take(posted.body.substr(half), true, [] { FAIL(); });
    }
    EXPECT_EQ(num_answers, 1);
    return reply;
  }

  Reply Get(const std::string& target, const std::string& if_none_match = "") {
    Request request;
    request.method = "GET";
    request.target = target;
    request.if_none_match = if_none_match;
    return Send(request);
  }

  // With a token.
  static Request Frame() {
    Request request;
    request.method = "GET";
    request.target = kFrame;
    request.authorization = "Bearer good";
    return request;
  }

  FakeApi api_;
  RouterOptions options_;
};

TEST_F(RouterTest, AFrameComesWithWhatItIs) {
  Reply reply = Get(kFrame);
  EXPECT_EQ(reply.code, 200);
  EXPECT_EQ(reply.body, "DRACO");
  EXPECT_EQ(reply.headers["Content-Type"], "model/vnd.draco");
  EXPECT_EQ(reply.headers["X-Liquidblend-Version"], "3");
  EXPECT_EQ(reply.headers["X-Liquidblend-Weights"], "0.5");
  EXPECT_EQ(reply.headers["X-Liquidblend-Time"], "1.25");
  EXPECT_EQ(reply.headers["X-Liquidblend-Vertices"], "8");
  EXPECT_EQ(reply.headers["X-Liquidblend-Triangles"], "12");
  EXPECT_EQ(reply.headers["X-Liquidblend-Bounds"], "-1.5,0,0,0,0,2");
  EXPECT_FALSE(reply.headers.contains("X-Liquidblend-Clamped"));
}

TEST_F(RouterTest, AFrameOfClampedWeightsSaysSo) {
  std::string target = kFrame;
  target.replace(target.find("weights=0.5"), 11, "weights=-0.5");
  Reply reply = Get(target);
  EXPECT_EQ(reply.code, 200);
  EXPECT_EQ(reply.headers["X-Liquidblend-Clamped"], "true");
}

TEST_F(RouterTest, TheExtensionIsTheFormat) {
  struct Case {
    const char* name;
    v1::Encoding::Format format;
    const char* type;
  };
  std::set<std::string> tags;
  for (const Case& c : {Case{"drc", v1::Encoding::FORMAT_UNSPECIFIED, "model/vnd.draco"},
                        Case{"ply", v1::Encoding::PLY, "application/octet-stream"},
                        Case{"obj", v1::Encoding::OBJ, "model/obj"}}) {
    Reply reply = Get(absl::StrCat("/v1/families/splash/frame.", c.name, "?weights=0.5"));
    EXPECT_EQ(reply.code, 200) << c.name;
    EXPECT_EQ(api_.last_frame_request.encoding().format(), c.format) << c.name;
    EXPECT_EQ(reply.headers["Content-Type"], c.type);
    tags.insert(reply.headers["ETag"]);
  }
  EXPECT_EQ(tags.size(), 3u);
  EXPECT_EQ(Get("/v1/families/splash/frame.stl?weights=0.5").code, 404);
}

TEST_F(RouterTest, AFixedVersionMayBeKeptForever) {
  EXPECT_EQ(Get(kFixedFrame).headers["Cache-Control"], "public, immutable, max-age=31536000");
  EXPECT_EQ(Get(kFrame).headers["Cache-Control"], "public, no-cache");
  api_.needs_token = true;
  Request request = Frame();
  request.target = kFixedFrame;
  EXPECT_EQ(Send(request).headers["Cache-Control"], "private, immutable, max-age=31536000");
}

TEST_F(RouterTest, WhatTheClientHasIsNotMadeAgain) {
  const std::string tag = Get(kFixedFrame).headers["ETag"];
  EXPECT_THAT(tag, StartsWith("\"3-"));
  EXPECT_EQ(Get(kFrame).headers["ETag"], tag);  // the same bytes
  EXPECT_EQ(api_.num_frames, 2);
  for (const char* target : {kFixedFrame, kFrame}) {
    for (const std::string& tags : {tag, "\"x\", " + tag, "W/" + tag, std::string("*")}) {
      Reply reply = Get(target, tags);
      EXPECT_EQ(reply.code, 304) << tags;
      EXPECT_EQ(reply.headers["ETag"], tag);
      EXPECT_THAT(reply.body, IsEmpty());
    }
  }
  EXPECT_EQ(api_.num_frames, 2);
  EXPECT_EQ(Get(kFixedFrame, "\"3-0\"").code, 200);
  EXPECT_EQ(Get(kFrame, "\"3-0\"").code, 200);
  EXPECT_EQ(api_.num_frames, 4);
}

TEST_F(RouterTest, WhileAVersionIsLoadedNobodyGetsAnOlderOneThanTheyHave) {
  api_.published_version = 4;  // served: 3
  const std::string third = Get(absl::StrCat(kFrame, "&version=3")).headers["ETag"];
  const std::string fourth = Get(absl::StrCat(kFrame, "&version=4")).headers["ETag"];
  EXPECT_EQ(Get(kFrame).headers["X-Liquidblend-Version"], "3");
  EXPECT_EQ(Get(kFrame, third).code, 304) << "as for those who have nothing";
  EXPECT_EQ(Get(kFrame, fourth).code, 304);
  EXPECT_EQ(Get(kFrame, third + ", " + fourth).code, 304);
  EXPECT_EQ(Get(kFrame, "\"2-00\"").headers["X-Liquidblend-Version"], "3");
  // The fourth version from a server of another build, whose tags differ.
  const Reply newest = Get(kFrame, "\"4-00\"");
  EXPECT_EQ(newest.code, 200);
  EXPECT_EQ(newest.headers.at("X-Liquidblend-Version"), "4");
  EXPECT_EQ(newest.headers.at("ETag"), fourth);
  EXPECT_EQ(Get(kFrame, "\"9999-00\"").headers["X-Liquidblend-Version"], "4");
}

TEST_F(RouterTest, TagsTellRequestsAndVersionsApart) {
  v1::GetFrameRequest request;
  request.set_family("families/splash");
  request.add_weights(0.5);
  const std::string tag = FrameTag(request, 1, "a");
  EXPECT_NE(FrameTag(request, 2, "a"), tag);
  EXPECT_NE(FrameTag(request, 1, "b"), tag);
  EXPECT_EQ(FrameTag(request, 1, "a", base::Version()), tag);
  EXPECT_NE(FrameTag(request, 1, "a", "0.2.0 (commit another)"), tag) << "it may make other bytes";
  request.set_time_s(0.1);
  EXPECT_NE(FrameTag(request, 1, "a"), tag);
}

// As after a backup was restored: the number comes again, but not the frames.
TEST_F(RouterTest, AVersionWithOtherContentIsAnother) {
  for (const char* target : {kFrame, kFixedFrame}) {
    api_.content = "first";
    const std::string tag = Get(target).headers["ETag"];
    EXPECT_EQ(Get(target, tag).code, 304) << target;
    api_.content = "restored";
    const Reply other = Get(target, tag);
    EXPECT_EQ(other.code, 200) << target;
    EXPECT_NE(other.headers.at("ETag"), tag);
    EXPECT_EQ(Get(target, other.headers.at("ETag")).code, 304) << target;
  }
}

TEST_F(RouterTest, AVersionThatDoesNotExistIsNotUnchanged) {
  const std::string target = absl::StrCat(kFrame, "&version=9");
  EXPECT_EQ(Get(target, "*").code, 404);
}

TEST_F(RouterTest, FamiliesAreJson) {
  const Reply one = Get("/v1/families/splash");
  EXPECT_EQ(one.code, 200);
  EXPECT_EQ(one.headers.at("Content-Type"), "application/json");
  const nlohmann::json family = nlohmann::json::parse(one.body);
  EXPECT_EQ(family["name"], "families/splash");
  EXPECT_EQ(family["durationS"], 2.5);
  const nlohmann::json all = nlohmann::json::parse(Get("/v1/families?page_token=x").body);
  EXPECT_EQ(all["families"][0]["name"], "families/splash");
  EXPECT_EQ(all["nextPageToken"], "after x");
}

TEST_F(RouterTest, ErrorsAreJsonStatusesWithTheirCode) {
  const Reply reply = Get("/v1/families/none");
  EXPECT_EQ(reply.code, 404);
  const nlohmann::json error = nlohmann::json::parse(reply.body);
  EXPECT_EQ(error["code"], 5);
  EXPECT_EQ(error["message"], "families/none");
  EXPECT_EQ(error["details"][0]["@type"], "type.googleapis.com/google.rpc.ErrorInfo");
  EXPECT_EQ(error["details"][0]["reason"], "NOT_FOUND");

  api_.error = server::InvalidField("weights", "must be 1");
  const Reply bad = Get(kFrame);
  EXPECT_EQ(bad.code, 400);
  EXPECT_EQ(nlohmann::json::parse(bad.body)["details"][0]["fieldViolations"][0]["field"],
            "weights");
  api_.error = absl::ResourceExhaustedError("too busy");
  EXPECT_EQ(Get(kFrame).code, 429);
  EXPECT_EQ(Get(kFrame).headers["Retry-After"], "1");
  api_.error = server::WithRetryDelay(api_.error, absl::Milliseconds(2500));
  EXPECT_EQ(Get(kFrame).headers["Retry-After"], "3");
  api_.error = absl::InternalError("odd");
  EXPECT_EQ(Get(kFrame).code, 500);
  EXPECT_EQ(Get("/v1/families/splash/frame.drc?time=x").code, 400);
  EXPECT_EQ(Get("/v1/families/splash/frame.drc?time=%").code, 400);
  EXPECT_EQ(Get("/v1/families?size=3").code, 400);
}

TEST_F(RouterTest, UnknownPathsAndMethodsAreNamed) {
  for (const char* target :
       {"/v1", "/v1/families/", "/v1/families/a/b", "", "*", "http://localhost",
        "/v1/families/a/frame.drc/b", "/metrics/", "/v1/families/a:nothing"}) {
    const Reply reply = Get(target);
    EXPECT_EQ(reply.code, 404) << target;
  }
  EXPECT_THAT(Get("/nowhere").body, HasSubstr("/nowhere"));
  EXPECT_THAT(Get("/\xff\xfe").body, HasSubstr("/\\\\xff"));  // not as it is: that is no UTF-8
  for (const char* method : {"POST", "PUT", "DELETE", "TRACE", "BREW"}) {
    Request request;
    request.method = method;
    request.target = kFrame;
    Reply reply = Send(request);
    EXPECT_EQ(reply.code, 405) << method;
    EXPECT_EQ(reply.headers["Allow"], "GET, HEAD, OPTIONS");
    EXPECT_THAT(reply.body, HasSubstr(method));
  }
  EXPECT_EQ(api_.num_frames, 0);
}

TEST_F(RouterTest, BodiesAreTakenWhereAMethodHasOne) {
  Request request;
  request.method = "GET";
  request.target = kFrame;
  request.has_body = true;
  EXPECT_EQ(Send(request).code, 413);
  request.target = "/v1/families/splash";
  request.method = "DELETE";
  EXPECT_EQ(Send(request).code, 413);
  EXPECT_EQ(Send(Post("/v1/families", R"({"familyId": "f"})")).code, 200);
  EXPECT_EQ(server::ResourceOf(*api_.last_request), "families/f");
}

TEST_F(RouterTest, BodyQueryAndPathMakeTheRequest) {
  EXPECT_EQ(Send(Post("/v1/families/splash:rollback", R"({"version": 2})")).code, 200);
  EXPECT_EQ(api_.last_request->ShortDebugString(), R"(name: "families/splash" version: 2)");
  EXPECT_EQ(Send(Post("/v1/operations/7:wait", R"({"timeout": "5s"})")).code, 200);
  EXPECT_EQ(api_.last_request->ShortDebugString(),
            R"(name: "operations/7" timeout { seconds: 5 })");
  EXPECT_EQ(Send(Post("/v1/operations/7:cancel", "")).code, 200) << "nothing is an empty message";
  EXPECT_EQ(Get("/v1/operations?pageSize=3&page_token=x").code, 200);
  EXPECT_EQ(api_.last_request->ShortDebugString(),
            R"(page_size: 3 page_token: "x" name: "operations")");
}

TEST_F(RouterTest, MistakesOfBodyAndQueryAreNamed) {
  const auto message = [](const Reply& reply) {
    return std::string(nlohmann::json::parse(reply.body)["message"]);
  };
  const Reply body = Send(Post("/v1/families", R"({"options": {"seed": "x"}})"));
  EXPECT_EQ(body.code, 400);
  EXPECT_THAT(message(body), HasSubstr("options.seed: "));
  EXPECT_THAT(message(Send(Post("/v1/families?familyId=f", "{}"))),
              HasSubstr("familyId: belongs into the body"));
  EXPECT_THAT(message(Get("/v1/families/splash?name=f")),
              HasSubstr("name: is in the path already"));
  EXPECT_THAT(message(Get("/v1/families/splash?x=1&version=y")), HasSubstr("version: must be"));
  EXPECT_EQ(Send(Post("/v1/families", "{")).code, 400);
}

TEST_F(RouterTest, ABodyIsOfJsonAndNotTooLarge) {
  Posted odd = Post("/v1/families", "{}");
  for (const char* type :
       {"", "text/plain", "application/x-www-form-urlencoded", "application/jsonx"}) {
    odd.request.content_type = type;
    EXPECT_EQ(Send(odd).code, 415) << type;
  }
  odd.request.content_type = "Application/JSON; charset=utf-8";
  EXPECT_EQ(Send(odd).code, 200);
  options_.max_body_bytes = 100;
  const Posted large = Post("/v1/families", std::string(101, ' '));
  const Reply refused = Send(large);
  EXPECT_EQ(refused.code, 413);
  EXPECT_THAT(refused.body, HasSubstr("REQUEST_TOO_LARGE"));
  Posted announced = large;
  announced.request.body_bytes = 101;
  EXPECT_EQ(Send(announced).code, 413);
  options_.max_bodies_bytes = 10;
  const Reply full = Send(Post("/v1/families", std::string(11, ' ')));
  EXPECT_EQ(full.code, 503);
  EXPECT_EQ(full.headers.at("Retry-After"), "1");
  EXPECT_EQ(Send(Post("/v1/families", "{}")).code, 200) << "what was refused is given back";
}

// A page of any site may send simple requests here, whatever it can read of the answer.
TEST_F(RouterTest, PagesOfOtherSitesChangeNothing) {
  for (const char* method : {"POST", "DELETE"}) {
    Posted posted =
        Post(method == std::string("POST") ? "/v1/families" : "/v1/families/splash", "");
    posted.request.method = method;
    posted.request.has_body = false;
    posted.request.host = "localhost:8080";
    const auto code_for = [&](const std::string& origin) {
      posted.request.origin = origin;
      return Send(posted).code;
    };
    EXPECT_EQ(code_for(""), 200) << method;
    EXPECT_EQ(code_for("http://localhost:8080"), 200);
    EXPECT_EQ(code_for("http://localhost:8081"), 403);
    EXPECT_EQ(code_for("https://evil.example"), 403);
    EXPECT_EQ(code_for("null"), 403);
    EXPECT_THAT(Send(posted).body, HasSubstr("ORIGIN_NOT_ALLOWED"));
    options_.allowed_origin = "https://app.example";
    EXPECT_EQ(code_for("https://app.example"), 200);
    options_.allowed_origin = "";
  }
}

TEST_F(RouterTest, MethodsHaveTheirScopes) {
  const auto scope_of = [this](const Posted& posted) {
    Send(posted);
    return api_.access_requests.back();
  };
  EXPECT_EQ(scope_of(Post("/v1/families", "{}")).scope, server::Scope::kRegister);
  EXPECT_EQ(scope_of(Post("/v1/animations:presignUpload", "{}")).scope, server::Scope::kWrite);
  EXPECT_FALSE(scope_of(Post("/v1/families", "{}")).lasts);
  EXPECT_TRUE(scope_of(Post("/v1/operations/7:wait", "{}")).lasts);
  api_.needs_token = true;
  EXPECT_EQ(Send(Post("/v1/families", "no JSON, and nobody reads it")).code, 401);
}

TEST_F(RouterTest, ChangesAreLoggedWithWhatTheyAreAbout) {
  base::StartLog("server", base::LogLevel::kInfo, base::LogFormat::kJson);
  testing::internal::CaptureStderr();
  Send(Post("/v1/families", R"({"familyId": "f"})"));
  Get("/v1/families/splash");
  api_.error = absl::NotFoundError("no such family");
  const Reply missing = Send(Post("/v1/families/f:rollback", "{}"));
  const std::string log = testing::internal::GetCapturedStderr();
  EXPECT_THAT(log, HasSubstr(R"("method":"POST","path":"/v1/families","status":"200")"));
  EXPECT_THAT(log, HasSubstr(R"("resource":"families/f"})"));
  EXPECT_THAT(log, Not(HasSubstr("splash"))) << "reads are for --verbose";
  EXPECT_THAT(missing.body, HasSubstr(R"("resource": "families/f")"));
}

TEST_F(RouterTest, AMethodThatNobodyWaitsForIsTold) {
  api_.is_slow = true;
  Router router(api_, options_);
  int code = 0;
  Request request;
  request.method = "GET";
  request.target = "/v1/families";
  const auto exchange =
      router.Answer(request, [&](const Response& response) { code = response.code; });
  exchange->Cancel();
  ASSERT_EQ(api_.waiting.size(), 1U);
  api_.waiting[0]();
  EXPECT_EQ(code, 499);
}

TEST_F(RouterTest, AbsoluteTargetsAreTheSame) {
  EXPECT_EQ(Get("http://example.org/healthz").body, "ok\n");
  EXPECT_EQ(Get("https://localhost:8443/v1/families/splash").code, 200);
}

// A page whose name resolves to this machine (DNS rebinding) still sends its own name.
TEST_F(RouterTest, OnlyKnownHostsAreAnswered) {
  options_.hosts = {"frames.example.org"};
  const auto code_of = [this](const std::string& host, const std::string& target) {
    Request request;
    request.method = "GET";
    request.target = target;
    request.host = host;
    return Send(request).code;
  };
  const std::vector<std::string> targets = {"/v1/families", "/v1/families/splash", kFrame,
                                            "/metrics"};
  for (const std::string& target : targets) {
    EXPECT_EQ(code_of("evil.example:8080", target), 403) << target;
    EXPECT_EQ(code_of("localhost:8080", target), 200) << target;
    EXPECT_EQ(code_of("frames.example.org", target), 200) << target;
    EXPECT_EQ(code_of("localhost", absl::StrCat("http://evil.example", target)), 403) << target;
  }
  EXPECT_EQ(code_of("evil.example", "/nowhere"), 403);
  EXPECT_EQ(code_of("evil.example", "/healthz"), 200);
  EXPECT_EQ(code_of("evil.example", "/readyz"), 200);
  Request request;
  request.method = "OPTIONS";
  request.target = kFrame;
  request.host = "evil.example";
  EXPECT_EQ(Send(request).code, 403);
  const nlohmann::json error = nlohmann::json::parse(Send(request).body);
  EXPECT_THAT(std::string(error["message"]), HasSubstr("--http-host"));
  EXPECT_EQ(error["details"][0]["reason"], "HOST_NOT_ALLOWED");
}

TEST_F(RouterTest, OnlyKnownHostsMayOpenStreams) {
  Request request;
  request.method = "GET";
  request.target = "/v1/stream";
  request.host = "evil.example";
  request.origin = "http://evil.example";
  StreamVisit visit = {CallerOf(request), {}, {}};
  EXPECT_TRUE(absl::IsPermissionDenied(Router(api_, options_).AdmitStream(request, visit)));
  options_.hosts = {"evil.example"};
  EXPECT_TRUE(Router(api_, options_).AdmitStream(request, visit).ok());
}

TEST(Cancellation, TheLastStepCounts) {
  Cancellation cancellation;
  std::vector<int> cancelled;
  cancellation.Arm(2, [&] { cancelled.push_back(2); });
  cancellation.Arm(1, [&] { cancelled.push_back(1); });  // a thread that was slow to return
  cancellation.Cancel();
  EXPECT_THAT(cancelled, testing::ElementsAre(2));
  cancellation.Arm(3, [&] { cancelled.push_back(3); });
  EXPECT_THAT(cancelled, testing::ElementsAre(2, 3));
}

TEST_F(RouterTest, AStreamNeedsAnUpgrade) {
  Reply reply = Get("/v1/stream");
  EXPECT_EQ(reply.code, 426);
  EXPECT_EQ(reply.headers["Upgrade"], "websocket");
}

TEST_F(RouterTest, ReadinessFollowsStoresAndDraining) {
  EXPECT_EQ(Get("/readyz").code, 200);
  api_.error = absl::DataLossError("catalog is gone");
  const Reply reply = Get("/readyz");
  EXPECT_EQ(reply.code, 503);
  EXPECT_THAT(reply.body, HasSubstr("catalog is gone"));
  EXPECT_EQ(Get("/healthz").code, 200);
  api_.error = absl::OkStatus();
  Router router(api_, options_);
  router.SetDraining();
  Request request;
  request.method = "GET";
  request.target = "/readyz";
  EXPECT_EQ(Send(router, request).code, 503);
  request.target = "/healthz";
  EXPECT_EQ(Send(router, request).code, 200);
}

// A proxy in front asks another server then.
TEST_F(RouterTest, OpensNoStreamsWhileItDrains) {
  Router router(api_, options_);
  Request request;
  request.method = "GET";
  request.target = "/v1/stream";
  StreamVisit visit = {CallerOf(request), {}, {}};
  EXPECT_TRUE(router.AdmitStream(request, visit).ok());
  router.SetDraining();
  EXPECT_TRUE(absl::IsUnavailable(router.AdmitStream(request, visit)));
}

TEST_F(RouterTest, RequestsAreCountedByPattern) {
  Get(kFrame);
  Get("/v1/families/none");
  Get("/wp-admin.php");
  Reply reply = Get("/metrics");
  EXPECT_THAT(reply.headers["Content-Type"], StartsWith("text/plain; version=0.0.4"));
  EXPECT_THAT(reply.body, HasSubstr("code=\"200\",method=\"GET /v1/families/{family}/frame.drc\""));
  EXPECT_THAT(reply.body, HasSubstr("code=\"404\",method=\"GET /v1/families/{family}\""));
  EXPECT_THAT(reply.body, HasSubstr("code=\"404\",method=\"GET other\""));
  EXPECT_THAT(reply.body, Not(HasSubstr("wp-admin")));
}

TEST_F(RouterTest, AnswersCarryTheIdOfTheirRequest) {
  Request request = Frame();
  request.request_id = "shot-17";
  EXPECT_EQ(Send(request).headers["X-Request-Id"], "shot-17");
  request.request_id = "two words";
  EXPECT_THAT(Send(request).headers["X-Request-Id"], testing::MatchesRegex("[0-9a-f]{16}"));
  request.target = "/nowhere";
  request.request_id = "lost";
  EXPECT_EQ(Send(request).headers["X-Request-Id"], "lost");
}

TEST_F(RouterTest, TheLogTellsOfEachAnswer) {
  base::StartLog("server", base::LogLevel::kDebug, base::LogFormat::kJson);
  testing::internal::CaptureStderr();
  Request request = Frame();
  request.peer = "127.0.0.1:5";
  request.request_id = "r1";
  api_.needs_token = true;
  Send(request);
  request.authorization = "Bearer guess";
  Send(request);
  api_.error = absl::InternalError("broken");
  request.authorization = "Bearer good";
  Send(request);
  const std::string log = testing::internal::GetCapturedStderr();
  const std::string path =
      R"("message":"call","method":"GET","path":"/v1/families/splash/frame.drc","status":)";
  EXPECT_THAT(log, HasSubstr(R"("level":"debug",)" + path + R"("200","ms":)"));
  EXPECT_THAT(log,
              HasSubstr(R"("principal":"render","client":"render","request_id":"r1","resource":)"
                        R"("families/splash"})"));
  EXPECT_THAT(log, HasSubstr(R"("level":"info",)" + path + R"("401","ms":)"));
  EXPECT_THAT(log, HasSubstr(R"("principal":"","client":"127.0.0.1:5","request_id":"r1",)"
                             R"("error":"no token"})"));
  EXPECT_THAT(log, HasSubstr(R"("level":"error",)" + path + R"("500","ms":)"));
  EXPECT_THAT(log, Not(HasSubstr("guess")));
  EXPECT_THAT(log, Not(HasSubstr("weights"))) << "the query is not told";
}

TEST_F(RouterTest, TheLogTellsHowStreamsEnd) {
  base::StartLog("server", base::LogLevel::kDebug, base::LogFormat::kJson);
  testing::internal::CaptureStderr();
  Router router(api_, options_);
  const server::Caller caller = CallerOf(Frame());
  router.NoteStream(caller, 1000, "the animation has ended", absl::Seconds(2));
  router.NoteStream(caller, 4400, "rate: must be in [-1000, 1000]", absl::Seconds(2));
  router.NoteStream(caller, 1006, "", absl::Seconds(2));
  router.NoteStream(caller, kOtherClose, "the server is broken", absl::Seconds(2));
  const std::string log = testing::internal::GetCapturedStderr();
  const std::string path = R"("message":"call","method":"GET","path":"/v1/stream","status":)";
  EXPECT_THAT(log, HasSubstr(R"("level":"debug",)" + path + R"("1000","ms":"2000.0")"));
  EXPECT_THAT(log, HasSubstr(R"("level":"info",)" + path + R"("4400")"));
  EXPECT_THAT(log, HasSubstr(R"("error":"rate: must be in [-1000, 1000]"})"));
  EXPECT_THAT(log, HasSubstr(R"("error":"the connection was lost"})"));
  EXPECT_THAT(log, HasSubstr(R"("level":"info",)" + path + R"("4000")"));
  EXPECT_THAT(log, HasSubstr(R"("error":"closed by the client: 'the server is broken'"})"));
}

TEST_F(RouterTest, AllButProbesAskWhoCalls) {
  api_.needs_token = true;
  Reply reply = Get(kFrame);
  EXPECT_EQ(reply.code, 401);
  EXPECT_EQ(reply.headers["WWW-Authenticate"], "Bearer");
  EXPECT_EQ(Get(kFixedFrame, "*").code, 401);
  EXPECT_EQ(Get("/metrics").code, 401);
  EXPECT_EQ(Get("/v1/families").code, 401);
  EXPECT_EQ(api_.num_frames, 0);
  ASSERT_EQ(api_.access_requests.size(), 4U);
  EXPECT_EQ(api_.access_requests[0].scope, server::Scope::kFrames);
  EXPECT_EQ(api_.access_requests[3].scope, std::nullopt);
  EXPECT_EQ(Get("/healthz").code, 200);
  EXPECT_EQ(Get("/readyz").code, 200);
  EXPECT_EQ(api_.access_requests.size(), 4U);
  Request request = Frame();
  EXPECT_EQ(Send(request).code, 200);
  EXPECT_THAT(api_.clients, testing::ElementsAre("render"));
  request.target = "/v1/stream";
  StreamVisit visit = {CallerOf(request), {}, {}};
  EXPECT_TRUE(Router(api_, options_).AdmitStream(request, visit).ok());
  EXPECT_EQ(visit.caller.principal.name, "render");
  EXPECT_EQ(visit.caller.client, "render");
  EXPECT_TRUE(api_.access_requests.back().lasts);
  EXPECT_EQ(api_.access_requests.back().scope, server::Scope::kFrames);
  request.authorization.clear();
  EXPECT_TRUE(absl::IsUnauthenticated(Router(api_, options_).AdmitStream(request, visit)));
}

TEST_F(RouterTest, AFrameThatNobodyWaitsForIsCancelled) {
  api_.is_slow = true;
  Router router(api_, options_);
  int code = 0;
  const auto exchange =
      router.Answer(Frame(), [&](const Response& response) { code = response.code; });
  EXPECT_EQ(code, 0);
  exchange->Cancel();
  EXPECT_EQ(code, 499);
  exchange->Cancel();
  EXPECT_EQ(api_.num_cancelled, 1);
}

TEST_F(RouterTest, OtherOriginsAreLetInByOption) {
  Reply closed = Get(kFrame);
  EXPECT_FALSE(closed.headers.contains("Access-Control-Allow-Origin"));
  options_.allowed_origin = "https://example.org";
  Reply open = Get(kFrame);
  EXPECT_EQ(open.headers["Access-Control-Allow-Origin"], "https://example.org");
  EXPECT_THAT(open.headers["Access-Control-Expose-Headers"], HasSubstr("X-Liquidblend-Bounds"));
  EXPECT_THAT(open.headers["Access-Control-Expose-Headers"], HasSubstr("X-Liquidblend-Clamped"));
  Request request;
  request.method = "OPTIONS";
  request.target = kFrame;
  Reply preflight = Send(request);
  EXPECT_EQ(preflight.code, 204);
  EXPECT_EQ(preflight.headers["Access-Control-Allow-Methods"], "GET, HEAD, OPTIONS");
  EXPECT_THAT(preflight.headers["Access-Control-Allow-Headers"], HasSubstr("Content-Type"));
  request.target = "/v1/families";
  EXPECT_EQ(Send(request).headers["Allow"], "POST, GET, HEAD, OPTIONS");
  EXPECT_THAT(preflight.headers["Access-Control-Allow-Headers"], HasSubstr("Authorization"));
}

TEST_F(RouterTest, StreamsAreForPagesOfAllowedOrigins) {
  Request request;
  request.method = "GET";
  request.target = "/v1/stream";
  request.host = "localhost:8080";
  const auto may_stream = [&](const std::string& origin) {
    request.origin = origin;
    StreamVisit visit = {CallerOf(request), {}, {}};
    return Router(api_, options_).AdmitStream(request, visit).ok();
  };
  EXPECT_TRUE(may_stream(""));  // no browser
  EXPECT_TRUE(may_stream("http://localhost:8080"));
  EXPECT_FALSE(may_stream("https://evil.example"));
  EXPECT_FALSE(may_stream("null"));
  options_.allowed_origin = "https://app.example";
  EXPECT_TRUE(may_stream("https://app.example"));
  EXPECT_FALSE(may_stream("https://evil.example"));
  options_.allowed_origin = "*";
  EXPECT_TRUE(may_stream("https://evil.example"));
}

// Each code is a series of the metrics for as long as the server runs.
TEST(Replies, ClientsChooseAmongFewCloseCodes) {
  for (const int kept : {1000, 1001, 1005, 1006}) EXPECT_EQ(ClientCloseCode(kept), kept);
  EXPECT_EQ(ClientCloseCode(0), 1006) << "no close frame came";
  for (const int code : {1002, 1007, 1011, 3000, 4000, 4404, 4500, 4599, 65535}) {
    EXPECT_EQ(ClientCloseCode(code), kOtherClose) << code;
  }
}

TEST(Replies, CloseCodesFollowTheStatus) {
  EXPECT_EQ(CloseCode(absl::OkStatus()), 1000);
  EXPECT_EQ(CloseCode(absl::NotFoundError("x")), 4404);
  EXPECT_EQ(CloseCode(absl::OutOfRangeError("x")), 4400);
  EXPECT_EQ(CloseReason(absl::NotFoundError("family")), "family");
  std::string text(122, 'a');
  text += "\xc3\xa9";  // two bytes of one character, of which one would fit
  EXPECT_EQ(CloseReason(absl::NotFoundError(text)), std::string(122, 'a'));
  EXPECT_EQ(CloseReason(absl::NotFoundError(std::string(500, 'b'))).size(), 123U);
}

}  // namespace
}  // namespace liquidblend::http
