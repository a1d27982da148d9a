// What tests of the encoder share.
#pragma once

#include <gtest/gtest.h>

#include <string>
#include <utility>

#include "tests/server/encode/judge.h"

namespace liquidblend::encode {

// A grid around the origin, 4 m wide.
inline DracoOptions OptionsWith(int position_bits) {
  DracoOptions options;
  options.position_bits = position_bits;
  options.grid.origin = {-2.0F, -2.0F, -2.0F};
  options.grid.extent_m = 4.0F;
  return options;
}

// A failure of the test, and an empty mesh, if TryDecode() refuses the bytes.
inline mesh::TriangleMesh Decode(const std::string& data) {
  absl::StatusOr<mesh::TriangleMesh> mesh = TryDecode(data);
  EXPECT_TRUE(mesh.ok()) << mesh.status();
  return mesh.ok() ? *std::move(mesh) : mesh::TriangleMesh();
}

}  // namespace liquidblend::encode
