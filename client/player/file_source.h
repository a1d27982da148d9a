// Frames of a family's file, made in this process.
#pragma once

#include <memory>
#include <string>

#include "absl/status/statusor.h"
#include "client/player/frame_source.h"
#include "core/base/object_pool.h"
#include "core/frames/indexed_family.h"
#include "core/frames/make_surface.h"
#include "core/store/blobs/blob_store.h"

namespace liquidblend::player {

// The same frames as a server makes of the same family, to the bit.
class FileSource final : public FrameSource {
 public:
  // Maps and checks the file, and builds its indices: about 0.7 us per cell.
  // Errors: kNotFound, kPermissionDenied; kInvalidArgument if it is not a family file; kDataLoss if
  // it is damaged. Messages name the path.
  static absl::StatusOr<std::unique_ptr<FileSource>> Open(const std::string& path);

  const FamilyFacts& facts() const override { return facts_; }
  absl::Status Get(const FrameSpec& spec, FramePool& pool, FrameMesh& out,
                   FrameCost& cost) override;

 private:
  FileSource(std::shared_ptr<const store::Blob> file, mesh::RegisteredFamily family,
             frames::OptionalSpace space);

  const std::shared_ptr<const store::Blob> file_;
  const frames::IndexedFamily indexed_;
  FamilyFacts facts_;
  base::ObjectPool<frames::SurfaceBuffers> buffers_;
};

}  // namespace liquidblend::player
