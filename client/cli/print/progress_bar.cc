#include "client/cli/print/progress_bar.h"

#include <sys/ioctl.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "absl/time/clock.h"
#include "client/cli/flags/clean_text.h"

namespace liquidblend::cli {
namespace {

constexpr int kBarColumns = 24;
constexpr absl::Duration kBarInterval = absl::Milliseconds(100);
constexpr absl::Duration kLineInterval = absl::Seconds(10);

int TerminalColumns() {
  winsize size{};
  if (ioctl(STDERR_FILENO, TIOCGWINSZ, &size) != 0 || size.ws_col == 0) return 80;
  return size.ws_col;
}

void PrintBar(const std::string& bar) {
  std::fprintf(stderr, "\r\x1b[2K%s", bar.c_str());
  std::fflush(stderr);
}

}  // namespace

ProgressBar::Style ProgressBar::ChooseStyle(bool quiet) {
  if (quiet) return Style::kNone;
  return isatty(STDERR_FILENO) != 0 ? Style::kBar : Style::kLines;
}

std::string ProgressBar::FormatBar(double fraction, const std::string& text, int columns) {
  const double share = std::isfinite(fraction) ? std::clamp(fraction, 0.0, 1.0) : 0.0;
  const int filled = static_cast<int>(share * kBarColumns);
  std::string bar =
      absl::StrCat("[", std::string(static_cast<size_t>(filled), '#'),
                   std::string(static_cast<size_t>(kBarColumns - filled), '.'), "] ",
                   absl::StrFormat("%3d %%", static_cast<int>(share * 100.0)), "  ", text);
  bar.resize(std::min(bar.size(), static_cast<size_t>(std::max(columns - 1, 1))));
  return bar;
}

void ProgressBar::Update(double fraction, const std::string& step, const std::string& text) {
  if (style_ == Style::kNone) return;
  const absl::Time now = absl::Now();
  const bool is_new_step = step != step_;
  step_ = step;
  if (style_ == Style::kLines) {
    if (!is_new_step && now - last_ < kLineInterval) return;
    std::fprintf(stderr, "%s\n", CleanLine(text).c_str());
  } else {
    pending_ = FormatBar(fraction, CleanLine(text), TerminalColumns());
    if (!is_new_step && now - last_ < kBarInterval) return;
    PrintBar(pending_);
    pending_.clear();
    drawn_ = true;
  }
  last_ = now;
}

void ProgressBar::Finish() {
  if (style_ != Style::kBar || !drawn_) return;
  if (!pending_.empty()) PrintBar(pending_);
  std::fputc('\n', stderr);
  drawn_ = false;
}

std::string FormatTimeLeft(double seconds) {
  if (!(seconds > 0.0) || seconds > 1e7) return "unknown";
  const int total = static_cast<int>(std::ceil(seconds));
  if (total < 3600) return absl::StrFormat("%d:%02d", total / 60, total % 60);
  return absl::StrFormat("%d:%02d:%02d", total / 3600, total / 60 % 60, total % 60);
}

std::string FormatBytes(int64_t bytes) {
  const double value = static_cast<double>(bytes);
  if (bytes < 1000) return absl::StrCat(bytes, " B");
  if (bytes < 1000000) return absl::StrFormat("%.1f kB", value / 1e3);
  if (bytes < 1000000000) return absl::StrFormat("%.1f MB", value / 1e6);
  return absl::StrFormat("%.2f GB", value / 1e9);
}

}  // namespace liquidblend::cli
