// The HTTP port of the program itself: announced, written down, and closed in order.
#include <csignal>
#include <filesystem>
#include <fstream>

#include "absl/strings/strip.h"
#include "tests/core/store/store_testing.h"
#include "tests/e2e/process.h"
#include "tests/server/http/http_client.h"

namespace liquidblend::e2e {
namespace {

using testing::HasSubstr;
using testing::StartsWith;

class HttpTest : public testing::Test {
 protected:
  Process StartServer(const std::vector<std::string>& more = {}) {
    std::vector<std::string> arguments = {"--data",      folder_.path(), "--listen",
                                          "127.0.0.1:0", "--workers",    "0",
                                          "--http",      "127.0.0.1:0"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    return Process("liquidblend-server", arguments);
  }

  std::string PortFile() const { return folder_.path() + "/http.port"; }

  store::TemporaryFolder folder_;
};

TEST_F(HttpTest, IsAnnouncedAndEndsInOrder) {
  Process server = StartServer();
  EXPECT_THAT(server.ReadLine(), StartsWith("listening on 127.0.0.1:"));
  const std::string line = server.ReadLine();
  EXPECT_THAT(line, StartsWith("http on 127.0.0.1:"));
  int port = 0;
  ASSERT_TRUE(std::ifstream(PortFile()) >> port);
  EXPECT_EQ(line, absl::StrCat("http on 127.0.0.1:", port));
  http::HttpClient client(port);
  EXPECT_EQ(client.Get("/readyz").code, 200);
  EXPECT_THAT(client.Get("/metrics").body, HasSubstr("process_resident_memory_bytes"));
  http::HttpClient stream(port);
  EXPECT_EQ(stream.Upgrade().code, 101);
  server.Signal(SIGTERM);
  EXPECT_EQ(stream.ReadMessage().close_code(), 1001);
  EXPECT_TRUE(client.IsClosed());
  EXPECT_EQ(server.Wait(), 0);
  EXPECT_FALSE(std::filesystem::exists(PortFile()));
}

TEST_F(HttpTest, OtherMachinesAreLetInOnlyIfThatIsSaid) {
  std::vector<std::string> arguments = {
      "--data", folder_.path(), "--listen", "127.0.0.1:0", "--workers", "0", "--http", "0.0.0.0:0"};
  EXPECT_EQ(Process("liquidblend-server", arguments).Wait(), 1);
  arguments.push_back("--insecure");
  Process server("liquidblend-server", arguments);
  EXPECT_THAT(server.ReadLine(), StartsWith("listening on 127.0.0.1:"));
  EXPECT_THAT(server.ReadLine(), StartsWith("http on 0.0.0.0:"));
  server.Signal(SIGTERM);
  EXPECT_EQ(server.Wait(), 0);
}

TEST_F(HttpTest, AWrongOriginIsRefusedAtStart) {
  EXPECT_EQ(StartServer({"--http-origin", "example.org"}).Wait(), 1);
}

}  // namespace
}  // namespace liquidblend::e2e
