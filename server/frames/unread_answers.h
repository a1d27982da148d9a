// Budget of memory for answers that clients have not read yet.
#pragma once

#include <cstdint>
#include <list>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "absl/base/thread_annotations.h"
#include "absl/status/statusor.h"
#include "absl/synchronization/mutex.h"
#include "absl/time/time.h"

namespace liquidblend::server {

// Options of UnreadAnswers.
struct UnreadAnswersOptions {
  int64_t max_bytes = int64_t{256} << 20;       // >= 1; a single answer may be larger
  absl::Duration patience = absl::Seconds(30);  // >= 0; with a reader, while memory is short
};

using AnswerPtr = std::shared_ptr<const std::string>;  // the bytes of a frame or another message

// Budget of the answers that are on their way to clients over gRPC, and of the frames over
// WebSockets. Without it, a client that asks for frames and never reads them would keep each in
// memory for as long as its connection lasts. (HTTP's other answers have a budget of their own, and
// end after a while.)
// An answer that goes to several readers, or that the cache has, counts once. If the budget is used
// up, accounts that hold less than an equal part of it still get answers, up to twice the budget in
// all. Readers that have kept an answer longer than the patience are ended while more than half of
// the budget is taken, the oldest first.
// Threads: safe.
class UnreadAnswers {
 public:
  // The call or connection that an answer is sent over.
  class Reader {
   public:
    virtual ~Reader() = default;
    // The account that its answers are charged to: the principal's key.
    virtual std::string account() const = 0;
    // Ends it, so that its answer is let go. Returns at once; called by any thread, perhaps twice.
    virtual void GiveUp() = 0;
  };

  explicit UnreadAnswers(const UnreadAnswersOptions& options = {})
      : state_(std::make_shared<State>(options)) {}

  // Returns the same answer, which counts until the last copy of the result is destroyed.
  //   answer  not empty
  //   now     on a clock that only goes forward
  // Errors: kUnavailable with google.rpc.RetryInfo and the reason TOO_MANY_ANSWERS.
  absl::StatusOr<AnswerPtr> Hold(AnswerPtr answer, const std::shared_ptr<Reader>& reader,
                                 absl::Duration now);

  int64_t num_bytes() const;  // that are held now

 private:
  // An answer that a reader has not read yet.
  struct Held {
    std::string account;
    AnswerPtr answer;
    std::weak_ptr<Reader> reader;
    absl::Duration since;
  };
  using HeldList = std::list<Held>;

  // Outlives this while answers are held.
  struct State {
    explicit State(const UnreadAnswersOptions& of) : options(of) {}
    bool HasRoomFor(const Held& wanted) const ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex);
    HeldList::iterator Add(Held added) ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex);
    void LetGo(HeldList::iterator held) ABSL_LOCKS_EXCLUDED(mutex);
    std::vector<std::weak_ptr<Reader>> FindStalled(absl::Duration now) const
        ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex);

    const UnreadAnswersOptions options;
    mutable absl::Mutex mutex;
    HeldList held ABSL_GUARDED_BY(mutex);  // the oldest first
    std::map<std::string, int64_t> bytes_of_account ABSL_GUARDED_BY(mutex);
    std::map<const std::string*, int> num_readers ABSL_GUARDED_BY(mutex);  // by answer
    int64_t num_bytes ABSL_GUARDED_BY(mutex) = 0;  // of all answers, each once
  };

  const std::shared_ptr<State> state_;
};

}  // namespace liquidblend::server
