// How large a Draco mesh says that it is, before anything is decoded. Internal to client/.
#pragma once

#include <cstdint>
#include <string>

#include "absl/status/status.h"

namespace liquidblend::client {

// libdraco allocates for as many triangles and points as the first bytes of a mesh say, whether or
// not they follow: 35 bytes that claim 100 million triangles take 2.3 GB. A mesh of N bytes may
// have kMaxSpareDracoTriangles + N * kMaxDracoTrianglesPerByte triangles and three times as many
// points. The method of the preset FASTEST writes at most four triangles a byte. Of a flat slab,
// the preset SMALLEST writes 84 a byte if it has 40,000 triangles, and 652 if it has four million.
inline constexpr uint64_t kMaxSpareDracoTriangles = uint64_t{1} << 22;
inline constexpr uint64_t kMaxDracoTrianglesPerByte = 16;

// Errors: kDataLoss if the mesh claims more, or its header or metadata is cut off; kInvalidArgument
// if it is no triangle mesh of Draco's bitstream 2.2, which all releases since 1.3 write.
// Threads: safe.
absl::Status CheckDracoSize(const std::string& draco_bytes);

}  // namespace liquidblend::client
