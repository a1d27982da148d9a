// Errors of methods are the same by gRPC and by HTTP: code, message and details.
#include <google/protobuf/util/json_util.h>
#include <google/protobuf/util/message_differencer.h>

#include <set>

#include "absl/strings/str_cat.h"
#include "server/http/exchange/replies.h"
#include "server/http/exchange/route.h"
#include "server/http/port.h"
#include "tests/server/grpc/raw_call.h"
#include "tests/server/grpc/server_testing.h"
#include "tests/server/http/http_client.h"

namespace liquidblend::http::agreement_test {
namespace {

using google::protobuf::Message;
using google::protobuf::util::MessageDifferencer;
using server::MethodDescriptor;

// A wrong request in protobuf's text format.
struct Case {
  std::string method;
  std::string request;
};

const std::vector<Case> kCases = {
    {"GetFamily", R"(name: "families/none")"},
    {"GetFamily", R"(name: "families/No")"},
    {"GetFamily", R"(name: "families/splash" version: 9)"},
    {"ListFamilies", R"(page_size: -1)"},
    {"ListFamilies", R"(page_token: "odd")"},
    {"RollbackFamily", R"(name: "families/splash" version: 1)"},
    {"RollbackFamily", R"(name: "families/splash")"},
    {"DeleteFamily", R"(name: "families/none")"},
    {"RegisterFamily", R"(family_id: "splash" source: "animations/a" targets: "animations/b")"},
    {"RegisterFamily",
     R"(family_id: "new" source: "animations/a" targets: "animations/b"
        options { max_iterations: -1 sample_share: 2 } priority: 101)"},
    {"RegisterFamily", R"(family_id: "new" source: "animations/none" targets: "animations/b")"},
    {"MeasureCorrespondences", R"(family: "families/splash" target_index: 1)"},
    {"MeasureCorrespondences", R"(family: "families/none")"},
    {"GetFrame", R"(family: "families/splash" weights: [0.5, 0.5])"},
    {"GetFrame", R"(family: "families/splash" weights: nan)"},
    {"GetFrame", R"(family: "families/splash" weights: 0.5 time_s: 99)"},
    {"GetFrame", R"(family: "families/none" weights: 0.5)"},
    {"GetAnimation", R"(name: "animations/none")"},
    {"GetAnimationFrame", R"(animation: "animations/a" frame_number: 99)"},
    {"ListAnimations", R"(page_size: -1)"},
    {"DeleteAnimation", R"(name: "animations/a")"},
    {"PresignUpload", R"(files { size_bytes: 3 checksum: "sha256-0" })"},
    {"PresignDownload", R"(name: "families/splash")"},
    {"ReadFile", R"(name: "families/splash" offset: -1)"},
    {"ImportAnimation", R"(animation_id: "new" location: "/etc")"},
    {"ImportAnimation", R"(animation_id: "new" location: "other/shot")"},
    {"WatchOperation", R"(name: "operations/none")"},
    {"GetOperation", R"(name: "operations/none")"},
    {"ListOperations", R"(name: "operations" filter: "done")"},
    {"CancelOperation", R"(name: "operations/none")"},
    {"DeleteOperation", R"(name: "operations/none")"},
    {"WaitOperation", R"(name: "operations/none")"}};

std::string PathOf(const transcode::HttpRule& rule, const std::string& variable) {
  std::string path;
  for (size_t k = 0; k < rule.segments.size(); ++k) {
    const bool is_of_variable = k >= rule.variable_begin && k < rule.variable_end;
    if (!is_of_variable) absl::StrAppend(&path, "/", rule.segments[k]);
    if (k == rule.variable_begin && !rule.variable.empty()) absl::StrAppend(&path, "/", variable);
  }
  return rule.verb.empty() ? path : absl::StrCat(path, ":", rule.verb);
}

// Fields of a message without messages.
std::string QueryOf(const Message& message, const std::string& variable) {
  std::vector<const google::protobuf::FieldDescriptor*> fields;
  message.GetReflection()->ListFields(message, &fields);
  std::string query;
  for (const auto* field : fields) {
    std::string value;
    if (field->name() == variable) continue;
    google::protobuf::TextFormat::PrintFieldValueToString(message, field, -1, &value);
    if (value[0] == '"') value = value.substr(1, value.size() - 2);
    absl::StrAppend(&query, query.empty() ? "?" : "&", field->json_name(), "=", value);
  }
  return query;
}

class AgreementTest : public server::ServerTest {
 protected:
  void SetUp() override {
    Start(server::ServerOptions());
    PublishSplash();
    PortOptions options;
    options.listen = "127.0.0.1:0";
    port_ = *Port::Start(server_->api(), options);
  }
  ~AgreementTest() override { port_.reset(); }

