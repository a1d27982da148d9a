// MeshoptMesh bytes -> floats in memory that the caller gives.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "client/src/decode/unpack.h"
#include "liquidblend/v1/liquidblend.pb.h"

namespace liquidblend::client {

// Whether frame data is a Draco mesh, by its first bytes.
bool IsDraco(const std::string& bytes);

// Decoder of meshes. Keeps its memory from one mesh to the next.  Threads: one at a time.
class MeshoptDecoder {
 public:
  // Reads the header of a mesh, and checks the counts.  Errors: kInvalidArgument if the bytes are
  // not a MeshoptMesh; kDataLoss if they are damaged.
  absl::Status Open(const std::string& bytes);

  // Counts and attributes of the mesh that was opened.
  uint32_t num_vertices() const { return message_.num_vertices(); }
  uint32_t num_triangles() const { return message_.num_triangles(); }
  bool has_normals() const { return !message_.normals().empty(); }
  bool has_velocities() const { return !message_.velocities().empty(); }
  bool has_rest() const { return !message_.rest_positions().empty(); }

  // Decodes the mesh that was opened.  Errors: kDataLoss.  Cost: about 1 ms per 100,000 triangles.
  absl::Status Decode();
  // Writes the mesh that was decoded.  Requires: `out` has room for it.
  void Write(const MeshMemory& out) const;

 private:
  v1::MeshoptMesh message_;
  std::vector<std::array<uint16_t, 4>> positions_, rest_;
  std::vector<std::array<int16_t, 2>> normals_;
  std::vector<std::array<int16_t, 4>> velocities_;
  std::vector<std::array<uint32_t, 3>> triangles_;
};

}  // namespace liquidblend::client
