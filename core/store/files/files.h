// liquidblend's file formats (docs/formats.md): animation files, family files, target files.
#pragma once

#include <memory>
#include <span>
#include <string>
#include <utility>

#include "absl/status/statusor.h"
#include "core/mesh/animation.h"
#include "core/mesh/registered_family.h"
#include "core/store/blobs/blob_store.h"
#include "liquidblend/store/v1/files.pb.h"

namespace liquidblend::store {

// Writes an animation as one file of aligned, checksummed sections.
// Requires: each frame passed Validate(); the times, if any, are one per frame and rise from 0.
// Errors: the writer's; kInvalidArgument if a name or note is not UTF-8.
absl::Status WriteAnimation(const mesh::Animation& animation, BlobWriter& out);

//   name  how messages call the file
// Errors: kDataLoss if the file is damaged, naming the section; kInvalidArgument if it is not an
// animation file, has an unknown format version, or contradicts itself. Memory: the file's size,
// and some 80 times its manifest's, which may have 16 MiB at most.
absl::StatusOr<mesh::Animation> ReadAnimation(const Blob& blob, const std::string& name);

// An animation file whose frames are read one by one. Keeps the blob.  Threads: safe, immutable.
class AnimationFrames {
 public:
  // Checks header and manifest. Errors: as ReadAnimation.
  static absl::StatusOr<std::shared_ptr<const AnimationFrames>> Open(
      std::shared_ptr<const Blob> blob, const std::string& name);

  const liquidblend::store::v1::AnimationManifest& manifest() const { return manifest_; }

  // Whether the file could be read so far (Blob::Check()).
  absl::Status Check() const { return blob_->Check(); }

  // Frame k. Requires: k in [0, manifest().num_frames()).  Errors: kDataLoss, kInvalidArgument.
  absl::StatusOr<mesh::TriangleMesh> Read(int k) const;

 private:
  AnimationFrames(std::shared_ptr<const Blob> blob, std::string name)
      : blob_(std::move(blob)), name_(std::move(name)) {}

  const std::shared_ptr<const Blob> blob_;
  const std::string name_;
  liquidblend::store::v1::AnimationManifest manifest_;
};

// Writes a registered family. The same family gives the same bytes: its version (which the catalog
// assigns) and the seconds of the reports are not stored in the file.
// Requires: Validate(family).ok().  Errors: as WriteAnimation.
absl::Status WriteFamily(const mesh::RegisteredFamily& family, BlobWriter& out);

// A view on the blob, which it keeps alive, without a copy; checks header, sections, checksums and
// Validate(). Requires: the blob's bytes are 64-byte aligned.  Errors: as ReadAnimation.
absl::StatusOr<mesh::RegisteredFamily> OpenFamily(std::shared_ptr<const Blob> blob,
                                                  const std::string& name);

// One registered target, on its way into a family file.
struct TargetFile {
  mesh::FamilyTarget target;  // views
  mesh::SpaceTimeReport space_time;
  std::string source_mesh;  // a hash of the mesh that displacements belong to; empty: not known
  std::shared_ptr<const void> storage;  // keeps alive what the spans view
};

// Writes a target file; reading it gives the same bits. Errors: as WriteAnimation.
absl::Status WriteTarget(const TargetFile& target, BlobWriter& out);

// A view on the blob, which it keeps alive, without a copy. Whether the arrays fit the source's
// mesh is checked when the family is assembled. Requires, Errors: as OpenFamily.
absl::StatusOr<TargetFile> OpenTarget(std::shared_ptr<const Blob> blob, const std::string& name);

// The manifests that the catalog keeps of them (without sections).
liquidblend::store::v1::AnimationManifest ManifestOf(const mesh::Animation& animation);
liquidblend::store::v1::FamilyManifest ManifestOf(const mesh::RegisteredFamily& family);

}  // namespace liquidblend::store
