// Formats of an export that are more than a mesh file a frame; frame_writer.h says what each
// function is for.
#pragma once

#include <memory>

#include "absl/status/statusor.h"
#include "client/cli/export/frame_writer.h"

namespace liquidblend::cli {

// animation.glb: glTF 2.0, binary.
absl::StatusOr<std::unique_ptr<FrameWriter>> MakeGltfWriter(const WriterSettings& settings,
                                                            const Family& family,
                                                            const ExportFolder& folder);

// animation.usda: USD as text.
absl::StatusOr<std::unique_ptr<FrameWriter>> MakeUsdaWriter(const WriterSettings& settings,
                                                            const Family& family,
                                                            const ExportFolder& folder);

// vat.json and vat_*.exr: vertex animation textures.
absl::StatusOr<std::unique_ptr<FrameWriter>> MakeVatWriter(const WriterSettings& settings,
                                                           const Family& family,
                                                           const ExportFolder& folder);

// frame_0001.vdb and so on: a level set each.
// Errors: kFailedPrecondition if OpenVDB is not installed.
absl::StatusOr<std::unique_ptr<FrameWriter>> MakeVdbWriter(const WriterSettings& settings,
                                                           const ExportFolder& folder);

}  // namespace liquidblend::cli
