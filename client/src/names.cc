#include "client/src/names.h"

#include <algorithm>
#include <cstdint>
#include <random>

#include "absl/strings/ascii.h"
#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"

namespace liquidblend::client {
namespace {

constexpr size_t kMaxPastedLetters = 200;

}  // namespace

std::string ResourceName(const std::string& collection, const std::string& id_or_name) {
  return absl::StrCat(collection, "/", ResourceId(collection, id_or_name));
}

std::string ResourceId(const std::string& collection, const std::string& id_or_name) {
  const std::string prefix = collection + "/";
  return absl::StartsWith(id_or_name, prefix) ? id_or_name.substr(prefix.size()) : id_or_name;
}

bool IsSafeToPaste(absl::string_view name) {
  return !name.empty() && name.size() <= kMaxPastedLetters && name[0] != '-' &&
         std::all_of(name.begin(), name.end(), [](char c) {
           return absl::ascii_isalnum(static_cast<unsigned char>(c)) ||
                  absl::StrContains("/_.-", absl::string_view(&c, 1));
         });
}

std::string MakeRequestId() {
  std::random_device device;
  uint32_t word[4];
  for (uint32_t& w : word) w = device();
  return absl::StrFormat("%08x-%04x-%04x-%04x-%04x%08x", word[0], word[1] >> 16,
                         0x4000u | (word[1] & 0x0fffu), 0x8000u | ((word[2] >> 16) & 0x3fffu),
                         word[2] & 0xffffu, word[3]);
}

}  // namespace liquidblend::client
