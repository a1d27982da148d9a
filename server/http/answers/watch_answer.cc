#include "server/http/answers/watch_answer.h"

#include <memory>
#include <utility>

#include "absl/base/thread_annotations.h"
#include "absl/strings/str_cat.h"
#include "absl/synchronization/mutex.h"
#include "server/base/errors.h"
#include "server/http/answers/method_answer.h"
#include "server/http/exchange/line_source.h"
#include "server/http/exchange/replies.h"
#include "server/transcode/json.h"

namespace liquidblend::http {
namespace {

using server::SeenOperationPtr;
using transcode::JsonLayout;

std::string ErrorLine(const absl::Status& error) {
  return absl::StrCat("{\"error\":", ErrorJson(error, JsonLayout::kOneLine), "}\n");
}

// The operation's line, which all of its watchers share.
std::string LineOf(const server::SeenOperation& seen) {
  return seen.text.Of([&] {
    const auto json = transcode::JsonOf(seen.operation, JsonLayout::kOneLine);
    return json.ok() ? *json + "\n" : ErrorLine(json.status());
  });
}

class OperationLines final : public LineSource,
                             public std::enable_shared_from_this<OperationLines> {
 public:
  // `permit` is held as long as this.
  OperationLines(server::Api::NextOperation next, SeenOperationPtr first,
                 server::StreamPermit permit)
      : next_(std::move(next)), first_(std::move(first)), permit_(std::move(permit)) {}

  void Next(Done done) override {
    if (is_over_) return done(std::nullopt);
    {
      absl::MutexLock lock(&mutex_);
      done_ = std::move(done);
    }
    if (first_ != nullptr) return Give(std::exchange(first_, nullptr));
    if (has_stopped()) return Give(server::ShuttingDown());
    next_([self = shared_from_this()](absl::StatusOr<SeenOperationPtr> seen) {
      self->Give(std::move(seen));
    });
  }

  void Stop() override {
    {
      absl::MutexLock lock(&mutex_);
      has_stopped_ = true;
    }
    Give(server::ShuttingDown());
  }

 private:
  bool has_stopped() {
    absl::MutexLock lock(&mutex_);
    return has_stopped_;
  }

  // To whoever waits for it. The answer to a look that Stop() came before is dropped.
  void Give(const absl::StatusOr<SeenOperationPtr>& seen) {
    Done done;
    {
      absl::MutexLock lock(&mutex_);
      done = std::exchange(done_, nullptr);
    }
    if (done == nullptr) return;
    is_over_ = !seen.ok() || (*seen)->operation.done();
    done(seen.ok() ? LineOf(**seen) : ErrorLine(seen.status()));
  }

  const server::Api::NextOperation next_;
  SeenOperationPtr first_;  // not given yet
  const server::StreamPermit permit_;
  bool is_over_ = false;  // the last line was given
  absl::Mutex mutex_;
  bool has_stopped_ ABSL_GUARDED_BY(mutex_) = false;
  Done done_ ABSL_GUARDED_BY(mutex_);  // of who waits
};

Response LinesReply(std::shared_ptr<LineSource> lines) {
  Response response;
  response.headers = {
      {"Content-Type", "application/x-ndjson"},
      {"Cache-Control", "no-store"},
      {"X-Accel-Buffering", "no"}};  // a proxy that waits for more shows no progress
  response.lines = std::move(lines);
  return response;
}

}  // namespace

void AnswerWatch(server::Api& api, const ExchangePtr& exchange) {
  v1::WatchOperationRequest request;
  const absl::Status read = ReadMethodRequest(*exchange, /*body=*/"", request);
  if (!read.ok()) return exchange->Fail(read);
  exchange->resource = server::ResourceOf(request);
  auto next = api.WatchOperation(request.name(), [cancellation = exchange->cancellation] {
    return !cancellation->is_cancelled();
  });
  next([exchange, next](absl::StatusOr<SeenOperationPtr> seen) {
    if (!seen.ok()) return exchange->Fail(seen.status());
    auto permit = std::exchange(exchange->permit, nullptr);
    exchange->Finish(
        LinesReply(std::make_shared<OperationLines>(next, *std::move(seen), std::move(permit))));
  });
}

}  // namespace liquidblend::http
