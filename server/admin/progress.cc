#include "server/admin/progress.h"

#include <unistd.h>

#include <cstdio>
#include <utility>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "absl/time/clock.h"

namespace liquidblend::admin {

Progress::Style Progress::ChooseStyle() {
  return isatty(STDERR_FILENO) != 0 ? Style::kTerminal : Style::kNone;
}

void Progress::Begin(std::string action, int64_t total_bytes) {
  End();
  const absl::MutexLock lock(&mutex_);
  action_ = std::move(action);
  total_bytes_ = total_bytes;
  num_bytes_ = num_blobs_ = 0;
}

void Progress::Add(int64_t num_bytes) {
  const absl::MutexLock lock(&mutex_);
  num_bytes_ += num_bytes;
  ++num_blobs_;
  const absl::Time now = absl::Now();
  if (style_ == Style::kNone || now - last_ < absl::Milliseconds(100)) return;
  last_ = now;
  Draw();
}

void Progress::End() {
  const absl::MutexLock lock(&mutex_);
  if (!is_drawn_) return;
  Draw();
  std::fputs("\n", stderr);
  is_drawn_ = false;
}

void Progress::Draw() {
  const std::string total =
      total_bytes_ < 0 ? std::string() : absl::StrCat(" of ", FormatBytes(total_bytes_));
  std::fputs(absl::StrCat("\r", action_, " ", num_blobs_, " blobs, ", FormatBytes(num_bytes_),
                          total, "\x1b[K")
                 .c_str(),
             stderr);
  std::fflush(stderr);
  is_drawn_ = true;
}

std::string FormatBytes(int64_t bytes) {
  constexpr const char* kUnits[] = {"kB", "MB", "GB", "TB"};
  if (bytes < 1000) return absl::StrCat(bytes, " bytes");
  auto value = static_cast<double>(bytes) / 1000.0;
  size_t unit = 0;
  for (; value >= 999.95 && unit + 1 < std::size(kUnits); ++unit) value /= 1000.0;
  return absl::StrFormat("%.1f %s", value, kUnits[unit]);
}

}  // namespace liquidblend::admin
