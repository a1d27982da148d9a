// A picture of a liquid: ray-traced, smooth, see-through where it is thin, on a studio floor. z is
// up (see upright.h).
#pragma once

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "client/cli/render/camera.h"
#include "client/cli/render/image.h"
#include "liquidblend/mesh.h"

namespace liquidblend::render {

struct WaterOptions {
  int width = 320;                // [16, 8192]
  int height = 240;               // [16, 8192]
  int samples_per_side = 3;       // [1, 16]; squared: rays per pixel
  CameraOptions camera;           //
  absl::Status Validate() const;  // names the first field out of range, and its value
};

// Renders `mesh`; the camera and the floor fit `bounds`, so that pictures of one animation match.
// Errors: kInvalidArgument, kInternal.  Threads: uses all cores; same bytes for any number.
// Cost: about 0.5 s for 320 x 240 on two cores.
absl::StatusOr<Image> RenderWater(const Mesh& mesh, const Bounds& bounds,
                                  const WaterOptions& options = {});

}  // namespace liquidblend::render
