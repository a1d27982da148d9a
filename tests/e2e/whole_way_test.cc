// Files in, blended frames out, through the real programs.
#include <signal.h>

#include <cmath>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <limits>
#include <string>

#include "absl/strings/str_cat.h"
#include "tests/e2e/e2e_testing.h"

namespace liquidblend::e2e {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::Not;

class WholeWayTest : public E2eTest {
 protected:
  WholeWayTest() { lease_ = "30s"; }  // no worker is lost here

  // Imports a and b, and registers them as balls.
  void MakeFamily() {
    const Operation a = ImportBall("a", 1.0);
    const Operation b = ImportBall("b", 2.0);
    ExpectSuccess(AwaitDone(a.name()));
    ExpectSuccess(AwaitDone(b.name()));
    Operation registration;
    const grpc::Status status = Register(5, registration);
    ASSERT_TRUE(status.ok()) << status.error_message();
    ExpectSuccess(AwaitDone(registration.name()));
  }

  v1::Frame GetFrame(double weight, double time_s) {
    grpc::ClientContext context;
    v1::GetFrameRequest request;
    request.set_family("families/balls");
    request.add_weights(weight);
    request.set_time_s(time_s);
    v1::Frame frame;
    const grpc::Status status = stub_->GetFrame(&context, request, &frame);
    EXPECT_TRUE(status.ok()) << status.error_message();
    return frame;
  }

