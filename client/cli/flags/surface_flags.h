// Flags of the surface options of frames, shared by the commands that write frames.
#pragma once

#include <CLI/App.hpp>
#include <string>

#include "absl/status/status.h"
#include "liquidblend/frame.h"

namespace liquidblend::cli {

struct SurfaceFlags {
  SurfaceOptions options;
  bool laplacian = false;
};

// `flags` must outlive the parser.
void AddSurfaceFlags(CLI::App& command, SurfaceFlags& flags);

SurfaceOptions ToSurfaceOptions(const SurfaceFlags& flags);

// Checks that a file of this extension ("ply") can hold the requested attributes.  Errors:
// kInvalidArgument.
absl::Status CheckAttributes(const SurfaceFlags& flags, const std::string& extension);

}  // namespace liquidblend::cli
