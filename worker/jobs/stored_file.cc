#include "worker/jobs/stored_file.h"

#include <memory>
#include <utility>

#include "core/base/status_macros.h"
#include "core/store/files/files.h"

namespace liquidblend::jobs {
namespace {

// Counts what goes through it.
class CountingWriter final : public store::BlobWriter {
 public:
  explicit CountingWriter(std::unique_ptr<store::BlobWriter> out) : out_(std::move(out)) {}

  absl::Status Append(std::span<const std::byte> bytes) override {
    size_bytes_ += static_cast<int64_t>(bytes.size());
    return out_->Append(bytes);
  }
  absl::StatusOr<store::BlobId> Commit() override { return out_->Commit(); }

  int64_t size_bytes() const { return size_bytes_; }

 private:
  std::unique_ptr<store::BlobWriter> out_;
  int64_t size_bytes_ = 0;
};

}  // namespace

absl::StatusOr<store::v1::AnimationRecord> StoreAnimation(const mesh::Animation& animation,
                                                          store::BlobStore& blobs) {
  LB_ASSIGN_OR_RETURN(std::unique_ptr<store::BlobWriter> file, blobs.Create());
  CountingWriter out(std::move(file));
  LB_RETURN_IF_ERROR(store::WriteAnimation(animation, out));
  store::v1::AnimationRecord record;
  LB_ASSIGN_OR_RETURN(*record.mutable_blob(), out.Commit());
  record.set_id(animation.name);
  record.set_state(store::v1::AnimationRecord::READY);
  record.set_size_bytes(out.size_bytes());
  *record.mutable_manifest() = store::ManifestOf(animation);
  int64_t num_vertices = 0;
  int64_t num_triangles = 0;
  for (const mesh::TriangleMesh& frame : animation.frames) {
    num_vertices += frame.num_vertices();
    num_triangles += frame.num_triangles();
  }
  record.set_num_vertices(num_vertices);
  record.set_num_triangles(num_triangles);
  return record;
}

absl::StatusOr<store::v1::FamilyRecord> StoreFamily(const mesh::RegisteredFamily& family,
                                                    store::BlobStore& blobs) {
  LB_ASSIGN_OR_RETURN(std::unique_ptr<store::BlobWriter> file, blobs.Create());
  CountingWriter out(std::move(file));
  LB_RETURN_IF_ERROR(store::WriteFamily(family, out));
  store::v1::FamilyRecord record;
  LB_ASSIGN_OR_RETURN(*record.mutable_blob(), out.Commit());
  record.set_id(family.name);
  record.set_size_bytes(out.size_bytes());
  *record.mutable_manifest() = store::ManifestOf(family);
  record.set_num_vertices(static_cast<int64_t>(family.vertices.size()));
  record.set_num_cells(family.num_cells());
  return record;
}

}  // namespace liquidblend::jobs
