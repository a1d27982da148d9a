// Writers of exported frames, one for each format.
#pragma once

#include <memory>
#include <string>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "client/cli/files/export_folder.h"
#include "client/cli/files/export_meta.h"
#include "liquidblend/family.h"
#include "liquidblend/frame.h"

namespace liquidblend::cli {

enum class Compression { kNone, kDraco };

struct WriterSettings {
  std::string format = "ply";
  double frames_per_second = 0.0;
  Compression compression = Compression::kNone;  // gltf
  int64_t texture_size = 8192;                   // vat: the longest side
  double voxel_size_m = 0.0;                     // vdb; 0: the first frame's mean edge length
};

// Threads: one at a time.
class FrameWriter {
 public:
  virtual ~FrameWriter() = default;

  // Adds the next frame.
  // Errors: of files and decoding; kInvalidArgument if the format cannot hold it.
  virtual absl::Status Add(const Frame& frame) = 0;

  // Completes the files, below their temporary names. Requires: a frame was added.
  virtual absl::StatusOr<ExportedFiles> Finish() = 0;
};

// All arguments outlive the writer.
// Errors: kInvalidArgument if the folder holds a foreign file of a name that is to be written.
absl::StatusOr<std::unique_ptr<FrameWriter>> MakeFrameWriter(const WriterSettings& settings,
                                                             const Family& family,
                                                             const ExportFolder& folder);

}  // namespace liquidblend::cli
