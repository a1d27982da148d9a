#include "server/frames/open_animations.h"

#include <algorithm>
#include <iterator>

#include "absl/strings/str_cat.h"
#include "core/base/status_macros.h"

namespace liquidblend::server {

AnimationFramesPtr OpenAnimations::Find(const store::BlobId& blob) {
  absl::MutexLock lock(&mutex_);
  const auto found = std::find_if(entries_.begin(), entries_.end(),
                                  [&](const Entry& entry) { return entry.blob == blob; });
  if (found == entries_.end()) return nullptr;
  entries_.splice(entries_.begin(), entries_, found);
  return found->frames;
}

absl::StatusOr<AnimationFramesPtr> OpenAnimations::Open(const store::BlobId& blob,
                                                        const std::string& name) {
  if (AnimationFramesPtr known = Find(blob)) return known;
  const auto opened = blobs_.Open(blob);
  if (absl::IsNotFound(opened.status())) {
    return absl::DataLossError(absl::StrCat("the file of ", name, " is missing"));
  }
  LB_RETURN_IF_ERROR(opened.status());
  LB_ASSIGN_OR_RETURN(AnimationFramesPtr frames, store::AnimationFrames::Open(*opened, name));
  std::list<Entry> dropped;  // unmapped without the lock
  absl::MutexLock lock(&mutex_);
  entries_.push_front({blob, frames});
  if (entries_.size() > kMaxOpen) {
    dropped.splice(dropped.begin(), entries_, std::prev(entries_.end()));
  }
  return frames;
}

}  // namespace liquidblend::server
