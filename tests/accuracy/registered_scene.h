// A scene's inputs, registered, and surfaces of their blends.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "core/blend/life_limits.h"
#include "core/mesh/registered_family.h"
#include "core/mesh/triangle_mesh.h"
#include "core/parallel/arena.h"
#include "core/slice/slice.h"
#include "tests/accuracy/scene.h"
#include "worker/registration/register.h"

namespace liquidblend::accuracy {

struct Costs {
  double build_s = 0.0;                // all space-time meshes
  std::vector<double> registration_s;  // per target
  double peak_mb = 0.0;                // of the process, after the last registration
};

// Threads: Cut() is safe.
class RegisteredScene {
 public:
  // The first of the scene's inputs is the source of all registrations.
  //   correspondences  none, or one list per target
  // Errors: those of building and registering, with the input's name.
  static absl::StatusOr<RegisteredScene> Register(
      const Scene& scene,
      const std::vector<std::vector<registration::Correspondence>>& correspondences,
      const registration::RegistrationOptions& options, const parallel::Arena& arena);

  // The surface that the server answers with: weights are clamped where a part would live too
  // short. Requires: one weight per target; frame in [0, num_frames - 1].
  mesh::TriangleMesh Cut(std::vector<double> weights, double frame) const;

  const mesh::RegisteredFamily& family() const { return *family_; }
  const Costs& costs() const { return costs_; }

 private:
  RegisteredScene() = default;
  std::unique_ptr<mesh::RegisteredFamily> family_;
  std::unique_ptr<slice::CellIndex> index_;
  blend::LifeLimits life_limits_;
  Costs costs_;
};

}  // namespace liquidblend::accuracy
