// Flags that say how frames are encoded: shared by the commands that get frames.
#pragma once

#include <CLI/App.hpp>

#include "liquidblend/frame.h"

namespace liquidblend::cli {

struct EncodingFlags {
  int position_bits = 0;  // 0: the server's default
  EncodingPreset preset = EncodingPreset::kFastest;
};

// `flags` must outlive the parser.
void AddEncodingFlags(CLI::App& command, EncodingFlags& flags);

}  // namespace liquidblend::cli
