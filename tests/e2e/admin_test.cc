// liquidblend-admin on real stores of both kinds: a data directory, and PostgreSQL with S3.
#include <signal.h>

#include <cstdlib>
#include <fstream>
#include <utility>

#include "tests/e2e/e2e_testing.h"
#include "tests/paths.h"

namespace liquidblend::e2e {
namespace {

using testing::HasSubstr;

class AdminTest : public E2eTest {
 protected:
  // A server on a data directory of its own.
  Process StartEmbedded(const std::string& directory, int num_workers) {
    Process server("liquidblend-server", {"--data", directory, "--listen", "127.0.0.1:0",
                                          "--workers", std::to_string(num_workers)});
    const std::string line = server.ReadLine();
    Connect(line.substr(line.rfind(' ') + 1));
    return server;
  }

  static void Stop(Process& server) {
    server.Signal(SIGTERM);
    EXPECT_EQ(server.Wait(), 0);
  }

  std::string Frame(int64_t version = 0) {
    grpc::ClientContext context;
    v1::GetFrameRequest request;
    request.set_family("families/balls");
    request.add_weights(0.5);
    request.set_time_s(0.1);
    request.set_version(version);
    v1::Frame frame;
    const grpc::Status status = stub_->GetFrame(&context, request, &frame);
    EXPECT_TRUE(status.ok()) << status.error_message();
    return frame.data();
  }

  // Exit code; `line` gets what it prints first.
  int Admin(const std::string& command, std::vector<std::string> arguments,
            std::string* line = nullptr) {
    arguments.insert(arguments.begin(), command);
    Process admin("liquidblend-admin", arguments, WithStore());
    const std::string first = admin.ReadLine();
    if (line != nullptr) *line = first;
    return admin.Wait();
  }

  std::vector<std::string> Shared(std::vector<std::string> more = {}) const {
    std::vector<std::string> arguments = StoreArguments();
    arguments.insert(arguments.end(), more.begin(), more.end());
    return arguments;
  }

  // The program as a shell takes it, with the shared store.
  std::string Quoted(const std::vector<std::string>& arguments) const {
    std::string text = "env ";
    for (const std::string& variable : WithStore()) {
      const size_t equals = variable.find('=');
      text += variable.substr(0, equals) + "='" + variable.substr(equals + 1) + "' ";
    }
    text += paths::Program("liquidblend-admin");
    for (const std::string& argument : arguments) text += " '" + argument + "'";
    return text;
  }
};

TEST_F(AdminTest, AStoreMovesToManyMachinesAndBackAndServesTheSameBytes) {
  const std::string one = data() + "/one";
  const std::string two = data() + "/two";
  const std::string exported = data() + "/exported";
  std::string frame, kept;  // of the published version, and of the one before
  {
    Process server = StartEmbedded(one, 1);
    ExpectSuccess(AwaitDone(ImportBall("a", 1.0).name()));
    ExpectSuccess(AwaitDone(ImportBall("b", 2.0).name()));
    ExpectSuccess(AwaitDone(ImportBall("c", 3.0).name()));
    for (const char* target : {"c", "b"}) {
      Operation registration;
      ASSERT_TRUE(Register(3, registration, {target}).ok());
      ExpectSuccess(AwaitDone(registration.name()));
      kept = std::exchange(frame, Frame());
    }
    Stop(server);
  }
  ASSERT_GT(frame.size(), 100);
  ASSERT_NE(frame, kept);
  const std::string program = paths::Program("liquidblend-admin") + " ";
  ASSERT_EQ(std::system((program + "export --data " + one + " " + exported).c_str()), 0);
  ASSERT_EQ(Admin("import", Shared({exported})), 0);
  {
    Process server = StartServer();
    EXPECT_TRUE(Frame() == frame);
    // Once more what is there: refused as a whole, and nothing is damaged by it.
    EXPECT_EQ(Admin("import", Shared({exported})), 1);
    std::string report;
    EXPECT_EQ(Admin("check", Shared({"--json"}), &report), 0);
    EXPECT_THAT(report, HasSubstr("\"damage\":[]"));
    EXPECT_EQ(Admin("collect", Shared({"--older-than", "0s", "--json"}), &report), 0);
    EXPECT_TRUE(Frame() == frame);
    EXPECT_TRUE(Frame(1) == kept);
    EXPECT_EQ(Admin("queue", Shared({"--json"}), &report), 0);
    EXPECT_THAT(report, HasSubstr("{\"counts\":{\"succeeded\":5}"));
    EXPECT_EQ(Admin("workers", Shared({"--json"}), &report), 0);
    EXPECT_EQ(report, "{\"workers\":[]}");
  }
  std::vector<std::string> arguments = Shared({"-"});
  arguments.insert(arguments.begin(), "export");
  ASSERT_EQ(
      std::system((Quoted(arguments) + " | " + program + "import --data " + two + " -").c_str()),
      0);
  EXPECT_EQ(std::system((program + "check --data " + two).c_str()), 0);
  Process server = StartEmbedded(two, 0);
  EXPECT_TRUE(Frame() == frame);
  EXPECT_TRUE(Frame(1) == kept);
}

TEST_F(AdminTest, TellsWhatIsWrongByItsExitCode) {
  const std::string program = paths::Program("liquidblend-admin") + " ";
  const auto run = [&](const std::string& arguments) {
    return WEXITSTATUS(std::system((program + arguments + " 2>/dev/null >/dev/null").c_str()));
  };
  EXPECT_EQ(run("--help"), 0);
  EXPECT_EQ(run("check --help"), 0);
  EXPECT_EQ(run(""), 2);
  EXPECT_EQ(run("plan --clients 100 --json"), 0);
  EXPECT_EQ(run("plan --cached 2"), 2);
  EXPECT_EQ(run("check"), 2);
  EXPECT_EQ(run("check --data " + data() + "/nothing"), 2);
  EXPECT_EQ(run("collect --data " + data() + " --older-than soon"), 2);
  EXPECT_EQ(run("queue --store postgresql://nobody@127.0.0.1:1/x --blobs s3://b/p --cache " +
                data() + "/cache"),
            3);
  std::ofstream(data() + "/catalog.sqlite") << "this is no database, whatever its name says, but "
                                               "some sentence of a hundred bytes and then some.";
  EXPECT_EQ(run("check --data " + data()), 7);
}

}  // namespace
}  // namespace liquidblend::e2e
