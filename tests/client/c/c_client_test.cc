// The C API with a server: clients, streams, jobs.
#include <gmock/gmock.h>
#include <grpcpp/grpcpp.h>
#include <gtest/gtest.h>

#include <chrono>
#include <cmath>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "absl/strings/str_cat.h"
#include "liquidblend/v1/liquidblend.grpc.pb.h"
#include "tests/client/c/c_testing.h"
#include "tests/client/fake_server.h"

namespace liquidblend {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

class ClientTest : public ::testing::Test {
 protected:
  ClientTest() {
    auto options = Sized<lb_connect_options>();
    const std::string target = server_.target();
    options.target = target.c_str();
    EXPECT_EQ(lb_client_connect(&options, &client_), LB_OK) << LastError();
  }
  ~ClientTest() override { lb_client_free(client_); }

  lb_stream* OpenStream(const lb_stream_request& request) {
    lb_stream* stream = nullptr;
    EXPECT_EQ(lb_stream_open(client_, &request, &stream), LB_OK) << LastError();
    return stream;
  }

  liquidblend::testing::FakeServer server_;
  lb_client* client_ = nullptr;
};

TEST(Connect, WaitsForAServerThatIsGoneAsLongAsPatienceLasts) {
  auto server = std::make_unique<liquidblend::testing::FakeServer>();
  const std::string target = server->target();
  auto options = Sized<lb_connect_options>();
  options.target = target.c_str();
  options.patience_s = 0.2;
  lb_client* client = nullptr;
  ASSERT_EQ(lb_client_connect(&options, &client), LB_OK) << LastError();
  server = nullptr;
  lb_family* family = nullptr;
  EXPECT_EQ(lb_client_get_family(client, "drops", 0, &family), LB_UNAVAILABLE);
  EXPECT_THAT(LastError(), HasSubstr("attempts"));
  lb_client_free(client);
}

TEST_F(ClientTest, CallsAreInTheTraceThatIsGiven) {
  auto options = Sized<lb_connect_options>();
  const std::string target = server_.target();
  const std::string traceparent = "00-4bf92f3577b34da6a3ce929d0e0e4736-00f067aa0ba902b7-01";
  options.target = target.c_str();
  options.traceparent = traceparent.c_str();
  lb_client* client = nullptr;
  ASSERT_EQ(lb_client_connect(&options, &client), LB_OK) << LastError();
  auto request = Sized<lb_frame_request>();
  request.family = "drops";
  const double weight = 0.5;
  request.num_weights = 1;
  request.weights = &weight;
  lb_frame* frame = nullptr;
  EXPECT_EQ(lb_client_get_frame(client, &request, &frame), LB_OK) << LastError();
  EXPECT_EQ(server_.LastTrace().traceparent, traceparent);
  lb_frame_free(frame);
  lb_client_free(client);
}

TEST_F(ClientTest, DescribesAFamilyAndItsPoints) {
  lb_family* family = nullptr;
  ASSERT_EQ(lb_client_get_family(client_, "drops", 0, &family), LB_OK) << LastError();
  auto info = Sized<lb_family_info>();
  lb_family_describe(family, &info);
  EXPECT_STREQ(info.name, "families/drops");
  EXPECT_STREQ(info.source, "animations/drops-a");
  ASSERT_EQ(info.num_targets, 1u);
  EXPECT_STREQ(info.targets[0], "animations/drops-b");
  ASSERT_EQ(info.num_parameters, 1u);
  EXPECT_STREQ(info.parameters[0], "height");
  EXPECT_EQ(info.points[0], 1.0);
  EXPECT_EQ(info.points[1], 3.0);
  EXPECT_THAT(info.json, HasSubstr("families/drops"));
  lb_family_free(family);
  EXPECT_EQ(lb_client_get_family(client_, "none", 0, &family), LB_NOT_FOUND);
  EXPECT_EQ(family, nullptr);
}

TEST_F(ClientTest, ListsNamesAsJson) {
  lb_text* text = nullptr;
  ASSERT_EQ(lb_client_list_families(client_, &text), LB_OK) << LastError();
  EXPECT_THAT(lb_text_get(text), HasSubstr("\"families/drops\""));
  lb_text_free(text);
}

// A server with one family, which may have any name.
class NamingServer : public v1::LiquidBlend::Service {
 public:
  explicit NamingServer(std::string name) : name_(std::move(name)) {
    grpc::ServerBuilder builder;
    builder.AddListeningPort("127.0.0.1:0", grpc::InsecureServerCredentials(), &port_);
    builder.RegisterService(this);
    server_ = builder.BuildAndStart();
  }
  ~NamingServer() override { server_->Shutdown(std::chrono::system_clock::now()); }