  const transcode::HttpRule* RuleOf(const std::string& method) {
    for (const transcode::HttpRule& rule : routes_.table().rules()) {
      const bool has_two = method == "PresignDownload" || method == "ReadFile";
      const bool fits =
          rule.method->name() == method && (!has_two || rule.segments[1] == "families");
      if (fits) return &rule;
    }
    ADD_FAILURE() << "no rule for " << method;
    return nullptr;
  }

  HttpReply CallByHttp(const transcode::HttpRule& rule, const Message& request) {
    const auto* field = request.GetDescriptor()->FindFieldByName(rule.variable);
    const std::string variable =
        field == nullptr ? "" : request.GetReflection()->GetString(request, field);
    std::string target = PathOf(rule, variable);
    std::string body;
    if (rule.body.empty()) {
      target += QueryOf(request, rule.variable);
    } else {
      EXPECT_TRUE(google::protobuf::util::MessageToJsonString(request, &body).ok());
    }
    HttpClient client(port_->port());
    const std::string headers =
        body.empty()
            ? ""
            : absl::StrCat("Content-Type: application/json\r\nContent-Length: ", body.size(),
                           "\r\n");
    client.Send(absl::StrCat(rule.http_method, " ", target, " HTTP/1.1\r\nHost: localhost\r\n",
                             headers, "\r\n", body));
    return client.ReadReply();
  }

  const Routes routes_;
  std::unique_ptr<Port> port_;
};

TEST_F(AgreementTest, OfErrorsIsWholeInEveryMethod) {
  std::set<std::string> tried;
  for (const Case& c : kCases) {
    const transcode::HttpRule* rule = RuleOf(c.method);
    ASSERT_NE(rule, nullptr);
    const MethodDescriptor& method = *rule->method;
    const std::string bytes = server::FromText(method, c.request);
    const grpc::Status by_grpc = server::CallInBytes(channel_, server::PathOf(method), {bytes});
    const std::unique_ptr<Message> request(google::protobuf::MessageFactory::generated_factory()
                                               ->GetPrototype(method.input_type())
                                               ->New());
    ASSERT_TRUE(request->ParseFromString(bytes));
    const HttpReply by_http = CallByHttp(*rule, *request);
    google::rpc::Status expected, found;
    ASSERT_TRUE(expected.ParseFromString(by_grpc.error_details())) << c.method;
    ASSERT_TRUE(google::protobuf::util::JsonStringToMessage(by_http.body, &found).ok())
        << c.method << ": " << by_http.code << " " << by_http.body;
    EXPECT_TRUE(MessageDifferencer::Equals(expected, found))
        << c.method << " " << c.request << "\nby gRPC:\n"
        << expected.DebugString() << "by HTTP:\n"
        << found.DebugString();
    EXPECT_EQ(by_http.code, HttpCode(static_cast<absl::StatusCode>(expected.code())));
    tried.insert(c.method);
  }
  for (const auto* service : server::ApiServices()) {
    for (int k = 0; k < service->method_count(); ++k) {
      const std::string& name = service->method(k)->name();
      // Their requests are of several messages by gRPC: see upload_test.cc, web_socket_test.cc.
      EXPECT_EQ(tried.contains(name), name != "UploadAnimation" && name != "StreamFrames") << name;
    }
  }
}

}  // namespace
}  // namespace liquidblend::http::agreement_test
