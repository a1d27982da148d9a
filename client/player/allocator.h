// Allocator of frames' memory, given by the program that plays.
#pragma once

#include <cstddef>
#include <cstdlib>

namespace liquidblend::player {

// Both functions are called from any thread, at the same time.
struct Allocator {
  // Memory of that many bytes, aligned as malloc's; null: there is none.
  void* (*allocate)(void* user, size_t num_bytes) = [](void*, size_t num_bytes) {
    return std::malloc(num_bytes);
  };
  void (*release)(void* user, void* memory) = [](void*, void* memory) { std::free(memory); };
  void* user = nullptr;
};

}  // namespace liquidblend::player
