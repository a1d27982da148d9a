// The family that blending and slicing are measured on.
#pragma once

#include "core/mesh/registered_family.h"
#include "core/slice/cell_index.h"

namespace liquidblend::bench {

struct WarpedTorus {
  int vertices_per_frame = 50000;
  int num_frames = 40;
  int warp_frames = 10;
  int num_targets = 1;
  auto operator<=>(const WarpedTorus&) const = default;
};

struct Loaded {
  explicit Loaded(mesh::RegisteredFamily registered);
  const mesh::RegisteredFamily family;
  const slice::CellIndex index;
};

// A growing, moving torus of quads and its targets, which are alike: each moves by 5 cm, and its
// events are shifted by up to warp_frames with a wavelength of half the torus, so the steepest
// place has about warp_frames * pi frames a metre. Made once; the one before is dropped when
// another is asked for.
const Loaded& FamilyOf(const WarpedTorus& torus);

}  // namespace liquidblend::bench