  static double CentreX(const v1::Frame& frame) {
    return (frame.bounds().min().x() + frame.bounds().max().x()) / 2;
  }
};

TEST_F(WholeWayTest, TwoAnimationsBecomeClosedBlendedFrames) {
  Process server = StartServer(1);
  MakeFamily();
  for (const double weight : {-0.25, 0.0, 0.5, 1.0, 1.25}) {
    for (const double time_s : {0.0, 0.07, 2 / 24.0, 5 / 24.0}) {
      const v1::Frame frame = GetFrame(weight, time_s);
      const mesh::TriangleMesh mesh = Decode(frame.data());
      EXPECT_EQ(mesh.num_triangles(), frame.num_triangles());
      EXPECT_GT(mesh.num_triangles(), 100);
      EXPECT_TRUE(mesh::CheckClosed(mesh).closed()) << weight << " at " << time_s;
    }
  }
  // After 5 frames a has moved by 0.208 m, b by 0.417 m. 0.03 m: a fraction of an edge, which is
  // what five iterations and the grid of the space-time mesh leave.
  EXPECT_NEAR(CentreX(GetFrame(0.0, 5 / 24.0)), 0.208, 0.03);
  EXPECT_NEAR(CentreX(GetFrame(0.5, 5 / 24.0)), 0.312, 0.03);
  EXPECT_NEAR(CentreX(GetFrame(1.0, 5 / 24.0)), 0.417, 0.03);
}

// The floats of a binary PLY file's vertices, a row each.
std::vector<std::vector<float>> PlyVertices(const std::string& path, int floats_per_vertex) {
  std::ifstream file(path, std::ios::binary);
  const std::string bytes((std::istreambuf_iterator<char>(file)), {});
  const std::string element = "element vertex ";
  const size_t data = bytes.find("end_header\n") + 11;
  std::vector<std::vector<float>> rows(std::stoul(bytes.substr(bytes.find(element) + 15)));
  const size_t row_bytes = sizeof(float) * static_cast<size_t>(floats_per_vertex);
  for (size_t v = 0; v < rows.size(); ++v) {
    rows[v].resize(floats_per_vertex);
    std::memcpy(rows[v].data(), bytes.substr(data + v * row_bytes, row_bytes).data(), row_bytes);
  }
  return rows;
}

TEST_F(WholeWayTest, TheCommandWritesFinishedFramesOfAnyLevel) {
  Process server = StartServer(1);
  MakeFamily();
  size_t num_vertices = std::numeric_limits<size_t>::max();
  for (const char* level : {"0", "1", "2"}) {
    const std::string path = data() + "/frame.ply";
    Process command("liquidblend", {"--server", Address(), "frame", "balls", "-w", "0", "-t", "0.1",
                                    "-o", path, "--lod", level, "--smooth", "2", "--smooth-time",
                                    "1", "--normals", "--velocities"});
    ASSERT_EQ(command.Wait(), 0);
    const std::vector<std::vector<float>> vertices = PlyVertices(path, 9);
    EXPECT_LT(vertices.size(), num_vertices);
    num_vertices = vertices.size();
    for (const std::vector<float>& v : vertices) {
      EXPECT_NEAR(std::hypot(v[3], v[4], v[5]), 1.0, 0.02);  // 10 bits
      EXPECT_NEAR(v[6], 1.0, 0.1);                           // a moves with 1 m/s along x
      EXPECT_NEAR(std::hypot(v[7], v[8]), 0.0, 0.1);
    }
  }
  const v1::Frame frame = GetFrame(0.5, 0.1);
  EXPECT_GT(frame.num_vertices(), static_cast<int64_t>(num_vertices));
}

TEST_F(WholeWayTest, TheFileOfAFamilyIsDownloadedFromAnyStore) {
  Process server = StartServer(1);
  MakeFamily();
  const auto download = [this](const std::string& family, const std::string& path) {
    return Process("liquidblend", {"--server", Address(), "download", family, "-o", path}).Wait();
  };
  const std::string path = data() + "/balls.lbf";
  ASSERT_EQ(download("families/balls", path), 0);
  std::ifstream file(path, std::ios::binary);
  std::string head(8, '\0');
  file.read(head.data(), 8);
  EXPECT_EQ(head, "\x89LBFAM\r\n");  // docs/formats.md
  EXPECT_NE(download("families/none", data() + "/none.lbf"), 0);
  EXPECT_FALSE(std::filesystem::exists(data() + "/none.lbf"));
}

// What the command prints, whole.
std::string OutputOf(Process& command) {
  std::string text;
  for (std::string line = command.ReadLine(); !line.empty(); line = command.ReadLine()) {
    text += line + "\n";
  }
  EXPECT_EQ(command.Wait(), 0);
  return text;
}

TEST_F(WholeWayTest, AFamilyIsMadeAsAskedForAndTellsHowWellItShowsItsAnimations) {
  Process server = StartServer(1);
  ExpectSuccess(AwaitDone(ImportBall("a", 1.0).name()));
  ExpectSuccess(AwaitDone(ImportBall("b", 2.0).name()));
  const std::string address = Address();
  Process made("liquidblend", {"--server", address, "register", "balls", "--source", "a",
                               "--target", "b", "--iterations", "3", "--connectivity", "rebuilt",
                               "--droplet-vertices", "0", "--levels", "1", "--wait"});
  const std::string family = OutputOf(made);
  EXPECT_THAT(family, HasSubstr("level of detail 1"));
  EXPECT_THAT(family, Not(HasSubstr("level of detail 2")));
  EXPECT_THAT(family, HasSubstr("animations/a: rebuilt on a grid of "));
  EXPECT_THAT(family, HasSubstr("6 frames: distance 0.0"));
  EXPECT_THAT(family, HasSubstr("6 components of 6, 0 apart at most"));
  Process inspected("liquidblend", {"--server", address, "inspect", "families/balls"});
  EXPECT_EQ(OutputOf(inspected), family);
  Process refused("liquidblend", {"--server", address, "register", "balls", "--source", "a",
                                  "--target", "b", "--levels", "6"});
  EXPECT_NE(refused.Wait(), 0);
}

// Both balls move at a constant speed, so that each is where it is by weight 0 or 1, and between
// the two in between, however times blend.
TEST_F(WholeWayTest, TimesBlendAsAskedForUntilARefinementAsksForAnother) {
  Process server = StartServer(1);
  ExpectSuccess(AwaitDone(ImportBall("a", 1.0).name()));
  ExpectSuccess(AwaitDone(ImportBall("b", 2.0).name()));
  const std::string address = Address();
  Process made("liquidblend",
               {"--server", address, "register", "balls", "--source", "a", "--target", "b",
                "--time-blending", "squares", "--iterations", "5", "--wait"});
  EXPECT_THAT(OutputOf(made), HasSubstr("\n  times blend as squares of those since 0 s\n"));
  const auto expect_on_the_way = [&] {
    for (const double weight : {0.0, 0.5, 1.0}) {
      EXPECT_NEAR(CentreX(GetFrame(weight, 3 / 24.0)), (1 + weight) * 3 / 24.0, 0.03) << weight;
      EXPECT_NEAR(CentreX(GetFrame(weight, 5 / 24.0)), (1 + weight) * 5 / 24.0, 0.03) << weight;
      EXPECT_TRUE(mesh::CheckClosed(Decode(GetFrame(weight, 0.09).data())).closed()) << weight;
    }
  };
  expect_on_the_way();
  const auto refine = [&](const std::vector<std::string>& flags) {
    std::vector<std::string> arguments = {"--server", address,        "register", "balls",
                                          "--refine", "--iterations", "2",        "--wait"};
    arguments.insert(arguments.end(), flags.begin(), flags.end());
    Process refined("liquidblend", arguments);
    return OutputOf(refined);
  };
  EXPECT_THAT(refine({}), HasSubstr("times blend as squares"));
  expect_on_the_way();
  EXPECT_THAT(refine({"--time-blending", "linear"}), Not(HasSubstr("times blend")));
  expect_on_the_way();
  EXPECT_THAT(refine({"--time-blending", "auto"}),
              HasSubstr("\n  times blend linearly (b: no detached part of the source's first frame "
                        "falls)\n"));
  expect_on_the_way();
  EXPECT_THAT(refine({}), HasSubstr("times blend linearly (b: no detached part"));
}

TEST_F(WholeWayTest, APointInParameterSpaceIsTheSameFrameAsItsWeights) {
  Process server = StartServer(1);
  ExpectSuccess(AwaitDone(ImportBall("a", 1.0).name()));
  ExpectSuccess(AwaitDone(ImportBall("b", 2.0).name()));
  const std::string address = Address();
  Process made("liquidblend",
               {"--server", address, "register", "balls", "--source", "a", "--target", "b", "--at",
                "a:speed=1", "--at", "b:speed=2", "--iterations", "3", "--wait"});
  EXPECT_THAT(OutputOf(made), HasSubstr("animations/a at speed 1\n  animations/b at speed 2\n"));
  const auto frame = [&](const std::vector<std::string>& blend) {
    std::vector<std::string> arguments = {"--server", address, "frame", "balls",
                                          "-t",       "0.1",   "-o",    data() + "/frame.drc"};
    arguments.insert(arguments.end(), blend.begin(), blend.end());
    return Process("liquidblend", arguments).Wait();
  };
  const auto bytes = [&] {
    std::ifstream file(data() + "/frame.drc", std::ios::binary);
    return std::string((std::istreambuf_iterator<char>(file)), {});
  };
  ASSERT_EQ(frame({"-p", "speed=1.25"}), 0);
  const std::string by_parameters = bytes();
  EXPECT_FALSE(by_parameters.empty());
  EXPECT_EQ(by_parameters, GetFrame(0.25, 0.1).data());
  EXPECT_EQ(frame({"-p", "speed=2.5"}), 2);
  ASSERT_EQ(frame({"-p", "speed=2.5", "--extrapolate"}), 0);
  EXPECT_EQ(bytes(), GetFrame(1.5, 0.1).data());
}

// At 1.5 of 1, 2 and 3, linear interpolation has half of the first two, the quadratic through all
// three has 3/8, 3/4 and -1/8 of them. The source is the second one.
TEST_F(WholeWayTest, SmoothInterpolationBlendsAllAnimationsUntilARefinementAsksForAnother) {
  Process server = StartServer(1);
  for (const auto& [id, speed] : {std::pair("a", 1.0), std::pair("b", 2.0), std::pair("c", 3.0)}) {
    ExpectSuccess(AwaitDone(ImportBall(id, speed).name()));
  }
  const std::string address = Address();
  const auto register_balls = [&](const std::vector<std::string>& flags) {
    std::vector<std::string> arguments = {"--server", address,        "register", "balls",
                                          "--wait",   "--iterations", "5"};
    arguments.insert(arguments.end(), flags.begin(), flags.end());
    Process command("liquidblend", arguments);
    return OutputOf(command);
  };
  const auto frame = [&] {
    Process command("liquidblend", {"--server", address, "frame", "balls", "-p", "speed=1.5", "-t",
                                    "0.2", "-o", data() + "/frame.drc"});
    return OutputOf(command);
  };
  const std::string smooth = "\n  weights between these points are interpolated smoothly\n";
  EXPECT_THAT(
      register_balls({"--source", "b", "--target", "a", "--target", "c", "--at", "a:speed=1",
                      "--at", "b:speed=2", "--at", "c:speed=3", "--interpolation", "smooth"}),
      HasSubstr(smooth));
  const std::string first = frame();
  EXPECT_THAT(first, HasSubstr(", weights 0.375, -0.125, time 0.2 s: "));
  // A service that runs already may have had versions of this family before.
  const size_t name = first.find(" version ");
  ASSERT_NE(name, std::string::npos) << first;
  const int64_t version = std::stoll(first.substr(name + std::strlen(" version ")));
  EXPECT_THAT(register_balls({"--refine"}), HasSubstr(smooth));
  EXPECT_THAT(frame(), HasSubstr(absl::StrCat(" version ", version + 1,
                                              ", weights 0.375, -0.125, time 0.2 s: ")));
  EXPECT_THAT(register_balls({"--refine", "--interpolation", "linear"}), Not(HasSubstr(smooth)));
  EXPECT_THAT(frame(),
              HasSubstr(absl::StrCat(" version ", version + 2, ", weights 0.5, 0, time 0.2 s: ")));
}

TEST_F(WholeWayTest, TheCommandRefinesAFamilyWithCorrespondences) {
  Process server = StartServer(1);
  MakeFamily();
  const int64_t version = GetFrame(0.0, 0.0).version();
  const std::string path = data() + "/correspondences.json";
  // The tops of both balls after two frames.
  std::ofstream(path) << R"({"correspondences": [[{"hard": true,
      "source": {"position": [0.08333, 0, 0.5], "time_s": 0.08333},
      "target": {"position": [0.16667, 0, 0.5], "time_s": 0.08333}}]]})";
  Process command("liquidblend", {"--server", Address(), "register", "balls", "--refine",
                                  "--correspondences", path, "--wait"});
  ASSERT_EQ(command.Wait(), 0);
  grpc::ClientContext context;
  v1::GetFamilyRequest request;
  request.set_name("families/balls");
  v1::Family family;
  const grpc::Status status = stub_->GetFamily(&context, request, &family);
  ASSERT_TRUE(status.ok()) << status.error_message();
  EXPECT_EQ(family.version(), version + 1);
  ASSERT_EQ(family.reports(0).correspondences_size(), 1);
  const v1::CorrespondenceReport& report = family.reports(0).correspondences(0);
  EXPECT_EQ(report.outcome(), v1::CorrespondenceReport::KEPT);
  EXPECT_LT(report.residual_m(), 1e-4);
  EXPECT_EQ(report.correspondence().target().position().x(), 0.16667);
  EXPECT_NEAR(CentreX(GetFrame(1.0, 5 / 24.0)), 0.417, 0.03);
}

