// The blocks of values in an OpenVDB file.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "absl/status/status.h"
#include "worker/ingest/formats/byte_reader.h"
#include "worker/ingest/formats/vdb_file.h"

namespace liquidblend::ingest {

// How the values of a tree are stored. A value is num_components floats, x y z.
struct VdbValueFormat {
  int num_components = 1;  // 1 or 3
  bool is_half = false;
  uint32_t compression = 0;
  float background[3] = {};
};

// One bit per value, from the lowest of the first word on.
using VdbMask = std::span<const uint64_t>;

inline bool IsOn(VdbMask mask, size_t i) { return (mask[i / 64] >> (i % 64) & 1) != 0; }

// Reads a node's values, inactive ones included; `values` has num_components for each bit of
// active.  Errors: kDataLoss, kInvalidArgument.  Memory: the values' twice.
absl::Status ReadVdbValues(ByteReader& reader, const VdbValueFormat& format, VdbMask active,
                           std::span<float> values);

}  // namespace liquidblend::ingest
