#include "client/player/frame_mesh.h"

#include <algorithm>
#include <utility>

#include "absl/strings/str_cat.h"

namespace liquidblend::player {
namespace {

constexpr size_t kFloatsOfPosition = 3, kFloatsOfVector = 3, kFloatsOfRest = 4;

size_t FloatsPerVertex(const Attributes& attributes) {
  return kFloatsOfPosition + (attributes.normals ? kFloatsOfVector : 0) +
         (attributes.velocities ? kFloatsOfVector : 0) + (attributes.rest ? kFloatsOfRest : 0);
}

}  // namespace

FrameMesh::~FrameMesh() {
  if (block_ != nullptr) allocator_.release(allocator_.user, block_);
}

absl::Status FrameMesh::Resize(size_t num_vertices, size_t num_triangles,
                               const Attributes& attributes, GrowthPolicy& growth) {
  const size_t bytes = sizeof(float) * FloatsPerVertex(attributes) * num_vertices +
                       3 * sizeof(uint32_t) * num_triangles;
  num_vertices_ = num_triangles_ = 0;
  memory_ = {};
  if (bytes > capacity_ || block_ == nullptr) {
    if (block_ != nullptr) allocator_.release(allocator_.user, block_);
    capacity_ = std::max(growth.GrowTo(bytes), size_t{1});
    block_ = allocator_.allocate(allocator_.user, capacity_);
    if (block_ == nullptr) {
      const size_t wanted = std::exchange(capacity_, 0);
      return absl::ResourceExhaustedError(
          absl::StrCat("the allocator has no ", wanted, " bytes for a frame"));
    }
  }
  num_vertices_ = num_vertices;
  num_triangles_ = num_triangles;
  auto* next = static_cast<float*>(block_);
  const auto take = [&](bool is_wanted, size_t floats) {
    return is_wanted ? std::exchange(next, next + floats * num_vertices) : nullptr;
  };
  memory_.positions = take(true, kFloatsOfPosition);
  memory_.normals = take(attributes.normals, kFloatsOfVector);
  memory_.velocities = take(attributes.velocities, kFloatsOfVector);
  memory_.rest = take(attributes.rest, kFloatsOfRest);
  memory_.triangles = reinterpret_cast<uint32_t*>(next);  // of the same size and alignment
  return absl::OkStatus();
}

void FrameMesh::UpdateBounds() {
  bounds_min_ = bounds_max_ = {0, 0, 0};
  if (num_vertices_ == 0) return;
  const float* const first = memory_.positions;
  std::copy_n(first, 3, bounds_min_.begin());
  bounds_max_ = bounds_min_;
  for (const float* p = first; p != first + 3 * num_vertices_; p += 3) {
    for (size_t k = 0; k < 3; ++k) {
      bounds_min_[k] = std::min(bounds_min_[k], p[k]);
      bounds_max_[k] = std::max(bounds_max_[k], p[k]);
    }
  }
}

}  // namespace liquidblend::player
