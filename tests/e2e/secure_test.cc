// A server with TLS and tokens, and the command line that goes with it.
#include <unistd.h>

#include <algorithm>
#include <cstdlib>
#include <fstream>

#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "tests/client/run_command.h"
#include "tests/client/temp_files.h"
#include "tests/e2e/e2e_testing.h"
#include "tests/paths.h"
#include "tests/server/certificates.h"

namespace liquidblend::e2e {
namespace {

using liquidblend::testing::CommandResult;
using liquidblend::testing::RunLiquidblend;
using ::testing::HasSubstr;
using ::testing::StartsWith;

class SecureTest : public E2eTest {
 protected:
  std::string path(const std::string& name) const { return folder_.path() + "/" + name; }

  // Does what an operator does (docs/operations/tls-and-tokens.md): NAME.token is for the client as
  // it was written, and a whole file of tokens is returned.
  std::string MakeTokenFile(const std::string& name, const std::string& scopes) const {
    const std::string command = absl::StrCat("'", paths::Program("liquidblend-server"),
                                             "' --make-token ", name, " --scopes ", scopes, " >'",
                                             path("made"), "' 2>'", path(name + ".token"), "'");
    EXPECT_EQ(std::system(command.c_str()), 0);
    return liquidblend::testing::ReadBytes(path("made"));
  }

  // Its only entry.
  std::string MakeToken(const std::string& name, const std::string& scopes) const {
    const std::string made = MakeTokenFile(name, scopes);
    const size_t begin = made.find('{', 1);
    return made.substr(begin, made.rfind(']') - begin);
  }

  void WriteTokens(const std::string& entries) const {
    server::ReplaceFile(path("tokens.json"), absl::StrCat(R"({"principals": [)", entries, "]}"));
  }

  Process StartSecureServer(std::string& address) {
    const server::PemPair pair = authority_.Sign("the server");
    server::ReplaceFile(path("server.crt"), pair.certificate);
    server::ReplaceFile(path("server.key"), pair.key);
    server::ReplaceFile(path("ca.crt"), authority_.certificate());
    std::vector<std::string> arguments = StoreArguments();
    arguments.insert(arguments.end(),
                     {"--listen", "127.0.0.1:0", "--workers", "0", "--tls-cert", path("server.crt"),
                      "--tls-key", path("server.key"), "--tokens", path("tokens.json"),
                      "--import-root", "sims=" + folder_.path(), "--log-format", "json"});
    Process server("liquidblend-server", arguments, WithStore());
    const std::string line = server.ReadLine();
    EXPECT_THAT(line, StartsWith("listening on "));
    address = line.substr(std::min(line.size(), std::string("listening on ").size()));
    return server;
  }

  CommandResult Run(const std::string& address, const std::string& as,
                    const std::vector<std::string>& words) const {
    std::vector<std::string> arguments = {"--server", address, "--tls-ca", path("ca.crt")};
    if (!as.empty()) {
      arguments.insert(arguments.end(), {"--token-file", path(as + ".token")});
    }
    arguments.insert(arguments.end(), words.begin(), words.end());
    return RunLiquidblend(arguments);
  }

