// Mesh of one frame in one block of memory, which is reused from frame to frame.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "absl/status/status.h"
#include "client/player/allocator.h"
#include "client/src/decode/unpack.h"

namespace liquidblend::player {

// Attributes of a mesh beside its positions.
struct Attributes {
  bool normals = false;
  bool velocities = false;
  bool rest = false;
};

// Says how large a block of memory becomes that has to grow.  Threads: safe.
class GrowthPolicy {
 public:
  virtual ~GrowthPolicy() = default;
  // At least `bytes`, which are needed now.
  virtual size_t GrowTo(size_t bytes) = 0;
};

// What is said of a frame beside its mesh.
struct FrameFacts {
  std::vector<double> weights;  // that were used
  double time_s = 0.0;
  int64_t version = 0;  // of the family; 0: not known
  int level_of_detail = 0;
  bool is_extrapolated = false;  // the parameters lie outside of the hull
  bool is_clamped = false;       // other weights than asked for: a falling part would not fall
};

// Triangles are counter-clockwise seen from outside.  Threads: safe while nobody changes it.
class FrameMesh {
 public:
  explicit FrameMesh(const Allocator& allocator) : allocator_(allocator) {}
  ~FrameMesh();
  FrameMesh(const FrameMesh&) = delete;
  FrameMesh& operator=(const FrameMesh&) = delete;

  // Makes room; the contents are lost. Memory grows, and stays.
  //   growth  says how much it has after it has grown
  // Errors: kResourceExhausted if the allocator has none; the mesh is empty then.
  absl::Status Resize(size_t num_vertices, size_t num_triangles, const Attributes& attributes,
                      GrowthPolicy& growth);
  // Sets the bounds from the positions.
  void UpdateBounds();

  size_t num_vertices() const { return num_vertices_; }
  size_t num_triangles() const { return num_triangles_; }
  size_t capacity_bytes() const { return capacity_; }
  // Where the arrays are; null: the mesh has no such attribute.
  const client::MeshMemory& memory() const { return memory_; }
  const std::array<float, 3>& bounds_min() const { return bounds_min_; }  // 0 without vertices
  const std::array<float, 3>& bounds_max() const { return bounds_max_; }

  FrameFacts facts;

 private:
  friend class FramePool;

  FrameMesh* next_returned_ = nullptr;  // in FramePool's list
  const Allocator allocator_;
  void* block_ = nullptr;
  size_t capacity_ = 0;
  size_t num_vertices_ = 0;
  size_t num_triangles_ = 0;
  client::MeshMemory memory_;
  std::array<float, 3> bounds_min_ = {0, 0, 0};
  std::array<float, 3> bounds_max_ = {0, 0, 0};
};

}  // namespace liquidblend::player
