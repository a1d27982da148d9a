// Structs and errors of the C API in its tests.
#pragma once

#include <string>

#include "liquidblend/liquidblend.h"

namespace liquidblend {

// A struct with its size, all else 0.
template <typename Struct>
Struct Sized() {
  Struct made = {};
  made.struct_size = sizeof(Struct);
  return made;
}

inline std::string LastError() { return lb_last_error(); }

}  // namespace liquidblend
