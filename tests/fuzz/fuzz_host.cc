#include "tests/fuzz/fuzz_host.h"

#include <algorithm>
#include <cmath>

#include "absl/strings/str_cat.h"
#include "tests/fuzz/require.h"
#include "tests/synthetic/families.h"

namespace liquidblend::fuzz {
namespace {

constexpr int kFrames = 6;
constexpr int kLevels = 3;

mesh::RegisteredFamily MakeLevel(int cells_per_side) {
  synthetic::ComplexOptions options;
  options.num_frames = kFrames;
  options.growth_per_frame = 0.05F;
  return synthetic::MakeFamily(
      synthetic::MixedSphere(cells_per_side, options),
      {{synthetic::SmoothWarp(1, 0.1F, 0.3F), {}}, {synthetic::SmoothWarp(2, 0.1F, 0.3F), {}}});
}

catalog::FamilyPtr MakeSmallFamily() {
  mesh::RegisteredFamily family = MakeLevel(kLevels);
  for (int k = kLevels - 1; k > 0; --k) family.coarser_levels.push_back(MakeLevel(k));
  family.name = kFuzzFamily;
  family.source = std::string("a");
  family.targets[0].name = std::string("b");
  family.targets[1].name = std::string("c");
  family.parameter_space = {{"width", "height"}, {{0, 0}, {1, 0}, {0, 1}}};
  parameters::Interpolator space = *parameters::Interpolator::Make(family.parameter_space);
  return std::make_shared<catalog::LoadedFamily>(std::move(family), std::move(space));
}

bool IsInRange(const server::FrameOrder& asked) {
  const mesh::RegisteredFamily& family = asked.loaded->family;
  const server::FrameQuery& query = asked.query;
  return server::CheckQuery(*asked.loaded, query).ok() && query.time_s >= 0 &&
         query.time_s <= family.duration_s() &&
         std::all_of(query.weights.begin(), query.weights.end(),
                     [](double weight) { return std::isfinite(weight); });
}

}  // namespace

catalog::FamilyPtr SmallFamily() {
  static const auto& family = *new catalog::FamilyPtr(MakeSmallFamily());
  return family;
}

server::StreamHost::Timer FuzzHost::StartTimer(absl::Duration delay, Task task) {
  Require(delay > absl::ZeroDuration(), "a stream sets no timer for the past");
  const TimerKey key = {now_ + delay, ++num_timers_started_};
  timers_.emplace(key, std::move(task));
  Require(timers_.size() <= kMaxTimers, "a stream has a bounded number of timers");
  return std::make_shared<TimerKey>(key);
}

void FuzzHost::Cancel(const Timer& timer) {
  if (timer != nullptr) timers_.erase(*std::static_pointer_cast<TimerKey>(timer));
}

void FuzzHost::FindFamily(const std::string& id, catalog::AskedVersion /*asked*/,
                          catalog::Families::Done done) {
  if (is_at_once_) return done(FamilyOf(id));
  searches_.push_back({id, std::move(done)});
  Require(searches_.size() == 1, "a stream searches for one family at a time");
}

server::StreamHost::Ticket FuzzHost::Make(server::FrameOrder order, server::FrameMaker::Done done) {
  Require(IsInRange(order), "a stream orders frames within their limits");
  Require(order.deadline > now_, "a frame is not late when it is ordered");
  if (is_at_once_) {
    done(FrameOf(order));
    return nullptr;
  }
  auto ticket = std::make_shared<Order>(Order{std::move(order), std::move(done)});
  orders_.push_back(ticket);
  Require(orders_.size() <= kMaxOrders, "a stream has a bounded number of orders");
  return ticket;
}

void FuzzHost::Leave(const Ticket& ticket) {
  if (ticket != nullptr) std::erase(orders_, std::static_pointer_cast<Order>(ticket));
}

void FuzzHost::CountDroppedFrames(const std::string& family, int64_t count) {
  Require(family == kFuzzFamily && count > 0, "dropped frames are counted by family");
}

int FuzzHost::RunReady() {
  int num_steps = 0;
  while (true) {
    while (!timers_.empty() && timers_.begin()->first.first <= now_) {
      ready_.push_back(std::move(timers_.extract(timers_.begin()).mapped()));
    }
    if (ready_.empty()) return num_steps;
    Task task = std::move(ready_.front());
    ready_.pop_front();
    task();
    // A timer that comes too early costs a step and sets another one.
    Require(++num_steps <= kMaxSteps + static_cast<int>(2 * kMaxTimers),
            "an event causes a bounded number of steps");
  }
}

bool FuzzHost::AnswerSearch(const absl::Status& error) {
  if (searches_.empty()) return false;
  Search search = std::move(searches_.front());
  searches_.pop_front();
  search.done(error.ok() ? FamilyOf(search.id) : error);
  return true;
}

bool FuzzHost::AnswerOrder(const absl::Status& error) {
  if (orders_.empty()) return false;
  const OrderPtr order = std::move(orders_.front());
  orders_.pop_front();
  order->done(error.ok() ? FrameOf(order->asked) : error);
  return true;
}

void FuzzHost::Clear() {
  ready_.clear();
  timers_.clear();
  searches_.clear();
  orders_.clear();
}

absl::StatusOr<catalog::FamilyPtr> FuzzHost::FamilyOf(const std::string& id) {
  if (id == kFuzzFamily) return SmallFamily();
  return absl::NotFoundError(absl::StrCat("no family ", id));
}

absl::StatusOr<server::FramePtr> FuzzHost::FrameOf(const server::FrameOrder& asked) {
  v1::Frame frame;
  if (num_real_ > 0) {
    --num_real_;
    server::FrameBuffers buffers;
    absl::StatusOr<v1::Frame> made = server::MakeFrame(*asked.loaded, asked.query, buffers);
    Require(made.ok(), "a frame whose query is valid can be made");
    frame = *std::move(made);
  }
  frame.set_time_s(asked.query.time_s);
  return std::make_shared<const std::string>(frame.SerializeAsString());
}

}  // namespace liquidblend::fuzz
