// A tiny HTTP server for tests.
#pragma once

#include <functional>
#include <map>
#include <string>
#include <thread>

#include "absl/base/thread_annotations.h"
#include "absl/synchronization/mutex.h"
#include "tests/core/store/blobs/loopback_listener.h"

namespace liquidblend::store {

// On any free port of 127.0.0.1. Each connection has a thread of its own and carries one request.
class HttpFake {
 public:
  struct Request {
    std::string method;
    std::string path;                            // decoded
    std::map<std::string, std::string> query;    // decoded
    std::map<std::string, std::string> headers;  // names in lower case
    std::string body;
  };
  struct Answer {
    int status = 200;
    std::string body = {};
    std::string headers = {};  // lines, each with its end
  };
  class Connection {
   public:
    explicit Connection(int fd) : fd_(fd) {}
    // Announces the whole body, and sends so many bytes of it.
    void Send(const Answer& answer, size_t num_sent);
    // Returns whether the other side still listens.
    bool SendMore(const std::string& bytes);
    // Makes the end of the connection a reset.
    void Reset();

   private:
    const int fd_;
  };
  using RawHandler = std::function<void(Connection& connection, Request request)>;
  using Handler = std::function<Answer(const Request& request)>;

  // Called side by side.
  explicit HttpFake(RawHandler handler);
  // Called one at a time.
  explicit HttpFake(Handler handler);
  // Waits for the handlers.
  ~HttpFake();
  HttpFake(const HttpFake&) = delete;
  HttpFake& operator=(const HttpFake&) = delete;

  std::string url() const;  // without a slash at its end
  int num_requests();

 private:
  void Serve();
  void Handle(int fd);

  const RawHandler handler_;
  const LoopbackListener listener_;
  absl::Mutex mutex_;
  absl::Mutex handler_mutex_;
  int num_requests_ ABSL_GUARDED_BY(mutex_) = 0;
  std::thread thread_;
};

}  // namespace liquidblend::store
