// The HTTP port of the program itself: announced, written down, and closed in order.
#include <csignal>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <span>
#include <string>
#include <utility>

#include "absl/strings/numbers.h"
#include "tests/client/run_command.h"
#include "tests/e2e/e2e_testing.h"
#include "tests/server/http/http_client.h"
#include "worker/ingest/formats/readers.h"

namespace liquidblend::e2e {
namespace {

using ::testing::HasSubstr;
using ::testing::StartsWith;

class HttpTest : public E2eTest {
 protected:
  Process StartServer(const std::vector<std::string>& more, int num_workers = 0) const {
    std::vector<std::string> arguments = StoreArguments();
    arguments.insert(arguments.end(),
                     {"--listen", "127.0.0.1:0", "--workers", std::to_string(num_workers)});
    arguments.insert(arguments.end(), more.begin(), more.end());
    return Process("liquidblend-server", arguments, WithStore());
  }

  std::string PortFile() const { return data() + "/http.port"; }

  // The address for gRPC and the port of HTTP of a server that has just started.
  static std::pair<std::string, int> Listens(Process& server) {
    const std::string grpc = server.ReadLine(), http = server.ReadLine();
    int port = 0;
    EXPECT_TRUE(absl::SimpleAtoi(http.substr(http.rfind(':') + 1), &port)) << http;
    return {grpc.substr(grpc.rfind(' ') + 1), port};
  }

  // The family "balls".
  void RegisterBalls() {
    ExpectSuccess(AwaitDone(ImportBall("a", 1.0).name()));
    ExpectSuccess(AwaitDone(ImportBall("b", 2.0).name()));
    Operation registration;
    ASSERT_TRUE(Register(1, registration).ok());
    ExpectSuccess(AwaitDone(registration.name()));
  }
};

TEST_F(HttpTest, IsAnnouncedAndEndsInOrder) {
  Process server = StartServer({"--http", "127.0.0.1:0"});
  EXPECT_THAT(server.ReadLine(), StartsWith("listening on 127.0.0.1:"));
  const std::string line = server.ReadLine();
  EXPECT_THAT(line, StartsWith("http on 127.0.0.1:"));
  int port = 0;
  ASSERT_TRUE(absl::SimpleAtoi(line.substr(line.rfind(':') + 1), &port)) << line;
  if (HasDataDirectory()) {
    int written = 0;
    ASSERT_TRUE(std::ifstream(PortFile()) >> written);
    EXPECT_EQ(port, written);
  }
  http::HttpClient client(port);
  Await([&] { return client.Get("/readyz").code == 200; });  // not while it preloads families
  const std::string metrics = client.Get("/metrics").body;
  EXPECT_THAT(metrics, HasSubstr("process_resident_memory_bytes"));
  EXPECT_THAT(metrics, HasSubstr("liquidblend_disk_free_bytes{disk=\"" + data()));
  const std::string used = "liquidblend_heap_bytes{state=\"used\"} ";
  const size_t at = metrics.find(used);
  ASSERT_NE(at, std::string::npos);
  // A sanitizer's programs have a heap that tells nothing.
  if (std::getenv("LIQUIDBLEND_E2E_SANITIZER") == nullptr) {
    EXPECT_GT(std::strtod(metrics.c_str() + at + used.size(), nullptr), 1e5);
  }
  http::HttpClient stream(port);
  EXPECT_EQ(stream.Upgrade().code, 101);
  server.Signal(SIGTERM);
  EXPECT_EQ(stream.ReadMessage().close_code(), 1001);
  EXPECT_TRUE(client.IsClosed());
  EXPECT_EQ(server.Wait(), 0);
  EXPECT_FALSE(std::filesystem::exists(PortFile()));
}

std::span<const std::byte> BytesOf(const std::string& text) {
  return std::as_bytes(std::span(text.data(), text.size()));
}

TEST_F(HttpTest, AFrameIsTheSameSurfaceInEachFormat) {
  lease_ = "30s";
  Process server = StartServer({"--http", "127.0.0.1:0"}, /*num_workers=*/1);
  const std::pair<std::string, int> listens = Listens(server);
  Connect(listens.first);
  RegisterBalls();
  const auto get = [&](const std::string& extension) {
    const http::HttpReply reply =
        http::HttpClient(listens.second)
            .Get("/v1/families/balls/frame." + extension + "?weights=0.5&time=0.1");
    EXPECT_EQ(reply.code, 200) << extension << ": " << reply.body;
    return reply.body;
  };
  const mesh::TriangleMesh draco = Decode(get("drc"));
  const std::string ply = get("ply"), obj = get("obj");
  for (const auto& read : {ingest::ReadPly(BytesOf(ply)), ingest::ReadObj(BytesOf(obj))}) {
    ASSERT_TRUE(read.ok()) << read.status();
    EXPECT_EQ(read->num_triangles(), draco.num_triangles());
    EXPECT_NEAR(mesh::Volume(*read) / mesh::Volume(draco), 1.0, 1e-3);
    EXPECT_TRUE(read->vertices.rowwise().mean().isApprox(draco.vertices.rowwise().mean(), 1e-3f));
  }
  server.Signal(SIGTERM);
  EXPECT_EQ(server.Wait(), 0);
}

TEST_F(HttpTest, AFamilyIsTheSameJsonAsOfTheCommandLine) {
  lease_ = "30s";
  Process server = StartServer({"--http", "127.0.0.1:0"}, /*num_workers=*/1);
  const auto [target, port] = Listens(server);
  Connect(target);
  RegisterBalls();
  const auto inspected =
      liquidblend::testing::RunLiquidblend({"--server", target, "inspect", "balls", "--json"});
  EXPECT_EQ(inspected.exit_code, 0) << inspected.err;
  const auto printed = nlohmann::json::parse(inspected.out);
  EXPECT_TRUE(printed["reports"][0]["verdict"].contains("grade")) << printed;
  EXPECT_EQ(printed, nlohmann::json::parse(http::HttpClient(port).Get("/v1/families/balls").body));
  server.Signal(SIGTERM);
  EXPECT_EQ(server.Wait(), 0);
}

TEST_F(HttpTest, OtherMachinesAreLetInOnlyIfThatIsSaid) {
  EXPECT_EQ(StartServer({"--http", "0.0.0.0:0"}).Wait(), 2);
  Process server = StartServer({"--http", "0.0.0.0:0", "--insecure"});
  EXPECT_THAT(server.ReadLine(), StartsWith("listening on 127.0.0.1:"));
  EXPECT_THAT(server.ReadLine(), StartsWith("http on 0.0.0.0:"));
  server.Signal(SIGTERM);
  EXPECT_EQ(server.Wait(), 0);
}

TEST_F(HttpTest, AWrongOriginIsRefusedAtStart) {
  EXPECT_EQ(StartServer({"--http", "127.0.0.1:0", "--http-origin", "example.org"}).Wait(), 2);
}

}  // namespace
}  // namespace liquidblend::e2e
