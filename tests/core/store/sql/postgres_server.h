// A PostgreSQL server of the test's own.
#pragma once

#include <sys/types.h>

#include <string>

#include "tests/core/store/store_testing.h"

namespace liquidblend::store {

// Runs until this is destroyed, or the process ends.  Threads: one at a time.
class PostgresServer {
 public:
  PostgresServer();
  ~PostgresServer();
  PostgresServer(const PostgresServer&) = delete;
  PostgresServer& operator=(const PostgresServer&) = delete;

  // A new schema, and the url of a catalog in it. The password in it is "secret".
  std::string NewUrl();

  // Runs statements past the catalog, as whoever NewUrl() says, and returns the first value of the
  // last one.
  std::string Run(const std::string& url, const std::string& script);

  void Start();
  void Stop();   // ends all connections
  void Crash();  // at once; the next start recovers from the log
  void Kill();   // likewise, by SIGKILL: the postmaster, then its processes
  std::string socket() const { return folder_.path() + "/sock/.s.PGSQL.5432"; }
  void Restart() {
    Stop();
    Start();
  }

 private:
  bool IsReady() const;
  void End(int signal);

  TemporaryFolder folder_;
  pid_t pid_ = 0;
  int num_schemas_ = 0;
};

// One for all tests of a process, which stops with it.
PostgresServer& SharedPostgresServer();

}  // namespace liquidblend::store