TEST_F(WholeWayTest, AStreamGivesTheWholeAnimation) {
  Process server = StartServer(1);
  MakeFamily();
  grpc::ClientContext context;
  auto stream = stub_->StreamFrames(&context);
  v1::StreamFramesRequest request;
  request.set_family("families/balls");
  request.add_weights(0.5);
  request.set_lossless(true);
  ASSERT_TRUE(stream->Write(request));
  stream->WritesDone();
  v1::StreamFramesResponse response;
  int num_frames = 0;
  while (stream->Read(&response)) {
    EXPECT_TRUE(mesh::CheckClosed(Decode(response.frame().data())).closed()) << num_frames;
    EXPECT_NEAR(response.frame().time_s(), num_frames / 24.0, 1e-9);
    ++num_frames;
  }
  EXPECT_TRUE(stream->Finish().ok());
  EXPECT_EQ(num_frames, 6);
}

TEST_F(WholeWayTest, ProgressNeverFallsAndEndsAtOne) {
  Process server = StartServer(1);
  ExpectSuccess(AwaitDone(ImportBall("a", 1.0).name()));
  ExpectSuccess(AwaitDone(ImportBall("b", 2.0).name()));
  Operation registration;
  ASSERT_TRUE(Register(20, registration).ok());
  double fraction = 0;
  const Operation done = Watch(registration.name(), [&](const Operation& operation) {
    EXPECT_GE(ProgressOf(operation).fraction(), fraction);
    fraction = ProgressOf(operation).fraction();
    return operation.done();
  });
  ExpectSuccess(done);
  EXPECT_EQ(fraction, 1.0);
  v1::Family family;
  ASSERT_TRUE(done.response().UnpackTo(&family));
  EXPECT_GE(family.version(), 1);  // a deleted family's numbers are not used again
  EXPECT_THAT(family.targets(), ElementsAre("animations/b"));
  EXPECT_GT(family.reports(0).num_iterations(), 0);
}