  grpc::Status ListFamilies(grpc::ServerContext*, const v1::ListFamiliesRequest*,
                            v1::ListFamiliesResponse* response) override {
    response->add_families()->set_name(name_);
    return grpc::Status::OK;
  }

  std::string target() const { return absl::StrCat("127.0.0.1:", port_); }

 private:
  const std::string name_;
  int port_ = 0;
  std::unique_ptr<grpc::Server> server_;
};

TEST(Names, OfAHostileServerAreTextsOfTheJson) {
  const std::string name =
      absl::StrCat("families/\"],\\ \x1b[2J\n", std::string(1, '\0'), "\x1f \u6c34");
  const NamingServer server(name);
  auto options = Sized<lb_connect_options>();
  const std::string target = server.target();
  options.target = target.c_str();
  lb_client* client = nullptr;
  ASSERT_EQ(lb_client_connect(&options, &client), LB_OK) << LastError();
  lb_text* text = nullptr;
  ASSERT_EQ(lb_client_list_families(client, &text), LB_OK) << LastError();
  EXPECT_STREQ(lb_text_get(text), R"(["families/\"],\\ \u001b[2J\u000a\u0000\u001f )"
                                  "\u6c34\"]");
  lb_text_free(text);
  lb_client_free(client);
}

TEST_F(ClientTest, GetsAFrame) {
  const double weight = 0.5;
  auto request = Sized<lb_frame_request>();
  request.family = "drops";
  request.num_weights = 1;
  request.weights = &weight;
  request.time_s = 0.25;
  lb_frame* frame = nullptr;
  ASSERT_EQ(lb_client_get_frame(client_, &request, &frame), LB_OK) << LastError();
  auto info = Sized<lb_frame_info>();
  lb_frame_describe(frame, &info);
  EXPECT_EQ(info.num_vertices, 6u);
  EXPECT_EQ(info.num_triangles, 8u);
  EXPECT_NEAR(info.bounds_max[0], 1.75, 1e-3);
  EXPECT_EQ(info.velocity_scale, 1.0);
  lb_frame_free(frame);
}

TEST_F(ClientTest, AsksForTheSurfaceOfTheRequest) {
  auto surface = Sized<lb_surface>();
  surface.smoothing_passes = 2;
  surface.smoothing_strength = 0.25;
  surface.laplacian = 1;
  surface.position_bits = 16;
  auto request = Sized<lb_frame_request>();
  request.family = "drops";
  request.surface = &surface;
  lb_frame* frame = nullptr;
  ASSERT_EQ(lb_client_get_frame(client_, &request, &frame), LB_OK) << LastError();
  lb_frame_free(frame);
  EXPECT_THAT(server_.LastRequest(), HasSubstr("smoothing: LAPLACIAN"));
  EXPECT_THAT(server_.LastRequest(), HasSubstr("smoothing_strength: 0.25"));
  EXPECT_THAT(server_.LastRequest(), HasSubstr("MESHOPT"));
  surface.position_bits = 20;
  ASSERT_EQ(lb_client_get_frame(client_, &request, &frame), LB_OK) << LastError();
  lb_frame_free(frame);
  EXPECT_THAT(server_.LastRequest(), HasSubstr("position_bits: 20"));
  EXPECT_THAT(server_.LastRequest(), Not(HasSubstr("MESHOPT")));
  surface.struct_size = offsetof(lb_surface, smoothing_strength);  // of a program before it
  ASSERT_EQ(lb_client_get_frame(client_, &request, &frame), LB_OK) << LastError();
  lb_frame_free(frame);
  EXPECT_THAT(server_.LastRequest(), Not(HasSubstr("LAPLACIAN")));
}

TEST_F(ClientTest, StreamsTheWholeAnimationAndEnds) {
  const double weight = 0.5;
  auto request = Sized<lb_stream_request>();
  request.family = "drops";
  request.version = 3;
  request.num_weights = 1;
  request.weights = &weight;
  request.frames_per_second = 10.0;
  lb_stream* const stream = OpenStream(request);
  std::vector<double> times;
  lb_frame* frame = nullptr;
  lb_frame* last = nullptr;
  while (lb_stream_next(stream, &frame) == LB_OK && frame != nullptr) {
    auto info = Sized<lb_frame_info>();
    lb_frame_describe(frame, &info);
    times.push_back(info.time_s);
    EXPECT_EQ(info.num_triangles, 8u);
    EXPECT_EQ(info.weights[0], 0.5);
    EXPECT_EQ(info.velocity_scale, 1.0);
    lb_frame_free(last);
    last = frame;
  }
  ASSERT_EQ(times.size(), 11u);
  for (size_t k = 0; k < times.size(); ++k) EXPECT_EQ(times[k], static_cast<double>(k) / 10.0);
  EXPECT_THAT(server_.LastRequest(), HasSubstr("lossless: true"));
  EXPECT_THAT(server_.LastRequest(), HasSubstr("version: 3"));
  EXPECT_EQ(lb_stream_next(stream, &frame), LB_OK) << "still at its end";
  EXPECT_EQ(frame, nullptr);
  lb_client_free(client_);
  client_ = nullptr;
  lb_stream_free(stream);
  auto info = Sized<lb_frame_info>();
  lb_frame_describe(last, &info);
  EXPECT_NEAR(info.bounds_max[0], 2.5, 1e-3) << "a frame outlives stream and client";
  lb_frame_free(last);
}

TEST_F(ClientTest, AStreamEndsAtOnceWhenItIsCancelled) {
  auto request = Sized<lb_stream_request>();
  request.family = "drops";
  request.live = 1;
  request.adapts_detail = 1;
  lb_stream* const stream = OpenStream(request);
  lb_frame* frame = nullptr;
  ASSERT_EQ(lb_stream_next(stream, &frame), LB_OK) << LastError();
  auto info = Sized<lb_frame_info>();
  lb_frame_describe(frame, &info);
  EXPECT_EQ(info.level_of_detail, 1) << "the server's choice";
  lb_frame_free(frame);
  std::thread other([stream] { lb_stream_cancel(stream); });
  lb_status status = LB_OK;
  while ((status = lb_stream_next(stream, &frame)) == LB_OK) lb_frame_free(frame);
  EXPECT_EQ(status, LB_CANCELLED) << LastError();
  EXPECT_EQ(frame, nullptr);
  other.join();
  lb_stream_free(stream);
  lb_stream_free(OpenStream(request));  // without a call for a frame
}

TEST_F(ClientTest, AStreamTellsWhyItFails) {
  server_.BreakNextStream();
  auto request = Sized<lb_stream_request>();
  request.family = "drops";
  lb_stream* const stream = OpenStream(request);
  lb_frame* frame = nullptr;
  for (int k = 0; k < 2; ++k) {
    ASSERT_EQ(lb_stream_next(stream, &frame), LB_OK) << LastError();
    lb_frame_free(frame);
  }
  EXPECT_EQ(lb_stream_next(stream, &frame), LB_UNAVAILABLE);
  EXPECT_THAT(LastError(), HasSubstr("the server is stopping"));
  EXPECT_EQ(frame, nullptr);
  lb_stream_free(stream);
  lb_stream* none = nullptr;
  request.family = "";
  EXPECT_EQ(lb_stream_open(client_, &request, &none), LB_INVALID_ARGUMENT);
  EXPECT_THAT(LastError(), HasSubstr("family"));
  request.family = "drops";
  request.num_weights = 1;
  EXPECT_EQ(lb_stream_open(client_, &request, &none), LB_INVALID_ARGUMENT);
  EXPECT_THAT(LastError(), HasSubstr("weights is NULL"));
  EXPECT_EQ(none, nullptr);
}

TEST_F(ClientTest, AnErrorHasTheServersReason) {
  server_.AddErrorDetails();
  server_.FailNext("GetFamily", 1, absl::FailedPreconditionError("refused"));
  lb_family* family = nullptr;
  EXPECT_EQ(lb_client_get_family(client_, "drops", 0, &family), LB_FAILED_PRECONDITION);
  EXPECT_STREQ(lb_last_error_reason(), "FAMILY_BUSY");
  std::thread([] { EXPECT_STREQ(lb_last_error_reason(), "") << "of another thread"; }).join();
  EXPECT_EQ(lb_client_get_family(nullptr, "drops", 0, &family), LB_INVALID_ARGUMENT);
  EXPECT_STREQ(lb_last_error_reason(), "") << "no server has said it";
}

TEST_F(ClientTest, PublishesAnOlderVersionAgain) {
  lb_family* family = nullptr;
  ASSERT_EQ(lb_client_rollback_family(client_, "drops", 2, &family), LB_OK) << LastError();
  auto info = Sized<lb_family_info>();
  lb_family_describe(family, &info);
  EXPECT_EQ(info.version, 4);
  lb_family_free(family);
  EXPECT_EQ(lb_client_rollback_family(client_, "drops", 9, &family), LB_NOT_FOUND);
  EXPECT_EQ(family, nullptr);
}

TEST_F(ClientTest, WatchesAnOperationToItsEnd) {
  int num_calls = 0;
  const auto count = [](void* user, const lb_operation* operation) -> int32_t {
    auto info = Sized<lb_operation_info>();
    lb_operation_describe(operation, &info);
    EXPECT_STREQ(info.name, "operations/register-1");
    ++*static_cast<int*>(user);
    return 1;
  };
  lb_operation* operation = nullptr;
  ASSERT_EQ(lb_client_watch(client_, "register-1", count, &num_calls, &operation), LB_OK)
      << LastError();
  EXPECT_GT(num_calls, 0);
  auto info = Sized<lb_operation_info>();
  lb_operation_describe(operation, &info);
  EXPECT_EQ(info.done, 1);
  EXPECT_EQ(info.status, LB_OK);
  lb_operation_free(operation);
}

TEST_F(ClientTest, WatchesAnOperationForAWhile) {
  lb_operation* operation = nullptr;
  EXPECT_EQ(lb_client_watch_for(client_, "endless-1", 0.2, nullptr, nullptr, &operation),
            LB_DEADLINE_EXCEEDED);
  EXPECT_THAT(LastError(), HasSubstr("has not said that operations/endless-1 is done"));
  EXPECT_EQ(operation, nullptr);
  for (const double timeout_s : {60.0, 1e12, HUGE_VAL}) {
    ASSERT_EQ(lb_client_watch_for(client_, "import-1", timeout_s, nullptr, nullptr, &operation),
              LB_OK)
        << timeout_s << ": " << LastError();
    lb_operation_free(operation);
  }
  EXPECT_EQ(lb_client_watch_for(client_, "import-1", std::nan(""), nullptr, nullptr, &operation),
            LB_INVALID_ARGUMENT);
  EXPECT_THAT(LastError(), HasSubstr("timeout_s"));
}

TEST_F(ClientTest, RegistersWithCorrespondences) {
  const char* const targets[] = {"drops-b"};
  auto pair = Sized<lb_correspondence>();
  pair.hard = 1;
  pair.source_position[2] = 0.5;
  pair.source_time_s = 0.25;
  auto request = Sized<lb_register_request>();
  request.family = "new";
  request.source = "drops-a";
  request.num_targets = 1;
  request.targets = targets;
  request.num_correspondences = 1;
  request.correspondences = &pair;
  lb_operation* operation = nullptr;
  ASSERT_EQ(lb_client_register(client_, &request, &operation), LB_OK) << LastError();
  lb_operation_free(operation);
  EXPECT_THAT(server_.LastRequest(), HasSubstr("correspondences"));
  lb_option option = {"seed", "7"};
  request.num_options = 1;
  request.options = &option;
  ASSERT_EQ(lb_client_register(client_, &request, &operation), LB_OK) << LastError();
  lb_operation_free(operation);
  EXPECT_THAT(server_.LastRequest(), HasSubstr("seed: 7"));
  option.value = "many";
  EXPECT_EQ(lb_client_register(client_, &request, &operation), LB_INVALID_ARGUMENT);
  EXPECT_THAT(LastError(), HasSubstr("option seed: 'many'"));
  option.name = "sead";
  EXPECT_EQ(lb_client_register(client_, &request, &operation), LB_INVALID_ARGUMENT);
  EXPECT_THAT(LastError(), HasSubstr("'sead'"));
  request.num_options = 0;
  pair.target = 3;
  EXPECT_EQ(lb_client_register(client_, &request, &operation), LB_INVALID_ARGUMENT);
  EXPECT_THAT(LastError(), HasSubstr("target 3"));
}

}  // namespace
}  // namespace liquidblend
