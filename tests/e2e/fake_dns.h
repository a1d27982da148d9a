// Name server of the test's own: every name has the IPv4 addresses that the test says.
#pragma once

#include <string>
#include <thread>
#include <vector>

#include "absl/base/thread_annotations.h"
#include "absl/synchronization/mutex.h"

namespace liquidblend::e2e {

// Listens on a free UDP port of 127.0.0.1.  Threads: safe.
class FakeDns {
 public:
  explicit FakeDns(std::vector<std::string> addresses);
  ~FakeDns();
  FakeDns(const FakeDns&) = delete;
  FakeDns& operator=(const FakeDns&) = delete;

  // From the next question on. Answers may not be kept.
  void SetAddresses(std::vector<std::string> addresses);

  // The gRPC target of a name that is looked up here.
  std::string Target(const std::string& name, int port) const;

 private:
  void Serve();
  std::string AnswerTo(const std::string& question);

  int socket_ = -1;
  int port_ = 0;
  absl::Mutex mutex_;
  std::vector<std::string> addresses_ ABSL_GUARDED_BY(mutex_);
  std::thread thread_;
};

}  // namespace liquidblend::e2e