TEST_F(WholeWayTest, ProgressOfSeveralTargetsNeverFallsAndEndsAtOne) {
  Process server = StartServer(2);
  for (const std::string id : {"a", "b", "c"}) {
    ExpectSuccess(AwaitDone(ImportBall(id, id == "c" ? 0.0 : 1.0).name()));
  }
  Operation registration;
  ASSERT_TRUE(Register(20, registration, {"b", "c"}).ok());
  double fraction = 0;
  const Operation done = Watch(registration.name(), [&](const Operation& operation) {
    const v1::Progress progress = ProgressOf(operation);
    EXPECT_GE(progress.fraction(), fraction) << progress.DebugString();
    fraction = progress.fraction();
    return operation.done();
  });
  ExpectSuccess(done);
  EXPECT_EQ(fraction, 1.0);
  v1::Family family;
  ASSERT_TRUE(done.response().UnpackTo(&family));
  EXPECT_THAT(family.targets(), ElementsAre("animations/b", "animations/c"));
  EXPECT_EQ(NumOperations(), 4);
}

TEST_F(WholeWayTest, ABrokenFileIsRefusedByName) {
  Process server = StartServer(1);
  std::vector<NamedBytes> files = BallFiles(1.0);
  files[3].bytes = files[3].bytes.substr(0, files[3].bytes.size() / 2);
  Operation operation;
  ASSERT_TRUE(Upload("a", files, "", operation).ok());
  const Operation done = AwaitDone(operation.name());
  EXPECT_THAT(done.error().message(), HasSubstr(files[3].name));
}