  const store::TemporaryFolder folder_;
  server::TestAuthority authority_{"an authority"};
};

TEST_F(SecureTest, ANewTokenComesWithAFileThatTheServerTakes) {
  server::ReplaceFile(path("tokens.json"), MakeTokenFile("studio", "frames,write"));
  std::string address;
  const Process server = StartSecureServer(address);
  const CommandResult listed = Run(address, "studio", {"list"});
  EXPECT_EQ(listed.exit_code, 0) << listed.err;
  EXPECT_EQ(Run(address, "", {"list"}).exit_code, 1);
  server::ReplaceFile(path("worded.token"), "token of 'studio': 123\n");
  const CommandResult worded = Run(address, "worded", {"list"});
  EXPECT_EQ(worded.exit_code, 2);
  EXPECT_THAT(worded.err, HasSubstr("worded.token: its first line must be the token alone"));
}

TEST_F(SecureTest, TheCommandLineGetsThroughWithCertificateAndToken) {
  const std::string viewer = MakeToken("viewer", "frames");
  WriteTokens(viewer);
  std::string address;
  const Process server = StartSecureServer(address);
  const CommandResult listed = Run(address, "viewer", {"list"});
  EXPECT_EQ(listed.exit_code, 0) << listed.err;
  const CommandResult nobody = Run(address, "", {"list"});
  EXPECT_EQ(nobody.exit_code, 1);
  EXPECT_THAT(nobody.err, HasSubstr("TOKEN_MISSING"));

  // The uploader's token counts as soon as the file has it, without a restart.
  const std::string uploader = MakeToken("uploader", "write");
  EXPECT_EQ(Run(address, "uploader", {"list"}).exit_code, 1);
  WriteTokens(absl::StrCat(viewer, ",", uploader));
  Await([&] { return Run(address, "uploader", {"list"}).exit_code == 0; });
}

// Each says the culprit and the next step in one line, which is all that is printed.
TEST_F(SecureTest, AConnectionThatFailsIsExplainedInOneSentence) {
  WriteTokens(MakeToken("viewer", "frames"));
  std::string secure;
  const Process server = StartSecureServer(secure);
  Process other("liquidblend-server",
                {"--data", path("other"), "--listen", "127.0.0.1:0", "--workers", "0"});
  const std::string plain = other.ReadLine().substr(std::string("listening on ").size());
  server::ReplaceFile(path("other.crt"), server::TestAuthority("another authority").certificate());
  const auto said = [](const std::string& address, const std::vector<std::string>& flags) {
    std::vector<std::string> arguments = {"--server", address, "--connect-timeout", "2"};
    arguments.insert(arguments.end(), flags.begin(), flags.end());
    arguments.push_back("list");
    const CommandResult result = RunLiquidblend(arguments);
    EXPECT_EQ(result.exit_code, 3) << result.err;
    return result.err;
  };
  EXPECT_THAT(said(secure, {}), HasSubstr("as a server does that wants TLS: give --tls-ca FILE"));
  EXPECT_THAT(said(plain, {"--tls-ca", path("ca.crt")}),
              HasSubstr("it answers without TLS: leave out --tls and --tls-ca"));
  const std::string untrusted = said(secure, {"--tls-ca", path("other.crt")});
  EXPECT_THAT(untrusted, HasSubstr("none of the trusted authorities has signed its certificate"));
  EXPECT_LE(std::count(untrusted.begin(), untrusted.end(), '\n'), 2) << untrusted;
  EXPECT_THAT(said(secure, {"--tls-ca", path("ca.crt"), "--tls-server-name", "elsewhere.example"}),
              HasSubstr("its certificate is for another name"));
  EXPECT_THAT(said("127.0.0.1:1", {}), HasSubstr("nothing listens there"));
  EXPECT_THAT(said("nowhere.invalid:1", {}), HasSubstr("no host of that name is known"));
}

TEST_F(SecureTest, ImportsFromTheServersOwnDiskNeedTheScopeAndStayBelowTheRoot) {
  WriteTokens(absl::StrCat(MakeToken("viewer", "frames"), ",", MakeToken("uploader", "write")));
  std::string address;
  const Process server = StartSecureServer(address);
  std::filesystem::create_directory(path("ball"));
  for (const NamedBytes& file : BallFiles(1.0)) {
    std::ofstream(path("ball/" + file.name), std::ios::binary) << file.bytes;
  }
  const std::vector<std::string> import = {"import", "a", "--from-server", "sims/ball"};
  const CommandResult denied = Run(address, "viewer", import);
  EXPECT_EQ(denied.exit_code, 1);
  EXPECT_THAT(denied.err, HasSubstr("lacks the scope write"));
  const CommandResult outside =
      Run(address, "uploader", {"import", "a", "--from-server", "sims/../ball"});
  EXPECT_EQ(outside.exit_code, 2);
  EXPECT_THAT(outside.err, HasSubstr("location"));
  const Process worker = StartWorker();
  const CommandResult done = Run(address, "uploader", import);
  EXPECT_EQ(done.exit_code, 0) << done.err;
  EXPECT_THAT(done.out, HasSubstr("animations/a: ready"));
  // A second sequence in the folder.
  std::filesystem::copy(path("ball/" + BallFiles(1.0)[0].name), path("ball/foam_0001.ply"));
  const CommandResult mixed =
      Run(address, "uploader", {"import", "b", "--from-server", "sims/ball"});
  EXPECT_EQ(mixed.exit_code, 1);
  EXPECT_THAT(mixed.err, HasSubstr("frames of two sequences"));
  const CommandResult chosen =
      Run(address, "uploader", {"import", "c", "--from-server", "sims/ball", "--pattern", "[!f]*"});
  EXPECT_EQ(chosen.exit_code, 0) << chosen.err;
  EXPECT_THAT(chosen.out, HasSubstr("animations/c: ready"));
}

TEST_F(SecureTest, AServerThatOthersCouldListenToDoesNotStart) {
  std::vector<std::string> arguments = StoreArguments();
  arguments.insert(arguments.end(), {"--listen", "0.0.0.0:0"});
  Process server("liquidblend-server", arguments, WithStore());
  EXPECT_EQ(server.ReadLine(), "");
  EXPECT_EQ(server.Wait(), 2);
}

}  // namespace
}  // namespace liquidblend::e2e
