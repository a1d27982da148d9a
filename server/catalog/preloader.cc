#include "server/catalog/preloader.h"

#include <algorithm>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "core/base/log.h"

namespace liquidblend::catalog {
namespace {

constexpr int kMaxFamilies = 1000;

}  // namespace

void Preloader::Start(Post ask, Post load, Task when_over) {
  ask_ = std::move(ask);
  load_ = std::move(load);
  start_ = base::SteadyClock::now();
  {
    absl::MutexLock lock(&mutex_);
    when_over_ = std::move(when_over);
  }
  if (!ask_([self = shared_from_this()] { self->List(); })) End("the server stops");
}

void Preloader::Stop() { End("the time for it is over"); }

absl::Status Preloader::CheckIsOver() const {
  absl::MutexLock lock(&mutex_);
  if (when_over_ == nullptr) return absl::OkStatus();
  return absl::UnavailableError(
      absl::StrCat("preloading families: ", num_loaded_, " of ", num_families_, " are there"));
}

void Preloader::List() {
  const absl::StatusOr<std::vector<store::UsedFamily>> used =
      catalog_.ListMostUsedFamilies(kMaxFamilies);
  if (!used.ok()) return End(used.status().ToString());
  {
    absl::MutexLock lock(&mutex_);
    waiting_.assign(used->begin(), used->end());
    num_families_ = static_cast<int>(used->size());
  }
  FillUp();
}

// Starts as many loads as may run.
void Preloader::FillUp() {
  while (true) {
    std::optional<store::UsedFamily> next;
    {
      absl::MutexLock lock(&mutex_);
      if (when_over_ == nullptr || num_running_ == kNumAtOnce) return;
      next = TakeNext();
      if (!next.has_value() && num_running_ > 0) return;
    }
    if (!next.has_value()) return End("");
    if (!ask_([self = shared_from_this(), family = *next] { self->Load(family); })) {
      return End("the server stops");
    }
  }
}

// The next family that fits the memory, and counts as running from now on; nothing: none is left.
std::optional<store::UsedFamily> Preloader::TakeNext() {
  while (!waiting_.empty()) {
    const store::UsedFamily family = waiting_.front();
    waiting_.pop_front();
    const double needed =
        memory_per_byte_ * static_cast<double>(running_bytes_ + family.size_bytes);
    const auto held = static_cast<double>(families_.size_bytes());
    if (held + needed <= static_cast<double>(families_.memory_budget_bytes())) {
      ++num_running_;
      running_bytes_ += family.size_bytes;
      return family;
    }
    --num_families_;
  }
  return std::nullopt;
}

void Preloader::Load(const store::UsedFamily& family) {
  families_.GetReady(family.id, AskedVersion(), load_,
                     [self = shared_from_this(), family](const absl::StatusOr<FamilyPtr>& loaded) {
                       self->OnLoaded(family, loaded);
                     });
}

void Preloader::OnLoaded(const store::UsedFamily& family, const absl::StatusOr<FamilyPtr>& loaded) {
  if (!loaded.ok()) {
    base::LogWarning(
        absl::StrCat("family ", family.id, " is not preloaded: ", loaded.status().ToString()));
  }
  {
    absl::MutexLock lock(&mutex_);
    --num_running_;
    running_bytes_ -= family.size_bytes;
    if (loaded.ok()) {
      ++num_loaded_;
      const auto file_bytes = static_cast<double>(std::max<int64_t>(family.size_bytes, 1));
      memory_per_byte_ =
          std::max(memory_per_byte_, static_cast<double>((*loaded)->size_bytes) / file_bytes);
    }
  }
  FillUp();
}

void Preloader::End(absl::string_view why) {
  Task when_over;
  int num_loaded = 0, num_families = 0;
  {
    absl::MutexLock lock(&mutex_);
    std::swap(when_over, when_over_);
    waiting_.clear();
    num_loaded = num_loaded_;
    num_families = num_families_;
  }
  if (when_over == nullptr) return;
  if (num_families > 0 || !why.empty()) {
    base::LogInfo(
        absl::StrCat("preloaded ", num_loaded, " of ", num_families, " families in ",
                     absl::FormatDuration(absl::Trunc(base::Since(start_), absl::Milliseconds(1))),
                     why.empty() ? "" : ": ", why));
  }
  when_over();
}

}  // namespace liquidblend::catalog
