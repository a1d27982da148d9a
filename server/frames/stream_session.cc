#include "server/frames/stream_session.h"

#include <algorithm>
#include <utility>

#include "core/base/status_macros.h"
#include "server/base/errors.h"
#include "server/base/guarded.h"

namespace liquidblend::server {

template <typename Note>
void StreamSession::Leave(Note&& note) {
  {
    absl::MutexLock lock(&mutex_);
    note(inbox_);
  }
  WantStep();
}

void StreamSession::OnRequest(const v1::StreamFramesRequest& request) {
  Leave([&](Notes& inbox) {
    if (!inbox.newest.has_value()) inbox.newest.emplace();
    MergeRequest(request, *inbox.newest);
    ++inbox.num_newest;
  });
}

void StreamSession::OnHalfClosed() {
  Leave([](Notes& inbox) { inbox.is_half_closed = true; });
}

void StreamSession::OnWritten() {
  Leave([this](Notes& inbox) { inbox.written_at = host_->Now(); });
}

void StreamSession::Stop() {
  Leave([](Notes& inbox) { inbox.is_stopped = true; });
}

void StreamSession::WantStep() {
  {
    absl::MutexLock lock(&mutex_);
    if (std::exchange(is_step_wanted_, true) || is_stepping_) return;
  }
  // Post() refuses only after the server has ended all calls.
  const absl::Status posted = Guarded([this] {
    host_->Post([self = shared_from_this()] { self->TakeSteps(); });
    return absl::OkStatus();
  });
  if (posted.ok()) return;
  absl::MutexLock lock(&mutex_);
  is_step_wanted_ = false;  // so that the next note tries again
}

void StreamSession::TakeSteps() {
  bool has_step = true;
  while (has_step) {
    const absl::Status status = Guarded([this, &has_step] {
      has_step = BeginStep();
      return has_step ? Step() : absl::OkStatus();
    });
    if (!status.ok()) End(status);
  }
}

// Takes the notes from the inbox. Notes that a step does not use stay for the next one.
bool StreamSession::BeginStep() {
  absl::MutexLock lock(&mutex_);
  is_stepping_ = std::exchange(is_step_wanted_, false);
  if (!is_stepping_) return false;
  if (inbox_.newest.has_value()) {
    if (!notes_.newest.has_value()) notes_.newest.emplace();
    MergeRequest(*inbox_.newest, *notes_.newest);
    notes_.num_newest += inbox_.num_newest;
  }
  if (inbox_.found.has_value()) notes_.found = std::move(inbox_.found);
  if (inbox_.made.has_value()) {
    notes_.made = std::move(inbox_.made);
    notes_.made_number = inbox_.made_number;
  }
  if (inbox_.written_at.has_value()) notes_.written_at = inbox_.written_at;
  notes_.is_half_closed |= inbox_.is_half_closed;
  notes_.is_stopped |= inbox_.is_stopped;
  inbox_ = Notes();
  return true;
}

absl::Status StreamSession::Step() {
  if (notes_.is_stopped) {
    DropOrder();
    CancelAlarm();
    has_ended_ = true;
  }
  if (has_ended_) return absl::OkStatus();
  TakeWritten();
  LB_RETURN_IF_ERROR(TakeMade());
  LB_RETURN_IF_ERROR(TakeValues());
  if (!stream_.has_begun()) return absl::OkStatus();
  return GoOn(host_->Now());
}

void StreamSession::TakeWritten() {
  if (!notes_.written_at.has_value()) return;
  is_writing_ = false;
  stream_.OnWritten(*notes_.written_at - write_began_, *notes_.written_at);
  notes_.written_at.reset();
}

absl::Status StreamSession::TakeMade() {
  const std::optional<absl::StatusOr<FramePtr>> made = std::exchange(notes_.made, std::nullopt);
  if (!made.has_value() || !order_.has_value() || order_->number != notes_.made_number) {
    return absl::OkStatus();
  }
  order_->ticket = nullptr;
  LB_ASSIGN_OR_RETURN(order_->frame, *made);
  return absl::OkStatus();
}

// Takes new values of the client. They wait while a frame whose turn has come is being made: it
// counts as sent, and the next one shows them. Otherwise a client that changes values faster than
// frames are made would never see one.
absl::Status StreamSession::TakeValues() {
  if (order_.has_value() && order_->is_committed) return absl::OkStatus();
  if (waiting_request_.has_value()) {
    if (!notes_.found.has_value()) return absl::OkStatus();
    const absl::StatusOr<catalog::FamilyPtr> found = *std::exchange(notes_.found, std::nullopt);
    LB_RETURN_IF_ERROR(found.status());
    const v1::StreamFramesRequest request = *std::exchange(waiting_request_, std::nullopt);
    if (notes_.newest.has_value()) WantStep();  // which has come meanwhile
    return Change(request, *found);
  }
  if (!notes_.newest.has_value()) {
    if (!notes_.is_half_closed || stream_.has_begun()) return absl::OkStatus();
    return InvalidField("family", "must be named in the first message");
  }
  const v1::StreamFramesRequest request = *std::exchange(notes_.newest, std::nullopt);
  num_changes_ += notes_.num_newest;
  num_taken_ += std::exchange(notes_.num_newest, 0);
  LB_ASSIGN_OR_RETURN(const std::optional<std::string> id, stream_.FamilyToFind(request));
  if (!id.has_value()) return Change(request, nullptr);
  waiting_request_ = request;
  const auto self = shared_from_this();
  host_->FindFamily(*id, VersionOf(request), [self](absl::StatusOr<catalog::FamilyPtr> found) {
    self->Leave([&](Notes& inbox) { inbox.found = std::move(found); });
  });
  return absl::OkStatus();
}

absl::Status StreamSession::Change(const v1::StreamFramesRequest& request,
                                   catalog::FamilyPtr found) {
  num_shown_ = num_taken_;
  return stream_.Change(request, std::move(found), host_->Now());
}

absl::Status StreamSession::GoOn(absl::Duration now) {
  if (order_.has_value() && order_->is_committed) {
    return order_->frame == nullptr ? absl::OkStatus() : SendOrder(now);
  }
  if (WillStayWithoutCredit()) {
    if (!is_writing_) End(absl::OkStatus());
    return absl::OkStatus();
  }
  const std::optional<FramePacer::Tick> tick = stream_.Next(now);
  if (!tick.has_value()) {
    if (!is_writing_ && !waiting_request_.has_value()) End(absl::OkStatus());
    return absl::OkStatus();
  }
  const bool is_turn = tick->due <= now && !is_writing_ && stream_.has_credit();
  if (order_.has_value() && order_->key != KeyOf(*stream_.loaded(), stream_.QueryAt(*tick))) {
    DropOrder();  // made ahead for other values, or skipped
  }
  if (!order_.has_value() && (is_turn || MayMakeAhead())) StartOrder(*tick, now);
  if (is_turn) {
    order_->is_committed = true;
    if (order_->frame != nullptr) return SendOrder(now);
  } else if (tick->due > now) {
    WakeAt(tick->due, now);
  }
  return absl::OkStatus();
}

// The client gives no more credit after its last request.
bool StreamSession::WillStayWithoutCredit() const {
  return notes_.is_half_closed && !stream_.has_credit() && !notes_.newest.has_value() &&
         !waiting_request_.has_value();
}

bool StreamSession::MayMakeAhead() const {
  return num_changes_before_ == num_changes_ && stream_.num_skipped() == num_skipped_ &&
         !waiting_request_.has_value() && 2 * last_bytes_ <= host_->max_stream_bytes();
}

void StreamSession::StartOrder(const FramePacer::Tick& tick, absl::Duration now) {
  Order& order = order_.emplace(Order{});
  order.number = ++num_orders_;
  order.query = stream_.QueryAt(tick);
  order.key = KeyOf(*stream_.loaded(), order.query);
  FrameOrder asked;
  asked.loaded = stream_.loaded();
  asked.query = order.query;
  asked.client = client_;
  asked.is_paced = stream_.is_paced();
  asked.deadline = std::max(tick.due, now) + stream_.period();
  asked.is_refusable = num_orders_ == 1;
  if (num_orders_ == 1) asked.span = span_;  // a span for each frame would be too many
  const int64_t number = order.number;
  order.ticket = host_->Make(std::move(asked),
                             [self = shared_from_this(), number](absl::StatusOr<FramePtr> made) {
                               self->Leave([&](Notes& inbox) {
                                 if (inbox.made.has_value() && inbox.made_number > number) return;
                                 inbox.made = std::move(made);
                                 inbox.made_number = number;
                               });
                             });
}

void StreamSession::DropOrder() {
  if (order_.has_value()) host_->Leave(order_->ticket);
  order_.reset();
}

absl::Status StreamSession::SendOrder(absl::Duration now) {
  const std::shared_ptr<Sink> sink = sink_.lock();
  if (sink == nullptr) return absl::CancelledError("the connection has gone");
  LB_ASSIGN_OR_RETURN(FramePtr frame, host_->Hold(std::move(order_->frame), sink));
  last_bytes_ = static_cast<int64_t>(frame->size());
  StreamedFrame streamed = stream_.Sent(order_->query, std::move(frame));
  streamed.num_requests = num_shown_;
  order_.reset();
  const int64_t num_dropped = stream_.num_skipped() - num_skipped_;
  if (num_dropped > 0) {
    host_->CountDroppedFrames(stream_.loaded()->family.name, num_dropped);
  }
  Describe(streamed, num_dropped);
  num_changes_before_ = num_changes_;
  if (num_dropped > 0) num_changes_before_.reset();
  num_changes_ = 0;
  num_skipped_ = stream_.num_skipped();
  is_writing_ = true;
  write_began_ = now;
  sink->Send(streamed);
  WantStep();  // the next frame's
  return absl::OkStatus();
}

void StreamSession::Describe(const StreamedFrame& streamed, int64_t num_dropped) const {
  if (!span_.is_recording()) return;
  span_.SetAttribute("liquidblend.frames.sent", streamed.frame_index + 1);
  span_.SetAttribute("liquidblend.frames.skipped", streamed.num_dropped);
  if (num_dropped > 0) span_.AddEvent("frames skipped", {{"liquidblend.frames", num_dropped}});
}

// Sets the alarm. A step that comes too early only sets the next alarm, so one alarm at a time is
// enough: alarms of a client that changes its pace all the time must not accumulate.
void StreamSession::WakeAt(absl::Duration due, absl::Duration now) {
  {
    absl::MutexLock lock(&mutex_);
    if (alarm_ <= due) return;
    alarm_ = due;
  }
  host_->Cancel(alarm_timer_);
  alarm_timer_ = host_->StartTimer(due - now, [self = weak_from_this(), due] {
    const std::shared_ptr<StreamSession> session = self.lock();
    if (session == nullptr) return;
    {
      absl::MutexLock lock(&session->mutex_);
      if (session->alarm_ == due) session->alarm_ = absl::InfiniteDuration();
    }
    session->WantStep();
  });
}

// Cancels the alarm; otherwise its memory would be kept until it is due.
void StreamSession::CancelAlarm() {
  host_->Cancel(alarm_timer_);
  alarm_timer_ = nullptr;
}

void StreamSession::End(const absl::Status& status) {
  DropOrder();
  CancelAlarm();
  if (std::exchange(has_ended_, true)) return;
  if (const std::shared_ptr<Sink> sink = sink_.lock()) sink->End(status);
}

}  // namespace liquidblend::server
