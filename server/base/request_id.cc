#include "server/base/request_id.h"

#include <algorithm>
#include <random>

#include "absl/strings/ascii.h"
#include "absl/strings/str_format.h"

namespace liquidblend::server {
namespace {

constexpr size_t kMaxLength = 64;

bool IsRequestId(absl::string_view id) {
  return !id.empty() && id.size() <= kMaxLength && std::all_of(id.begin(), id.end(), [](char c) {
    return absl::ascii_isalnum(static_cast<unsigned char>(c)) || c == '-' || c == '_' || c == '.' ||
           c == ':';
  });
}

}  // namespace

std::string RequestIdOf(absl::string_view header) {
  if (IsRequestId(header)) return std::string(header);
  thread_local std::mt19937_64 random{std::random_device()()};
  return absl::StrFormat("%016x", random());
}

}  // namespace liquidblend::server
