// A span of a trace: one piece of work with its begin, end, attributes and outcome.
#pragma once

#include <memory>
#include <string>
#include <utility>

#include "absl/strings/string_view.h"
#include "absl/time/time.h"
#include "core/trace/span_queue.h"
#include "core/trace/span_record.h"

namespace liquidblend::trace {

// Handle of a span; copies are handles of the same one. It ends with End(), or with its last
// handle. An empty one, or one that is not recorded, takes all calls and does nothing. What exceeds
// the limits is left out or cut, and no call fails: tracing never harms what is traced.
// Threads: safe.
class Span {
 public:
  static constexpr size_t kMaxAttributes = 32;      // of a span
  static constexpr size_t kMaxEvents = 16;          // of a span
  static constexpr size_t kMaxEventAttributes = 4;  // of an event
  static constexpr size_t kMaxTextBytes = 256;      // of a name, a text or an error

  Span() = default;
  // One that is not recorded here; calls and jobs pass the context on.
  explicit Span(SpanContext passed_on);
  // One that is recorded. Tracer::StartSpan() is for others.
  Span(std::shared_ptr<SpanQueue> queue, SpanRecord begun);

  bool is_recording() const { return state_ != nullptr && state_->queue != nullptr; }

  // The context that calls and jobs carry; an invalid one if there is no trace.
  const SpanContext& context() const;

  void SetName(absl::string_view name) const noexcept;
  // Replaces an attribute of the same name.
  void SetAttribute(absl::string_view name, AttributeValue value) const noexcept;
  void AddEvent(absl::string_view name, Attributes attributes = {}) const noexcept;
  // Marks the work as failed.
  void SetError(absl::string_view message) const noexcept;

  // A span within this one; not recorded if this one is not.
  Span StartChild(absl::string_view name) const noexcept;
  // Likewise, of work that has ended.
  void RecordChild(absl::string_view name, absl::Time begin, absl::Time end) const noexcept;

  // The first end counts; what comes later is ignored.
  void End() const noexcept;

 private:
  struct State {
    ~State();
    void End() noexcept;

    std::shared_ptr<SpanQueue> queue;  // null: not recorded
    SpanContext context;
    absl::Mutex mutex;
    bool has_ended ABSL_GUARDED_BY(mutex) = false;
    SpanRecord record ABSL_GUARDED_BY(mutex);  // without the context until the end
  };

  template <typename Change>
  void Apply(Change&& change) const noexcept;
  SpanRecord Child(absl::string_view name, absl::Time begin) const;

  std::shared_ptr<State> state_;
};

}  // namespace liquidblend::trace
