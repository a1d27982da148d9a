// Progress on standard error: a bar on a terminal, plain lines elsewhere.
#pragma once

#include <string>

#include "absl/time/time.h"

namespace liquidblend::cli {

// Threads: one.
class ProgressBar {
 public:
  enum class Style { kNone, kLines, kBar };

  // kNone with `quiet`, kBar if standard error is a terminal.
  static Style ChooseStyle(bool quiet);

  explicit ProgressBar(Style style) : style_(style) {}
  ~ProgressBar() { Finish(); }
  ProgressBar(const ProgressBar&) = delete;
  ProgressBar& operator=(const ProgressBar&) = delete;

  // A bar is drawn at most ten times a second. A line is printed when `step`, the name of the
  // present step, changes, and else every ten seconds.
  //   fraction  [0, 1]
  //   text      a line; control characters in it, which may be a server's, are replaced
  void Update(double fraction, const std::string& step, const std::string& text);

  // Ends the bar's line; the last text stays.
  void Finish();

  // "[######......]  50 % text", at most `columns` wide.
  static std::string FormatBar(double fraction, const std::string& text, int columns);

 private:
  Style style_;
  bool drawn_ = false;
  std::string step_;
  std::string pending_;  // the newest bar, not yet drawn
  absl::Time last_ = absl::InfinitePast();
};

// "1:05" or "2:03:10"; "unknown" for 0.
std::string FormatTimeLeft(double seconds);

// "12.3 MB"
std::string FormatBytes(int64_t bytes);

}  // namespace liquidblend::cli
