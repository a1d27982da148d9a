// Flags of the encoding of frames, shared by the commands that get frames.
#pragma once

#include <CLI/App.hpp>

#include "liquidblend/frame.h"

namespace liquidblend::cli {

struct EncodingFlags {
  int position_bits = 0;         // 0: the server's default
  double position_step_m = 0.0;  // 0: by position_bits
  EncodingPreset preset = EncodingPreset::kFastest;
};

// `flags` must outlive the parser.
void AddEncodingFlags(CLI::App& command, EncodingFlags& flags);

// Request: FrameRequest or StreamSettings. A step that was given replaces the default of bits.
template <typename Request>
void SetEncoding(const EncodingFlags& flags, Request& request) {
  if (flags.position_step_m == 0.0) request.position_bits = flags.position_bits;
  request.position_step_m = flags.position_step_m;
  request.encoding = flags.preset;
}

}  // namespace liquidblend::cli