TEST_F(WholeWayTest, ARepeatedRequestIdImportsOnce) {
  Process server = StartServer(1);
  Operation first;
  Operation second;
  ASSERT_TRUE(Upload("a", BallFiles(1.0), "once", first).ok());
  ASSERT_TRUE(Upload("a", BallFiles(1.0), "once", second).ok());
  EXPECT_EQ(first.name(), second.name());
  ExpectSuccess(AwaitDone(first.name()));
  EXPECT_THAT(AnimationNames(), ElementsAre("animations/a"));
}

TEST_F(WholeWayTest, ARunningRegistrationIsCancelled) {
  Process server = StartServer(1);
  ExpectSuccess(AwaitDone(ImportBall("a", 1.0).name()));
  ExpectSuccess(AwaitDone(ImportBall("b", 2.0).name()));
  Operation registration;
  ASSERT_TRUE(Register(LongWork(), registration).ok());
  Watch(registration.name(),
        [](const Operation& operation) { return ProgressOf(operation).iteration() > 0; });
  grpc::ClientContext context;
  google::longrunning::CancelOperationRequest request;
  request.set_name(registration.name());
  google::protobuf::Empty empty;
  ASSERT_TRUE(operations_->CancelOperation(&context, request, &empty).ok());
  EXPECT_EQ(AwaitDone(registration.name()).error().code(), grpc::StatusCode::CANCELLED);

  grpc::ClientContext get_context;
  v1::GetFamilyRequest get;
  get.set_name("families/balls");
  v1::Family family;
  ASSERT_TRUE(stub_->GetFamily(&get_context, get, &family).ok());
  EXPECT_EQ(family.version(), 0);
}

