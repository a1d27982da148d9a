#include "server/frames/get_frame.h"

#include <utility>

#include "absl/time/clock.h"
#include "core/base/status_macros.h"
#include "server/base/errors.h"
#include "server/base/guarded.h"
#include "server/base/names.h"
#include "server/base/work_pool.h"
#include "server/frames/find_family.h"
#include "server/frames/query_weights.h"

namespace liquidblend::server {
namespace {

// Deadline of a call's frame, from now on. It is the same for all calls, so that they are answered
// in the order in which they came.
constexpr absl::Duration kLoadPatience = absl::Milliseconds(100);

// Families in memory are found in less; that is no span.
constexpr absl::Duration kLongSearch = absl::Milliseconds(1);

void RecordSearch(absl::Time begin, const trace::Span& span) {
  if (!span.is_recording()) return;
  const absl::Time end = absl::Now();
  if (end - begin >= kLongSearch) span.RecordChild("find family", begin, end);
}

}  // namespace

std::shared_ptr<FrameCall> FrameCall::Start(Backends& backends, const v1::GetFrameRequest& request,
                                            std::string client, Done done, trace::Span span) {
  auto call =
      std::make_shared<FrameCall>(backends, std::move(client), std::move(done), std::move(span));
  call->Look(request);
  return call;
}

void FrameCall::Look(const v1::GetFrameRequest& request) {
  const absl::StatusOr<std::string> id = FamilyId("family", request.family());
  if (!id.ok()) return Finish(id.status());
  if (request.version() < 0) return Finish(InvalidField("version", "must not be negative"));
  if (request.min_version() < 0) {
    return Finish(InvalidField("min_version", "must not be negative"));
  }
  const auto self = shared_from_this();
  const absl::Time begin = span_.is_recording() ? absl::Now() : absl::Time();
  const auto go_on = [self, request, begin](const absl::StatusOr<catalog::FamilyPtr>& found) {
    RecordSearch(begin, self->span_);
    const absl::Status status =
        found.ok() ? Guarded([&] { return self->Order(request, *found); }) : found.status();
    if (!status.ok()) self->Finish(status);
  };
  FindFamily(backends_, *id, {request.version(), request.min_version()}, go_on);
}

absl::Status FrameCall::Order(const v1::GetFrameRequest& request, catalog::FamilyPtr loaded) {
  FrameOrder order;
  const AskedBlend blend = {request.weights(), request.parameters(), request.extrapolate()};
  LB_RETURN_IF_ERROR(SetWeights(*loaded, blend, order.query));
  order.query.time_s = request.time_s();
  order.query.encoding = request.encoding();
  order.query.surface = request.surface();
  LB_RETURN_IF_ERROR(CheckQuery(*loaded, order.query));
  order.loaded = std::move(loaded);
  order.client = client_;
  order.span = span_;
  order.deadline = SteadyNow() + kLoadPatience;
  {
    absl::MutexLock lock(&mutex_);
    if (done_ == nullptr) return absl::OkStatus();  // cancelled meanwhile
  }
  const auto finish = [self = shared_from_this(),
                       generation = order.loaded->generation](absl::StatusOr<FramePtr> made) {
    if (!made.ok()) return self->Finish(made.status());
    self->Finish(AnsweredFrame{*std::move(made), generation});
  };
  const FrameMaker::Ticket ticket = backends_.maker.Make(std::move(order), finish);
  bool is_over = false;
  {
    absl::MutexLock lock(&mutex_);
    is_over = done_ == nullptr;
    if (!is_over) ticket_ = ticket;
  }
  if (is_over) backends_.maker.Leave(ticket);
  return absl::OkStatus();
}

void FrameCall::Cancel() {
  FrameMaker::Ticket ticket;
  {
    absl::MutexLock lock(&mutex_);
    ticket = std::move(ticket_);
  }
  backends_.maker.Leave(ticket);
  Finish(absl::CancelledError("the client has cancelled the call, or its deadline has passed"));
}

void FrameCall::Finish(absl::StatusOr<AnsweredFrame> result) {
  Done done;
  {
    absl::MutexLock lock(&mutex_);
    std::swap(done, done_);
    ticket_ = nullptr;
  }
  if (done != nullptr) done(std::move(result));
}

}  // namespace liquidblend::server
