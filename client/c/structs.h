// Structs of the C API, whose size is that of the header that the caller was compiled against.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstring>
#include <string>

#include "absl/status/status.h"
#include "client/c/error.h"

namespace liquidblend::c_api {

// Reads a struct: what the caller's does not have is 0.
// Errors: kInvalidArgument if it is null or says no size.
template <typename Struct>
absl::Status Read(const Struct* from, const char* name, Struct& to) {
  to = {};
  if (from == nullptr) return InvalidArgument(name, "is NULL");
  if (from->struct_size < sizeof(size_t)) return InvalidArgument(name, "has no struct_size");
  std::memcpy(&to, from, std::min(from->struct_size, sizeof(Struct)));
  to.struct_size = sizeof(Struct);
  return absl::OkStatus();
}

// The same; null means all defaults.
template <typename Struct>
absl::Status ReadOrDefault(const Struct* from, const char* name, Struct& to) {
  to = {};
  return from == nullptr ? absl::OkStatus() : Read(from, name, to);
}

// Writes a struct as far as the caller's goes. Null or without a size: nothing.
template <typename Struct>
void Write(Struct from, Struct* to) {
  if (to == nullptr || to->struct_size < sizeof(size_t)) return;
  from.struct_size = std::min(to->struct_size, sizeof(Struct));
  std::memcpy(to, &from, from.struct_size);
}

// The text, or "" for null.
inline std::string TextOf(const char* text) { return text == nullptr ? "" : text; }

}  // namespace liquidblend::c_api
