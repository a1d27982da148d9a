#include "tests/core/store/sql/postgres_server.h"

#include <signal.h>
#include <unistd.h>

#include <cstdlib>
#include <memory>

#include "absl/strings/str_cat.h"
#include "absl/time/clock.h"
#include "core/store/sql/postgres.h"
#include "tests/paths.h"
#include "tests/process_state.h"

namespace liquidblend::store {
namespace {

constexpr absl::Duration kPatience = absl::Minutes(3);

std::unique_ptr<PostgresConnection> Connect(const std::string& url) {
  const auto target = ParsePostgresUrl(url, absl::Seconds(10));
  if (!target.ok()) return nullptr;
  auto connection = PostgresConnection::Open(*target, PostgresOptions());
  return connection.ok() ? *std::move(connection) : nullptr;
}

void AwaitState(pid_t process, const std::string& states) {
  while (states.find(StateOf(process)) == std::string::npos) absl::SleepFor(absl::Milliseconds(1));
}

}  // namespace

PostgresServer::PostgresServer() { Start(); }

PostgresServer::~PostgresServer() { Stop(); }

void PostgresServer::Start() {
  const std::string program = paths::Source("tests/postgres.sh");
  pid_ = fork();
  if (pid_ == 0) {
    sigset_t none;
    sigemptyset(&none);
    sigprocmask(SIG_SETMASK, &none, nullptr);
    // Nothing here needs to survive a loss of power.
    execl(program.c_str(), "postgres.sh", folder_.path().c_str(), "fsync=off", nullptr);
    _exit(127);
  }
  const absl::Time deadline = absl::Now() + kPatience;
  while (!IsReady()) {
    ASSERT_LT(absl::Now(), deadline) << ReadFile(folder_.path() + "/postgres.log");
    absl::SleepFor(absl::Milliseconds(20));
  }
}

bool PostgresServer::IsReady() const {
  return Connect(absl::StrCat("postgresql://liquidblend@/postgres?host=", folder_.path(),
                              "/sock")) != nullptr;
}

void PostgresServer::Stop() { End(SIGINT); }

// SIGQUIT, since backends would outlive a postmaster that gets SIGKILL for a while.
void PostgresServer::Crash() { End(SIGQUIT); }

void PostgresServer::Kill() {
  kill(pid_, SIGSTOP);
  AwaitState(pid_, "TZX");  // no more children
  const std::string id = absl::StrCat(pid_);
  std::ifstream file("/proc/" + id + "/task/" + id + "/children");
  std::vector<pid_t> processes;
  for (pid_t process = 0; file >> process;) processes.push_back(process);
  End(SIGKILL);
  for (const pid_t process : processes) kill(process, SIGKILL);
  // As long as one lives, another server does not start: they share memory.
  for (const pid_t process : processes) AwaitState(process, "ZX");
}

void PostgresServer::End(int signal) {
  if (pid_ == 0) return;
  kill(pid_, signal);
  WaitFor(pid_);
  pid_ = 0;
}

std::string PostgresServer::NewUrl() {
  const std::string schema = absl::StrCat("catalog_", ++num_schemas_);
  const std::string url =
      absl::StrCat("postgresql://liquidblend:secret@/postgres?host=", folder_.path(),
                   "/sock&options=-csearch_path%3D", schema);
  Run(url, "CREATE SCHEMA " + schema);
  return url;
}

std::string PostgresServer::Run(const std::string& url, const std::string& script) {
  const auto connection = Connect(url);
  std::string first;
  if (connection == nullptr) {
    ADD_FAILURE() << "cannot connect";
    return first;
  }
  EXPECT_THAT(connection->Run(script, {},
                              [&](const SqlRow& row) {
                                first = row.String(0);
                                return absl::OkStatus();
                              }),
              Succeeds());
  return first;
}

PostgresServer& SharedPostgresServer() {
  static PostgresServer server;
  return server;
}

}  // namespace liquidblend::store