TEST_F(WholeWayTest, SigtermEndsServerAndWorkersAndLosesNoJob) {
  Operation registration;
  {
    Process server = StartServer(2);
    ExpectSuccess(AwaitDone(ImportBall("a", 1.0).name()));
    ExpectSuccess(AwaitDone(ImportBall("b", 2.0).name()));
    ASSERT_TRUE(Register(LongWork(), registration).ok());
    Watch(registration.name(),
          [](const Operation& operation) { return ProgressOf(operation).iteration() > 0; });
    const std::vector<pid_t> workers = ChildrenOf(server.pid());
    EXPECT_EQ(workers.size(), 2U);
    EXPECT_TRUE(std::ifstream(data() + "/server.port").good());
    server.Signal(SIGTERM);
    EXPECT_EQ(server.Wait(), 0);
    for (const pid_t worker : workers) EXPECT_FALSE(IsAlive(worker));
    EXPECT_FALSE(std::ifstream(data() + "/server.port").good());
  }
  Process server = StartServer(1);
  const Operation done = AwaitDone(registration.name());
  ExpectSuccess(done);
  EXPECT_EQ(ProgressOf(done).attempt(), 1);  // what was given back does not count
}

TEST_F(WholeWayTest, OneServerAtATimeHasADataDirectory) {
  Process first = StartServer();
  Process second("liquidblend-server", {"--data", data(), "--listen", "127.0.0.1:0"});
  EXPECT_EQ(second.ReadLine(), "");
  EXPECT_EQ(second.Wait(), 1);
  EXPECT_THAT(AnimationNames(), IsEmpty());  // the first one is well
}

// The catalog cuts longer leases; renewed every third of what was asked, they would lapse.
TEST_F(WholeWayTest, LeasesThatWouldLapseAreRefused) {
  for (const std::string lease : {"40m", "10ms"}) {
    Process server("liquidblend-server", {"--data", data(), "--listen", "127.0.0.1:0", "--workers",
                                          "0", "--worker-lease", lease});
    EXPECT_EQ(server.ReadLine(), "") << lease;
    EXPECT_EQ(server.Wait(), 2) << lease;
    Process worker("liquidblend-worker", {"--data", data(), "--once", "--lease", lease});
    EXPECT_EQ(worker.Wait(), 2) << lease;
  }
}

TEST_F(WholeWayTest, ThePortIsInTheDataDirectory) {
  Process server = StartServer();
  int port = 0;
  std::ifstream(data() + "/server.port") >> port;
  EXPECT_GT(port, 0);
  stub_ = v1::LiquidBlend::NewStub(
      grpc::CreateChannel("127.0.0.1:" + std::to_string(port), grpc::InsecureChannelCredentials()));
  EXPECT_THAT(AnimationNames(), IsEmpty());
}

}  // namespace
}  // namespace liquidblend::e2e
