#include "core/base/data_limit.h"

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <fstream>
#include <limits>
#include <string>

#include "absl/strings/cord.h"
#include "absl/strings/match.h"
#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "core/base/log.h"
#include "core/base/memory_limit.h"

namespace liquidblend::base {
namespace {

constexpr char kMark[] = "liquidblend/over_memory_limit";
constexpr int64_t kNearlyReached = 16 << 20;

}  // namespace

absl::Status MemoryLimitError(const std::string& message) {
  absl::Status status = absl::ResourceExhaustedError(message);
  status.SetPayload(kMark, absl::Cord());
  return status;
}

bool IsOverMemoryLimit(const absl::Status& status) { return status.GetPayload(kMark).has_value(); }

int64_t DataBytes() {
  constexpr char kName[] = "VmData:";
  std::ifstream file("/proc/self/status");
  for (std::string line; std::getline(file, line);) {
    if (!absl::StartsWith(line, kName)) continue;
    int64_t kibibytes = 0;
    const size_t digits = line.find_first_of("0123456789");
    const size_t end = line.find(' ', digits);
    if (digits == std::string::npos || end == std::string::npos) return 0;
    return absl::SimpleAtoi(line.substr(digits, end - digits), &kibibytes) ? kibibytes << 10 : 0;
  }
  return 0;
}

int64_t DataBytesLeft() {
  int64_t left = MemoryForJobs() > 0 ? MemoryForJobs() : std::numeric_limits<int64_t>::max();
  rlimit limit = {};
  if (getrlimit(RLIMIT_DATA, &limit) != 0 || limit.rlim_cur == RLIM_INFINITY) return left;
  const auto most =
      static_cast<int64_t>(std::min<rlim_t>(limit.rlim_cur, std::numeric_limits<int64_t>::max()));
  return std::min(left, std::max<int64_t>(0, most - DataBytes()));
}

ScopedDataLimit::ScopedDataLimit(int64_t bytes) {
  const int64_t now = DataBytes();
  limit_bytes_ = bytes > std::numeric_limits<int64_t>::max() - now
                     ? std::numeric_limits<int64_t>::max()
                     : now + bytes;
  if (now == 0 || getrlimit(RLIMIT_DATA, &former_) != 0) {
    LogWarning("the memory of jobs cannot be limited: its use is not known");
    return;
  }
  rlimit limit = former_;
  limit.rlim_cur = std::min<rlim_t>(former_.rlim_cur, static_cast<rlim_t>(limit_bytes_));
  limit_bytes_ =
      static_cast<int64_t>(std::min<rlim_t>(limit.rlim_cur, std::numeric_limits<int64_t>::max()));
  is_set_ = setrlimit(RLIMIT_DATA, &limit) == 0;
  if (!is_set_) {
    LogWarning(absl::StrCat("the memory of jobs cannot be limited: ", std::strerror(errno)));
  }
}

ScopedDataLimit::~ScopedDataLimit() {
  if (is_set_) setrlimit(RLIMIT_DATA, &former_);
}

bool ScopedDataLimit::IsNearlyReached() const {
  return is_set_ && DataBytes() > limit_bytes_ - kNearlyReached;
}

}  // namespace liquidblend::base
