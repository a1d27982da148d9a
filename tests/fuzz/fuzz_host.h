// The server around a stream as a fuzzer controls it: its clock, its executor and its answers.
#pragma once

#include <cstdint>
#include <deque>
#include <list>
#include <map>
#include <memory>
#include <string>
#include <utility>

#include "absl/status/status.h"
#include "server/frames/stream_host.h"

namespace liquidblend::fuzz {

// The family of this id: a few cells, two targets, a parameter, three levels of detail. Made once.
inline constexpr char kFuzzFamily[] = "drops";
catalog::FamilyPtr SmallFamily();

// Everything happens on the caller's thread, and only when the fuzzer asks for it. Ends the process
// if a stream breaks a promise: too many steps for one event, too many timers or orders, an order
// for a frame out of range.
class FuzzHost final : public server::StreamHost {
 public:
  // Steps that one event may cause.
  static constexpr int kMaxSteps = 32;
  static constexpr size_t kMaxTimers = 1;
  static constexpr size_t kMaxOrders = 2;

  absl::Duration Now() const override { return now_; }
  void Post(Task task) override { ready_.push_back(std::move(task)); }
  Timer StartTimer(absl::Duration delay, Task task) override;
  void Cancel(const Timer& timer) override;
  void FindFamily(const std::string& id, catalog::AskedVersion asked,
                  catalog::Families::Done done) override;
  Ticket Make(server::FrameOrder order, server::FrameMaker::Done done) override;
  void Leave(const Ticket& ticket) override;
  absl::StatusOr<server::FramePtr> Hold(
      server::FramePtr frame,
      const std::shared_ptr<server::UnreadAnswers::Reader>& /*reader*/) override {
    return frame;
  }
  int64_t max_stream_bytes() const override { return int64_t{16} << 20; }
  void CountDroppedFrames(const std::string& family, int64_t count) override;

  // Runs the tasks that are ready and the timers that are due, and what these post. Returns how
  // many.
  int RunReady();
  void Advance(absl::Duration by) { now_ += by; }

  // Answers the oldest search for a family: found if it is kFuzzFamily and `error` is OK.
  // False: nothing is searched for.
  bool AnswerSearch(const absl::Status& error = absl::OkStatus());
  // Answers the oldest order for a frame. False: there is none.
  bool AnswerOrder(const absl::Status& error = absl::OkStatus());

  // Whether searches and orders are answered before the call returns, as if all were in memory.
  void AnswerAtOnce(bool at_once) { is_at_once_ = at_once; }
  // Frames that are really sliced and encoded; the others are stubs.
  void MakeRealFrames(int count) { num_real_ = count; }
  // Forgets tasks, timers, searches and orders, as a server that stops.
  void Clear();

 private:
  struct Search {
    std::string id;
    catalog::Families::Done done;
  };
  struct Order {
    server::FrameOrder asked;
    server::FrameMaker::Done done;
  };
  using OrderPtr = std::shared_ptr<Order>;
  using TimerKey = std::pair<absl::Duration, int64_t>;  // when, and a number

  static absl::StatusOr<catalog::FamilyPtr> FamilyOf(const std::string& id);
  absl::StatusOr<server::FramePtr> FrameOf(const server::FrameOrder& asked);

  absl::Duration now_ = absl::Seconds(1'000'000);
  std::deque<Task> ready_;
  std::map<TimerKey, Task> timers_;
  int64_t num_timers_started_ = 0;
  std::deque<Search> searches_;
  std::list<OrderPtr> orders_;
  bool is_at_once_ = false;
  int num_real_ = 0;
};

}  // namespace liquidblend::fuzz
