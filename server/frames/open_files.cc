#include "server/frames/open_files.h"

#include "absl/cleanup/cleanup.h"
#include "absl/strings/str_cat.h"
#include "core/base/status_macros.h"

namespace liquidblend::server {
namespace {

// Null if a part of it could not be read: it may be whole again when it is opened anew.
template <typename Pointer>
Pointer FindWhole(RecentlyUsed<Pointer>& recent, const store::BlobId& blob) {
  Pointer known = recent.Find(blob);
  return known != nullptr && known->Check().ok() ? known : nullptr;
}

}  // namespace

absl::StatusOr<BlobPtr> OpenBlob(store::BlobStore& blobs, const store::BlobId& blob,
                                 const std::string& name) {
  absl::StatusOr<BlobPtr> opened = blobs.Open(blob);
  if (!absl::IsNotFound(opened.status())) return opened;
  return absl::DataLossError(absl::StrCat("the file of ", name, " is missing"));
}

absl::StatusOr<BlobPtr> OpenBlobs::Open(const store::BlobId& blob, const std::string& name) {
  {
    absl::MutexLock lock(&mutex_);
    const auto is_free = [&]() ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_) {
      return opening_.count(blob) == 0;
    };
    mutex_.Await(absl::Condition(&is_free));
    if (BlobPtr known = FindWhole(recent_, blob)) return known;
    opening_.insert(blob);
  }
  const absl::Cleanup done = [&] {
    absl::MutexLock lock(&mutex_);
    opening_.erase(blob);
  };
  LB_ASSIGN_OR_RETURN(BlobPtr opened, OpenBlob(blobs_, blob, name));
  recent_.Add(blob, opened);
  return opened;
}

absl::StatusOr<AnimationFramesPtr> OpenAnimations::Open(const store::BlobId& blob,
                                                        const std::string& name) {
  if (AnimationFramesPtr known = FindWhole(frames_, blob)) return known;
  LB_ASSIGN_OR_RETURN(const BlobPtr opened, OpenBlob(blobs_, blob, name));
  LB_ASSIGN_OR_RETURN(AnimationFramesPtr frames, store::AnimationFrames::Open(opened, name));
  frames_.Add(blob, frames);
  return frames;
}

}  // namespace liquidblend::server
