// Stands between programs and a server (a PostgreSQL, or one of ours): a network that stops, and a
// spy that knows when a statement comes by.
#pragma once

#include <atomic>
#include <functional>
#include <string>
#include <thread>
#include <vector>

#include "absl/base/thread_annotations.h"
#include "absl/synchronization/mutex.h"
#include "tests/core/store/blobs/loopback_listener.h"

namespace liquidblend::e2e {

// On any free port of 127.0.0.1.  Threads: safe.
class FaultProxy {
 public:
  // To the server behind a unix socket.
  explicit FaultProxy(const std::string& socket_path);
  // To the server that listens on this port of 127.0.0.1.
  explicit FaultProxy(int server_port);
  ~FaultProxy();
  FaultProxy(const FaultProxy&) = delete;
  FaultProxy& operator=(const FaultProxy&) = delete;

  int port() const { return listener_.port(); }

  // Nothing goes either way, and nobody hears of it; what is sent meanwhile arrives later.
  void Cut() { is_cut_ = true; }
  void Heal() { is_cut_ = false; }
  bool is_cut() const { return is_cut_; }

  // When bytes with these words come from a program for the number-th time, `before` is called,
  // then they go on, then `after` is called, before any answer goes back. From a thread of the
  // proxy's.
  void Once(const std::string& words, int number, std::function<void()> before,
            std::function<void()> after);
  // Whether that has happened.
  bool is_struck() const { return is_struck_; }

 private:
  struct Strike {
    std::string words;  // empty: never
    int number = 1;
    std::function<void()> before;
    std::function<void()> after;
  };

  explicit FaultProxy(std::function<int()> connect);
  void Serve();
  void Handle(int client);
  bool Forward(int from, int to, bool is_from_client);
  // Takes the strike, if these bytes are what it waits for.
  Strike StrikeAt(const std::string& bytes) ABSL_LOCKS_EXCLUDED(mutex_);

  const std::function<int()> connect_;  // a socket, or -1
  const store::LoopbackListener listener_;
  std::atomic<bool> is_cut_ = false;
  std::atomic<bool> is_over_ = false;
  std::atomic<bool> is_struck_ = false;
  absl::Mutex mutex_;
  Strike strike_ ABSL_GUARDED_BY(mutex_);
  std::thread thread_;
};

}  // namespace liquidblend::e2e
