#include "server/frames/open_files.h"

#include "absl/strings/str_cat.h"
#include "core/base/status_macros.h"

namespace liquidblend::server {

absl::StatusOr<BlobPtr> OpenBlob(store::BlobStore& blobs, const store::BlobId& blob,
                                 const std::string& name) {
  absl::StatusOr<BlobPtr> opened = blobs.Open(blob);
  if (!absl::IsNotFound(opened.status())) return opened;
  return absl::DataLossError(absl::StrCat("the file of ", name, " is missing"));
}

absl::StatusOr<BlobPtr> OpenBlobs::Open(const store::BlobId& blob, const std::string& name) {
  if (BlobPtr known = recent_.Find(blob)) return known;
  LB_ASSIGN_OR_RETURN(BlobPtr opened, OpenBlob(blobs_, blob, name));
  recent_.Add(blob, opened);
  return opened;
}

absl::StatusOr<AnimationFramesPtr> OpenAnimations::Open(const store::BlobId& blob,
                                                        const std::string& name) {
  if (AnimationFramesPtr known = frames_.Find(blob)) return known;
  LB_ASSIGN_OR_RETURN(const BlobPtr opened, OpenBlob(blobs_, blob, name));
  LB_ASSIGN_OR_RETURN(AnimationFramesPtr frames, store::AnimationFrames::Open(opened, name));
  frames_.Add(blob, frames);
  return frames;
}

}  // namespace liquidblend::server
