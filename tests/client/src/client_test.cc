#include "liquidblend/client.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <functional>
#include <set>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "absl/time/clock.h"
#include "tests/client/fake_server.h"
#include "tests/client/temp_files.h"

namespace liquidblend::client_test {
namespace {

using ::testing::AllOf;
using ::testing::Each;
using ::testing::ElementsAre;
using testing::FakeServer;
using ::testing::HasSubstr;
using ::testing::Le;
using ::testing::Not;
using testing::TempDir;

const absl::Status kAway = absl::UnavailableError("going away");

class ClientTest : public ::testing::Test {
 protected:
  ClientTest() {
    ConnectOptions options;
    options.target = server_.target();
    options.retry.initial_backoff = absl::Milliseconds(1);
    options.retry.max_backoff = absl::Milliseconds(4);
    client_ = *Client::Connect(options);
  }

  FakeServer server_;
  std::unique_ptr<Client> client_;
};

TEST(ClientConnect, SaysWhereNobodyAnswers) {
  std::string target;
  {
    const FakeServer gone;
    target = gone.target();
  }
  ConnectOptions options;
  options.target = target;
  options.connect_timeout = absl::Milliseconds(50);
  const absl::Status status = Client::Connect(options).status();
  EXPECT_EQ(status.code(), absl::StatusCode::kUnavailable);
  EXPECT_THAT(std::string(status.message()), HasSubstr(target));
}

TEST(ClientConnect, RefusesOptionsOutOfRangeByName) {
  ConnectOptions options;
  options.retry.max_attempts = 0;
  const absl::Status status = Client::Connect(options).status();
  EXPECT_EQ(status.code(), absl::StatusCode::kInvalidArgument);
  EXPECT_THAT(std::string(status.message()), HasSubstr("retry.max_attempts is 0"));
}

TEST(ClientConnect, SendsNoTokenForEveryoneToRead) {
  ConnectOptions options;
  options.target = "liquid.example:50051";
  options.security.token = "secret";
  const absl::Status status = Client::Connect(options).status();
  EXPECT_EQ(status.code(), absl::StatusCode::kInvalidArgument);
  EXPECT_THAT(std::string(status.message()), HasSubstr("without TLS"));
  EXPECT_THAT(std::string(status.message()), Not(HasSubstr("secret")));
}

TEST(ClientConnect, NamesAMissingCertificateFile) {
  ConnectOptions options;
  options.security.tls_ca = "/none/ca.crt";
  const absl::Status status = Client::Connect(options).status();
  EXPECT_EQ(status.code(), absl::StatusCode::kNotFound);
  EXPECT_THAT(std::string(status.message()),
              HasSubstr("tls_ca: /none/ca.crt cannot be read: No such file or directory"));
}

TEST(ClientConnect, NamesAFileWithoutACertificate) {
  const TempDir dir;
  ConnectOptions options;
  options.security.tls_ca = dir.Write("key.pem", "-----BEGIN PRIVATE KEY-----\n");
  const absl::Status status = Client::Connect(options).status();
  EXPECT_EQ(status.code(), absl::StatusCode::kInvalidArgument);
  EXPECT_THAT(std::string(status.message()),
              HasSubstr("key.pem has no PEM block of a CERTIFICATE"));
}

TEST(ClientConnect, ReadsCertificatesOfRegularFilesOnly) {
  const TempDir dir;
  const std::string fifo = dir.File("fifo.pem");
  ASSERT_EQ(::mkfifo(fifo.c_str(), 0600), 0);
  for (const std::string& path : {fifo, std::string("/dev/zero"), dir.path()}) {
    ConnectOptions options;
    options.security.tls_ca = path;
    const absl::Status status = Client::Connect(options).status();
    EXPECT_EQ(status.code(), absl::StatusCode::kInvalidArgument);
    EXPECT_THAT(std::string(status.message()),
                HasSubstr("tls_ca: " + path + " is no regular file"));
  }
}

// As those of `--tls-key <(a program that knows it)`.
TEST(ClientConnect, ReadsKeysOfPipesToo) {
  int ends[2];
  ASSERT_EQ(::pipe(ends), 0);
  const std::string no_certificate = "-----BEGIN PRIVATE KEY-----\n";
  ASSERT_GT(::write(ends[1], no_certificate.data(), no_certificate.size()), 0);
  ::close(ends[1]);
  const TempDir dir;
  ConnectOptions options;
  options.security.tls_cert = absl::StrCat("/dev/fd/", ends[0]);
  options.security.tls_key = dir.Write("key.pem", no_certificate);
  const absl::Status status = Client::Connect(options).status();
  ::close(ends[0]);
  EXPECT_THAT(std::string(status.message()), HasSubstr("has no PEM block of a CERTIFICATE"));
}

TEST(ClientConnect, ReadsCertificatesUpToALimit) {
  const TempDir dir;
  const std::string block = "-----BEGIN CERTIFICATE-----\n";
  ConnectOptions options;
  options.target = "127.0.0.1:1";
  options.connect_timeout = absl::Milliseconds(1);
  options.security.tls_ca =
      dir.Write("most.pem", block + std::string((1 << 20) - block.size(), '\n'));
  EXPECT_EQ(Client::Connect(options).status().code(), absl::StatusCode::kUnavailable);
  options.security.tls_ca = dir.Write("big.pem", block + std::string(1 << 20, '\n'));
  const absl::Status status = Client::Connect(options).status();
  EXPECT_EQ(status.code(), absl::StatusCode::kInvalidArgument);
  EXPECT_THAT(std::string(status.message()), HasSubstr("big.pem is larger than 1 MiB"));
}

TEST_F(ClientTest, UploadSendsEveryByteInChunksOfAtMostTheSizeAsked) {
  const TempDir dir;
  const std::string big(700000, 'x');
  UploadRequest request;
  request.animation = "animations/drops-a";
  request.files = {dir.Write("f_0001.ply", big), dir.Write("f_0002.ply", "small"),
                   dir.Write("empty.uni", "")};
  request.options.frames_per_second = 30;
  request.chunk_bytes = 256 << 10;
  int64_t last_bytes = 0;
  const auto operation = client_->UploadAnimation(request, [&](const UploadProgress& progress) {
    EXPECT_GE(progress.bytes_sent, last_bytes);
    EXPECT_EQ(progress.bytes_total, 700005);
    last_bytes = progress.bytes_sent;
  });
  ASSERT_TRUE(operation.ok()) << operation.status();
  EXPECT_EQ(operation->name, "operations/import-1");
  EXPECT_EQ(operation->subject, "animations/drops-a");
  EXPECT_EQ(last_bytes, 700005);
  ASSERT_EQ(server_.Uploads().size(), 1u);
  const testing::ReceivedUpload upload = server_.Uploads()[0];
  EXPECT_EQ(upload.animation_id, "drops-a");
  EXPECT_EQ(upload.frames_per_second, 30);
  EXPECT_THAT(upload.chunk_bytes, Each(Le(256 << 10)));
  EXPECT_EQ(upload.files.at("f_0001.ply"), big);
  EXPECT_EQ(upload.files.at("f_0002.ply"), "small");
  EXPECT_EQ(upload.announced.at("f_0001.ply"), 700000);
  EXPECT_EQ(upload.announced.at("empty.uni"), 0);
}

TEST_F(ClientTest, UploadIsRepeatedWholeWhileTheServerIsAway) {
  const TempDir dir;
  UploadRequest request;
  request.animation = "drops-a";
  request.files = {dir.Write("f_0001.ply", "bytes")};
  server_.FailNext("UploadAnimation", 2, kAway);
  ASSERT_TRUE(client_->UploadAnimation(request).ok());
  EXPECT_EQ(server_.NumCalls("UploadAnimation"), 3);
  ASSERT_EQ(server_.Uploads().size(), 1u);
  EXPECT_EQ(server_.Uploads()[0].files.at("f_0001.ply"), "bytes");
  EXPECT_EQ(server_.Uploads()[0].request_id.size(), 36u);
}

TEST_F(ClientTest, UploadReportsWhyTheServerEndedItEarly) {
  const TempDir dir;
  UploadRequest request;
  request.animation = "drops-a";
  for (const char* name : {"f_1.ply", "f_2.ply", "f_3.ply"}) {
    request.files.push_back(dir.Write(name, std::string(300000, 'x')));
  }
  server_.RefuseNextUpload(absl::InvalidArgumentError("f_1.ply is refused"));
  const absl::Status status = client_->UploadAnimation(request).status();
  EXPECT_EQ(status.code(), absl::StatusCode::kInvalidArgument);
  EXPECT_THAT(std::string(status.message()), HasSubstr("f_1.ply is refused"));
}

TEST_F(ClientTest, UploadNamesAFileThatIsNotThere) {
  UploadRequest request;
  request.animation = "drops-a";
  request.files = {"/nowhere/f_0001.ply"};
  const absl::Status status = client_->UploadAnimation(request).status();
  EXPECT_EQ(status.code(), absl::StatusCode::kNotFound);
  EXPECT_THAT(std::string(status.message()), HasSubstr("/nowhere/f_0001.ply"));
  EXPECT_EQ(server_.NumCalls("UploadAnimation"), 0);
}

TEST_F(ClientTest, CallsAreRepeatedWhileTheServerIsAway) {
  server_.FailNext("GetFamily", 3, kAway);
  const auto family = client_->GetFamily("drops");
  ASSERT_TRUE(family.ok()) << family.status();
  EXPECT_EQ(family->version, 3);
  EXPECT_EQ(server_.NumCalls("GetFamily"), 4);
}

TEST_F(ClientTest, GivesUpAfterTheAttemptsAndSaysHowMany) {
  server_.FailNext("GetFamily", 100, kAway);
  const absl::Status status = client_->GetFamily("drops").status();
  EXPECT_EQ(status.code(), absl::StatusCode::kUnavailable);
  EXPECT_THAT(std::string(status.message()), HasSubstr("after 5 attempts"));
  EXPECT_EQ(server_.NumCalls("GetFamily"), 5);
}

TEST_F(ClientTest, ACallThatIsRefusedForNowIsRepeatedWhenTheServerSays) {
  const absl::Duration delay = absl::Milliseconds(20);
  const auto busy = testing::WithRetryDelay(absl::ResourceExhaustedError("busy"), delay);
  server_.FailNext("GetFamily", 7, busy);  // more than max_attempts
  const absl::Time begin = absl::Now();
  EXPECT_TRUE(client_->GetFamily("drops").ok());
  EXPECT_GE(absl::Now() - begin, 7 * delay);
  EXPECT_EQ(server_.NumCalls("GetFamily"), 8);
}

TEST_F(ClientTest, AWaitBeyondThePatienceIsTheCallersToDecide) {
  server_.FailNext("GetFamily", 1,
                   testing::WithRetryDelay(absl::ResourceExhaustedError("busy"), absl::Hours(1)));
  const absl::Status status = client_->GetFamily("drops").status();
  EXPECT_EQ(status.code(), absl::StatusCode::kResourceExhausted);
  EXPECT_EQ(status.message(), "busy; try again in 1h");
  EXPECT_EQ(server_.NumCalls("GetFamily"), 1);
}

TEST_F(ClientTest, OtherErrorsAreNotRepeated) {
  server_.FailNext("GetFamily", 1, absl::PermissionDeniedError("no"));
  EXPECT_EQ(client_->GetFamily("drops").status().code(), absl::StatusCode::kPermissionDenied);
  EXPECT_EQ(server_.NumCalls("GetFamily"), 1);
}

TEST_F(ClientTest, ARepeatedRegistrationHasTheSameRequestIdAndANewOneAnother) {
  RegisterRequest request;
  request.family = "drops";
  request.source = "drops-a";
  request.targets = {"animations/drops-b"};
  server_.FailNext("RegisterFamily", 1, kAway);
  ASSERT_TRUE(client_->RegisterFamily(request).ok());
  ASSERT_TRUE(client_->RegisterFamily(request).ok());
  const std::vector<std::string> ids = server_.RequestIds();
  ASSERT_EQ(ids.size(), 3u);
  EXPECT_EQ(ids[0], ids[1]);
  EXPECT_NE(ids[1], ids[2]);
  EXPECT_FALSE(ids[0].empty());
}

RegisterRequest DropsRequest() {
  RegisterRequest request;
  request.family = "drops";
  request.source = "drops-a";
  request.targets = {"drops-b"};
  return request;
}

TEST_F(ClientTest, WhatCarriesARequestIdIsSubmittedAgainWhileThereIsPatience) {
  const TempDir dir;
  UploadRequest upload;
  upload.animation = "drops-a";
  upload.files = {dir.Write("f_0001.ply", "bytes")};
  server_.FailNext("RegisterFamily", 7, kAway);  // more than max_attempts
  server_.FailNext("UploadAnimation", 7, kAway);
  EXPECT_TRUE(client_->RegisterFamily(DropsRequest()).ok());
  EXPECT_TRUE(client_->UploadAnimation(upload).ok());
  EXPECT_EQ(server_.NumCalls("RegisterFamily"), 8);
  EXPECT_EQ(server_.NumCalls("UploadAnimation"), 8);
}

TEST_F(ClientTest, ASubmissionWhoseAnswerIsLostSaysWhereToLook) {
  ConnectOptions options;
  options.target = server_.target();
  options.retry.max_attempts = 1;
  options.retry.patience = absl::ZeroDuration();
  client_ = *Client::Connect(options);
  const TempDir dir;
  UploadRequest upload;
  upload.animation = "drops-a";
  upload.files = {dir.Write("f_0001.ply", "bytes")};
  for (const char* method : {"RegisterFamily", "UploadAnimation", "ImportAnimation"}) {
    server_.FailNext(method, 1, kAway);
  }
  for (const absl::Status& status :
       {client_->RegisterFamily(DropsRequest()).status(), client_->UploadAnimation(upload).status(),
        client_->ImportAnimation({"drops-a", "root/dir", {}, 0}).status()}) {
    EXPECT_EQ(status.code(), absl::StatusCode::kUnavailable);
    EXPECT_THAT(std::string(status.message()),
                HasSubstr("going away; it may have been accepted nevertheless: `liquidblend "
                          "operations` lists it"));
  }
}

// After any of these the client has heard of version 3.
TEST_F(ClientTest, FramesAreNotOlderThanWhatTheClientHasHeardOf) {
  const std::vector<std::function<absl::Status(Client&)>> ways = {
      [](Client& client) { return client.GetFamily("drops").status(); },
      [](Client& client) { return client.ListFamilies().status(); },
      [](Client& client) { return client.WaitOperation("register-1").status(); }};
  FrameRequest frame;
  frame.family = "drops";
  frame.weights = {0.5};
  StreamSettings stream;
  stream.family = "drops";
  stream.weights = {0.5};
  stream.lossless = true;
  ConnectOptions options;
  options.target = server_.target();
  for (const auto& hear : ways) {
    const auto client = *Client::Connect(options);
    ASSERT_TRUE(client->GetFrame(frame).ok());
    EXPECT_THAT(server_.LastRequest(), Not(HasSubstr("min_version")));
    ASSERT_TRUE(hear(*client).ok());
    ASSERT_TRUE(client->GetFrame(frame).ok());
    EXPECT_THAT(server_.LastRequest(), HasSubstr("min_version: 3"));
    ASSERT_TRUE((*client->StreamFrames(stream))->Read().ok());
    EXPECT_THAT(server_.LastRequest(), AllOf(HasSubstr("lossless"), HasSubstr("min_version: 3")));
  }
}

TEST_F(ClientTest, RegistrationCarriesOptionsAndCorrespondences) {
  RegisterRequest request;
  request.family = "families/drops";
  request.source = "drops-a";
  request.targets = {"drops-b"};
  request.options.max_iterations = 9;
  request.options.seed = 42;
  request.options.thin_sheets_from = 0.25;
  request.space_time.connectivity = Connectivity::kTracked;
  request.space_time.droplet_vertices = 0;
  request.space_time.coarser_levels = 3;
  Correspondence track;
  track.kind = CorrespondenceKind::kTrajectory;
  track.hard = true;
  track.source = {{1, 2, 3}, 0.5};
  track.length_s = 0.25;
  request.parameter_space = {{"height"}, {{1.5}, {3.5}}, Interpolation::kSmooth};
  request.time_blending = {TimeBlending::Kind::kSquares, -0.75};
  request.correspondences = {{track}};
  ASSERT_TRUE(client_->RegisterFamily(request).ok());
  const std::string sent = server_.LastRequest();
  for (const char* part : {"family_id: \"drops\"",
                           "source: \"animations/drops-a\"",
                           "targets: \"animations/drops-b\"",
                           "max_iterations: 9",
                           "seed: 42",
                           "kind: TRAJECTORY",
                           "hard: true",
                           "z: 3",
                           "time_s: 0.5",
                           "length_s: 0.25",
                           "thin_sheets_from: 0.25",
                           "connectivity: TRACKED",
                           "droplet_vertices: 0",
                           "coarser_levels: 3",
                           "names: \"height\"",
                           "values: 1.5",
                           "values: 3.5",
                           "interpolation: SMOOTH",
                           "kind: SQUARES",
                           "rest_time_s: -0.75"}) {
    EXPECT_THAT(sent, HasSubstr(part));
  }
  EXPECT_THAT(sent, Not(HasSubstr("sheet_thickness_edges"))) << "not set: the server's default";
}

TEST_F(ClientTest, ListsAllPages) {
  const auto animations = client_->ListAnimations();
  ASSERT_TRUE(animations.ok()) << animations.status();
  EXPECT_EQ(animations->size(), 2502u);
  std::set<std::string> names;
  for (const Animation& animation : *animations) names.insert(animation.name);
  EXPECT_EQ(names.size(), 2502u);
  EXPECT_EQ(server_.NumCalls("ListAnimations"), 11);
}

TEST_F(ClientTest, ADeletionWhoseAnswerWasLostSucceedsAtTheSecondAttempt) {
  server_.FailNext("DeleteFamily", 1, kAway);
  EXPECT_TRUE(client_->DeleteFamily("drops").ok());
  EXPECT_THAT(server_.Deleted(), ElementsAre("families/drops"));
  EXPECT_EQ(client_->DeleteFamily("drops").code(), absl::StatusCode::kNotFound);
}

TEST_F(ClientTest, ErrorsCarryTheServersDetails) {
  server_.AddErrorDetails();
  server_.FailNext("GetFrame", 1, absl::InvalidArgumentError("refused"));
  FrameRequest request;
  request.family = "drops";
  const absl::Status status = client_->GetFrame(request).status();
  EXPECT_EQ(status.code(), absl::StatusCode::kInvalidArgument);
  const std::string message(status.message());
  EXPECT_THAT(message, HasSubstr("refused; reason: FAMILY_BUSY (family=drops)"));
  EXPECT_THAT(message, HasSubstr("weights[0]: is 7; it must be in [-1, 2]"));
}

TEST_F(ClientTest, EachCallCarriesTheTraceThatIsGivenForIt) {
  int num_calls = 0;
  ConnectOptions options;
  options.target = server_.target();
  options.trace = [&] {
    return TraceHeaders{
        absl::StrFormat("00-4bf92f3577b34da6a3ce929d0e0e4736-%016x-01", ++num_calls), "vendor=1"};
  };
  const std::unique_ptr<Client> client = *Client::Connect(options);
  FrameRequest frame;
  frame.family = "drops";
  frame.weights = {0.5};
  ASSERT_TRUE(client->GetFrame(frame).ok());
  EXPECT_EQ(server_.LastTrace().traceparent,
            "00-4bf92f3577b34da6a3ce929d0e0e4736-0000000000000001-01");
  EXPECT_EQ(server_.LastTrace().tracestate, "vendor=1");
  ASSERT_TRUE(client->WaitOperation("operations/import-1").ok());
  EXPECT_THAT(server_.LastTrace().traceparent, HasSubstr("-0000000000000002-"));
  StreamSettings stream;
  stream.family = "drops";
  ASSERT_TRUE((*client->StreamFrames(stream))->Read().ok());
  EXPECT_THAT(server_.LastTrace().traceparent, HasSubstr("-0000000000000003-"));
  const TempDir dir;
  UploadRequest upload;
  upload.animation = "drops-a";
  upload.files = {dir.Write("f_0001.ply", "bytes")};
  ASSERT_TRUE(client->UploadAnimation(upload).ok());
  EXPECT_THAT(server_.LastTrace().traceparent, HasSubstr(absl::StrFormat("-%016x-", num_calls)));
}

TEST_F(ClientTest, ATraceThatCannotBeAHeaderIsNotSent) {
  for (const std::string& text :
       {std::string(), std::string("00-4bf9\n"), std::string("\xFF"), std::string(513, 'a')}) {
    ConnectOptions options;
    options.target = server_.target();
    options.trace = [&] { return TraceHeaders{text, "vendor=1"}; };
    FrameRequest frame;
    frame.family = "drops";
    frame.weights = {0.5};
    ASSERT_TRUE((*Client::Connect(options))->GetFrame(frame).ok());
    EXPECT_EQ(server_.LastTrace().traceparent, "");
    EXPECT_EQ(server_.LastTrace().tracestate, "");
  }
}

TEST_F(ClientTest, GetFrameAsksForTheFamilysFrame) {
  FrameRequest request;
  request.family = "drops";
  request.weights = {-0.25};
  request.time_s = 0.5;
  const auto frame = client_->GetFrame(request);
  ASSERT_TRUE(frame.ok()) << frame.status();
  EXPECT_EQ(frame->family, "families/drops");
  EXPECT_EQ(frame->version, 3);
  EXPECT_THAT(frame->weights, ElementsAre(-0.25));
  EXPECT_EQ(frame->num_triangles, 8);
  EXPECT_FALSE(frame->data.empty());
}

TEST_F(ClientTest, GetFrameTakesAPointInParameterSpaceAndTellsItsWeights) {
  FrameRequest request;
  request.family = "drops";
  request.parameters = {{"height", 2.5}};
  const auto frame = client_->GetFrame(request);
  ASSERT_TRUE(frame.ok()) << frame.status();
  EXPECT_THAT(frame->weights, ElementsAre(0.75));
  EXPECT_FALSE(frame->extrapolated);
  request.parameters["height"] = 4;
  EXPECT_EQ(client_->GetFrame(request).status().code(), absl::StatusCode::kOutOfRange);
  request.extrapolate = true;
  const auto outside = client_->GetFrame(request);
  ASSERT_TRUE(outside.ok()) << outside.status();
  EXPECT_TRUE(outside->extrapolated);
}

TEST_F(ClientTest, AFamilyTellsItsPoints) {
  const auto family = client_->GetFamily("drops");
  ASSERT_TRUE(family.ok()) << family.status();
  EXPECT_THAT(family->parameter_space.names, ElementsAre("height"));
  EXPECT_THAT(family->parameter_space.points, ElementsAre(ElementsAre(1), ElementsAre(3)));
  EXPECT_EQ(family->parameter_space.interpolation, Interpolation::kSmooth);
  const auto empty = client_->GetFamily("empty");
  EXPECT_TRUE(empty->parameter_space.names.empty());
  EXPECT_EQ(empty->parameter_space.interpolation, Interpolation::kUnspecified);
}

TEST_F(ClientTest, AFamilyTellsHowItsTimesBlend) {
  const auto family = client_->GetFamily("drops");
  ASSERT_TRUE(family.ok()) << family.status();
  EXPECT_EQ(family->time_blending.kind, TimeBlending::Kind::kSquares);
  EXPECT_EQ(family->time_blending.rest_time_s, -0.5);
  EXPECT_EQ(family->time_blending.reason, "both fall");
  EXPECT_EQ(client_->GetFamily("empty")->time_blending.kind, TimeBlending::Kind::kUnspecified);
}

TEST_F(ClientTest, WatchReportsEveryChangeAndReturnsTheResult) {
  std::vector<std::string> stages;
  const auto operation = client_->WatchOperation("register-1", [&](const Operation& now) {
    stages.push_back(now.done ? "done" : now.progress.stage);
    return true;
  });
  ASSERT_TRUE(operation.ok()) << operation.status();
  EXPECT_THAT(stages, ElementsAre("registration", "done"));
  EXPECT_TRUE(operation->result.ok());
  ASSERT_TRUE(operation->family.has_value());
  EXPECT_EQ(operation->family->name, "families/drops");
  EXPECT_FALSE(operation->animation.has_value());
}

TEST_F(ClientTest, WatchGoesOnAfterALostConnection) {
  server_.BreakNextWatch();
  const auto operation = client_->WaitOperation("operations/import-1");
  ASSERT_TRUE(operation.ok()) << operation.status();
  EXPECT_TRUE(operation->done);
  EXPECT_EQ(server_.NumCalls("WatchOperation"), 2);
}

TEST_F(ClientTest, WatchStopsWhenTheCallerHasSeenEnough) {
  const auto operation =
      client_->WatchOperation("register-1", [](const Operation&) { return false; });
  EXPECT_EQ(operation.status().code(), absl::StatusCode::kCancelled);
}

// The server says that it goes on, and then nothing.
TEST_F(ClientTest, AWatchEndsAtItsTimeoutWhileTheServerIsSilent) {
  const auto all = [](const Operation&) { return true; };
  const absl::Time begin = absl::Now();
  const absl::Status status =
      client_->WatchOperation("endless-1", all, absl::Milliseconds(200)).status();
  EXPECT_EQ(status.code(), absl::StatusCode::kDeadlineExceeded) << status;
  EXPECT_THAT(std::string(status.message()),
              HasSubstr("the server at " + server_.target() +
                        " has not said that operations/endless-1 is done"));
  EXPECT_GE(absl::Now() - begin, absl::Milliseconds(190));
  EXPECT_TRUE(client_->WatchOperation("register-1", all, absl::Seconds(60)).ok());
}

TEST_F(ClientTest, AWatchEndsAtItsTimeoutWhileTheServerIsAway) {
  ConnectOptions options;
  options.target = server_.target();
  options.retry.initial_backoff = options.retry.max_backoff = absl::Hours(1);  // cut to a second
  const std::unique_ptr<Client> client = *Client::Connect(options);
  server_.FailNext("WatchOperation", 1000, absl::UnavailableError("going away"));
  const absl::Status status =
      client->WatchOperation("register-1", nullptr, absl::Seconds(1.9)).status();
  EXPECT_EQ(status.code(), absl::StatusCode::kDeadlineExceeded) << status;
  EXPECT_THAT(std::string(status.message()), HasSubstr("going away"));
}

TEST_F(ClientTest, AFailedOperationIsAnAnswerWithItsReason) {
  const auto operation = client_->WaitOperation("failed-1");
  ASSERT_TRUE(operation.ok()) << operation.status();
  EXPECT_EQ(operation->result.code(), absl::StatusCode::kDataLoss);
  EXPECT_EQ(operation->result.message(), "frame 12: edge 5-9 has one triangle");
}

TEST_F(ClientTest, OperationsAreListedGotAndCancelled) {
  const auto operations = client_->ListOperations();
  ASSERT_TRUE(operations.ok()) << operations.status();
  EXPECT_EQ(operations->size(), 4u);
  const auto one = client_->GetOperation("register-1");
  ASSERT_TRUE(one.ok()) << one.status();
  EXPECT_EQ(one->progress.iteration, 7);
  EXPECT_EQ(one->progress.num_inliers, 90);
  EXPECT_TRUE(client_->CancelOperation("register-1").ok());
  EXPECT_EQ(client_->CancelOperation("none").code(), absl::StatusCode::kNotFound);
}

}  // namespace
}  // namespace liquidblend::client_test
