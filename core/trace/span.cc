#include "core/trace/span.h"

#include <algorithm>
#include <exception>

#include "absl/time/clock.h"

namespace liquidblend::trace {
namespace {

// Runs work() and drops it if there is no memory for it.
template <typename Work>
void Quietly(Work&& work) noexcept {
  try {
    work();
  } catch (const std::exception&) {
    // A span that is missing harms nobody.
  }
}

std::string Cut(absl::string_view text) { return std::string(text.substr(0, Span::kMaxTextBytes)); }

AttributeValue Cut(AttributeValue value) {
  if (auto* const text = std::get_if<std::string>(&value)) {
    if (text->size() > Span::kMaxTextBytes) text->resize(Span::kMaxTextBytes);
  }
  return value;
}

void Set(absl::string_view name, AttributeValue value, SpanRecord& record) {
  Attributes& all = record.attributes;
  const auto same = std::find_if(all.begin(), all.end(),
                                 [&](const auto& attribute) { return attribute.first == name; });
  if (same != all.end()) {
    same->second = Cut(std::move(value));
  } else if (all.size() < Span::kMaxAttributes) {
    all.emplace_back(Cut(name), Cut(std::move(value)));
  } else {
    ++record.num_dropped_attributes;
  }
}

void Add(absl::string_view name, Attributes attributes, SpanRecord& record) {
  if (record.events.size() >= Span::kMaxEvents) {
    ++record.num_dropped_events;
    return;
  }
  SpanEvent event = {Cut(name), absl::Now(), {}};
  attributes.resize(std::min(attributes.size(), Span::kMaxEventAttributes));
  for (auto& [key, value] : attributes) event.attributes.emplace_back(key, Cut(std::move(value)));
  record.events.push_back(std::move(event));
}

}  // namespace

Span::Span(SpanContext passed_on) {
  if (!passed_on.is_valid()) return;
  state_ = std::make_shared<State>();
  state_->context = std::move(passed_on);
}

Span::Span(std::shared_ptr<SpanQueue> queue, SpanRecord begun) : state_(std::make_shared<State>()) {
  state_->queue = std::move(queue);
  state_->context = begun.context;
  absl::MutexLock lock(&state_->mutex);
  state_->record = std::move(begun);
}

Span::State::~State() {
  if (queue != nullptr) End();
}

void Span::State::End() noexcept {
  Quietly([this] {
    SpanRecord ended;
    {
      absl::MutexLock lock(&mutex);
      if (std::exchange(has_ended, true)) return;
      ended = std::move(record);
    }
    // A clock that was turned back.
    ended.end = std::max(absl::Now(), ended.begin);
    queue->Push(std::move(ended));
  });
}

const SpanContext& Span::context() const {
  static const auto& none = *new SpanContext();
  return state_ != nullptr ? state_->context : none;
}

template <typename Change>
void Span::Apply(Change&& change) const noexcept {
  if (!is_recording()) return;
  Quietly([&] {
    absl::MutexLock lock(&state_->mutex);
    if (!state_->has_ended) change(state_->record);
  });
}

void Span::SetName(absl::string_view name) const noexcept {
  Apply([&](SpanRecord& record) { record.name = Cut(name); });
}

void Span::SetAttribute(absl::string_view name, AttributeValue value) const noexcept {
  Apply([&](SpanRecord& record) { Set(name, std::move(value), record); });
}

void Span::AddEvent(absl::string_view name, Attributes attributes) const noexcept {
  Apply([&](SpanRecord& record) { Add(name, std::move(attributes), record); });
}

void Span::SetError(absl::string_view message) const noexcept {
  Apply([&](SpanRecord& record) {
    record.has_failed = true;
    record.error = Cut(message);
  });
}

SpanRecord Span::Child(absl::string_view name, absl::Time begin) const {
  SpanRecord child;
  child.context = state_->context;
  child.context.span_id = RandomId();
  child.parent_id = state_->context.span_id;
  child.name = Cut(name);
  child.begin = begin;
  state_->queue->Charge();
  return child;
}

Span Span::StartChild(absl::string_view name) const noexcept {
  Span child;
  if (!is_recording()) return *this;
  Quietly([&] { child = Span(state_->queue, Child(name, absl::Now())); });
  return child;
}

void Span::RecordChild(absl::string_view name, absl::Time begin, absl::Time end) const noexcept {
  if (!is_recording()) return;
  Quietly([&] {
    SpanRecord child = Child(name, begin);
    child.end = std::max(begin, end);
    state_->queue->Push(std::move(child));
  });
}

void Span::End() const noexcept {
  if (is_recording()) state_->End();
}

}  // namespace liquidblend::trace
