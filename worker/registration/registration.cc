#include "worker/registration/registration.h"

#include "core/base/status_macros.h"
#include "core/mesh/option_ranges.h"

namespace liquidblend::registration {

absl::Status RegistrationOptions::Validate() const {
  constexpr mesh::Range kShare = {0, 1}, kNotNegative = {0, 1e9}, kPositive = {1e-9, 1e9};
  LB_RETURN_IF_ERROR(mesh::RegistrationOptions::Validate());
  LB_RETURN_IF_ERROR(mesh::CheckRange("kept_share", kept_share, kShare));
  LB_RETURN_IF_ERROR(mesh::CheckRange("first_smoothness", first_smoothness, kPositive));
  LB_RETURN_IF_ERROR(mesh::CheckRange("first_distance_edges", first_distance_edges, kPositive));
  LB_RETURN_IF_ERROR(mesh::CheckRange("final_distance_edges", final_distance_edges, kPositive));
  LB_RETURN_IF_ERROR(mesh::CheckRange("point_weight", point_weight, kNotNegative));
  LB_RETURN_IF_ERROR(mesh::CheckRange("plane_weight", plane_weight, kNotNegative));
  LB_RETURN_IF_ERROR(
      mesh::CheckRange("correspondence_weight", correspondence_weight, kNotNegative));
  LB_RETURN_IF_ERROR(mesh::CheckRange("soft_release", soft_release, kShare));
  LB_RETURN_IF_ERROR(mesh::CheckRange("coarse_vertices", coarse_vertices, {1e3, 1e9}));
  LB_RETURN_IF_ERROR(mesh::CheckRange("smallest_part_edges", smallest_part_edges, kNotNegative));
  LB_RETURN_IF_ERROR(mesh::CheckRange("finer_from_edges", finer_from_edges, kPositive));
  return mesh::CheckRange("max_direct_rows", max_direct_rows, kNotNegative);
}

}  // namespace liquidblend::registration
