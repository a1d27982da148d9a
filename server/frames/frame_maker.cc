#include "server/frames/frame_maker.h"

#include <algorithm>
#include <utility>

#include "absl/time/clock.h"
#include "core/base/status_macros.h"
#include "server/access/authorizer.h"
#include "server/base/guarded.h"

namespace liquidblend::server {

struct FrameMaker::Flight {
  FrameKey key;
  catalog::FamilyPtr loaded;
  FrameQuery query;
  std::atomic<bool> stop = false;  // nobody waits any more
  metrics::StopWatch wait;         // for its turn
  absl::Time begin;  // of its making; set by the thread that makes it, as what follows
  metrics::StageTimes times;
  // Guarded by the maker's mutex_.
  std::vector<Ticket> waiting;
  bool is_running = false;
};

class FrameMaker::Waiter {
 public:
  Waiter(Done when_done, trace::Span of_call) : done(std::move(when_done)), span(of_call) {}
  Done done;
  const trace::Span span;
  const absl::Time begin = span.is_recording() ? absl::Now() : absl::Time();
  FlightPtr flight;
  std::optional<FrameQueue::Place> place;  // of its turn, if it has one
};

namespace {

constexpr absl::Duration kShortestStage = absl::Microseconds(10);  // others had nothing to do

void Describe(const catalog::LoadedFamily& loaded, const trace::Span& span) {
  if (!span.is_recording()) return;
  span.SetAttribute("liquidblend.family", loaded.family.name);
  span.SetAttribute("liquidblend.family.version", loaded.family.version);
}

}  // namespace

// The stages of a frame that has been made, in a span of a call that has waited for it.
void FrameMaker::RecordStages(const Flight& flight, const Waiter& waiter) {
  const trace::Span& span = waiter.span;
  if (!span.is_recording()) return;
  const bool has_waited = waiter.begin < flight.begin;
  span.SetAttribute("liquidblend.frame.source", has_waited ? "made" : "shared");
  if (has_waited) span.RecordChild("queue", waiter.begin, flight.begin);
  absl::Time begin = flight.begin;
  const std::pair<const char*, absl::Duration> stages[] = {{"slice", flight.times.slice},
                                                           {"finish", flight.times.finish},
                                                           {"encode", flight.times.encode}};
  for (const auto& [name, duration] : stages) {
    if (duration >= kShortestStage) span.RecordChild(name, begin, begin + duration);
    begin += duration;
  }
}

FrameMaker::Ticket FrameMaker::Make(FrameOrder order, Done done) {
  uses_.Count(order.loaded->family.name);
  const FrameKey key = KeyOf(*order.loaded, order.query);
  absl::StatusOr<FramePtr> result = nullptr;
  auto ticket = std::make_shared<Waiter>(std::move(done), order.span);
  Describe(*order.loaded, order.span);
  {
    absl::MutexLock lock(&mutex_);
    result = cache_.Find(key);
    if (*result == nullptr) {
      const absl::Status joined = Join(std::move(order), key, ticket);
      if (joined.ok()) return ticket;
      result = joined;
    }
  }
  if (result.ok()) ticket->span.SetAttribute("liquidblend.frame.source", "cache");
  ticket->done(std::move(result));
  return nullptr;
}

// Adds a waiter to the frame's flight. Each waiter has a turn of its own, on its client's account,
// so nobody waits longer because others want the same frame.
absl::Status FrameMaker::Join(FrameOrder order, const FrameKey& key, const Ticket& ticket) {
  FlightPtr& flight = flights_[key.bytes()];
  if (flight == nullptr) {
    flight = std::make_shared<Flight>();
    flight->key = key;
    flight->loaded = order.loaded;
    flight->query = order.query;
  }
  ticket->flight = flight;
  flight->waiting.push_back(ticket);
  if (flight->is_running) return absl::OkStatus();
  FrameWork work;
  work.host = HostOfPeer(order.client);
  work.client = std::move(order.client);
  work.is_paced = order.is_paced;
  work.cost = ExpectedCells(*order.loaded, order.query);
  work.deadline = order.deadline;
  work.run = [this, joined = flight] { Run(joined); };
  absl::StatusOr<FrameQueue::Place> place = pool_.Post(std::move(work), order.is_refusable);
  if (place.ok()) {
    ticket->place = *std::move(place);
  } else {
    Remove(ticket);
  }
  return place.status();
}

void FrameMaker::Leave(const Ticket& ticket) {
  if (ticket == nullptr) return;
  absl::MutexLock lock(&mutex_);
  if (ticket->place.has_value()) pool_.Cancel(*ticket->place);
  Remove(ticket);
}

void FrameMaker::Remove(const Ticket& ticket) {
  const FlightPtr flight = ticket->flight;
  std::erase(flight->waiting, ticket);
  if (!flight->waiting.empty()) return;
  flight->stop = true;
  EraseFlight(flight);
}

// Removes the flight; later orders start a new one.
void FrameMaker::EraseFlight(const FlightPtr& flight) {
  const auto found = flights_.find(flight->key.bytes());
  if (found != flights_.end() && found->second == flight) flights_.erase(found);
}

void FrameMaker::Run(const FlightPtr& flight) {
  {
    absl::MutexLock lock(&mutex_);
    if (flight->is_running || flight->waiting.empty()) return;
    flight->is_running = true;
  }
  metrics_.ObserveStage(metrics::Stage::kQueue, flight->wait.Lap());
  flight->begin = absl::Now();
  const absl::StatusOr<FramePtr> result = Guarded([&] { return MakeMessage(*flight); });
  std::vector<Ticket> waiting;
  {
    absl::MutexLock lock(&mutex_);
    // If there is no memory for the cache, the waiting calls still get the frame.
    if (result.ok()) RunGuarded("frame cache", [&] { cache_.Insert(flight->key, *result); });
    waiting.swap(flight->waiting);
    EraseFlight(flight);
    for (const Ticket& ticket : waiting) {
      if (ticket->place.has_value()) pool_.Cancel(*ticket->place);
    }
  }
  for (const Ticket& ticket : waiting) {
    if (result.ok()) RecordStages(*flight, *ticket);
    RunGuarded("a frame's call", [&] { ticket->done(result); });
  }
}

absl::StatusOr<FramePtr> FrameMaker::MakeMessage(Flight& flight) {
  std::unique_ptr<FrameBuffers> buffers = buffer_pool_.Take();
  buffers->surface.stop = &flight.stop;
  buffers->surface.helpers = &pool_;
  const absl::StatusOr<v1::Frame> frame = MakeFrame(*flight.loaded, flight.query, *buffers);
  buffers->surface.stop = nullptr;
  buffers->surface.helpers = nullptr;
  if (frame.ok()) CountFrame(*flight.loaded, flight.query, *frame, *buffers, metrics_);
  if (frame.ok()) flight.times = buffers->times;
  buffer_pool_.GiveBack(std::move(buffers));
  LB_RETURN_IF_ERROR(frame.status());
  return std::make_shared<const std::string>(frame->SerializeAsString());
}

}  // namespace liquidblend::server
