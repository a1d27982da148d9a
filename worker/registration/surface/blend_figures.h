// Figures from slices of a registered source's blends. Internal to worker/registration.
#pragma once

#include <array>
#include <span>
#include <vector>

#include "core/mesh/components.h"
#include "core/mesh/triangle_mesh.h"
#include "worker/registration/surface/regions.h"
#include "worker/registration/surface/surface.h"

namespace liquidblend::registration {

// The source's vertices at a weight, metres and frames; end slabs stay outside of the animation.
//   displacement  a column per source vertex, registration units
Eigen::Matrix4Xf BlendAt(const Surface& source, const Points& displacement, float weight);

// Weights between the animations at which blends are looked at.
inline constexpr std::array kBlendWeights = {0.25f, 0.5f, 0.75f};

// Components of slices of the mesh, with its vertices at `vertices_m`, at each of the times
// (frames, ascending).  Threads: same bytes for any thread count.
std::vector<std::vector<mesh::Component>> ComponentsAt(const mesh::SpaceTimeMesh& mesh,
                                                       const Eigen::Matrix4Xf& vertices_m,
                                                       std::span<const double> times,
                                                       const parallel::Arena& arena);

// Some times from the first frame to the last, evenly spread, frames.
std::vector<double> SliceTimes(const mesh::SpaceTimeMesh& mesh);

// Slices of the blend with a weight at those times.
//   displacement  a column per source vertex, registration units
// Threads: same bytes for any thread count.
std::vector<mesh::TriangleMesh> SliceBlend(const Surface& source, const Points& displacement,
                                           float weight, const parallel::Arena& arena);

// The target's slices at the same times; times after its end get its last frame.
std::vector<mesh::TriangleMesh> SliceTarget(const mesh::SpaceTimeMesh& source,
                                            const mesh::SpaceTimeMesh& target,
                                            const parallel::Arena& arena);

// Volumes of the half-way blend's slices over the means of the two animations', minus 1.
std::vector<double> VolumeErrors(const std::vector<mesh::TriangleMesh>& source,
                                 const std::vector<mesh::TriangleMesh>& target,
                                 const std::vector<mesh::TriangleMesh>& half_way);

// Mean difference in the number of components, without components below a thousandth of the liquid.
double ComponentError(const std::vector<mesh::TriangleMesh>& a,
                      const std::vector<mesh::TriangleMesh>& b);

// Mean over the slices of how far the blend's number of components is from those of the two
// animations, and what lies between them; without components below a thousandth of the liquid.
//   more  per slice: components that a blend may have beside these
double ComponentErrorBetween(const std::vector<mesh::TriangleMesh>& source,
                             const std::vector<mesh::TriangleMesh>& target,
                             const std::vector<mesh::TriangleMesh>& blend,
                             const std::vector<int>& more);

// Share of the slices' surface that is inside out: of the crossings of rays along x and z, half an
// edge apart, those with winding numbers below 0 on one of their sides; adds them to the regions.
double InvertedShare(const std::vector<mesh::TriangleMesh>& slices, const mesh::SpaceTimeMesh& mesh,
                     const parallel::Arena& arena, Regions& regions);

}  // namespace liquidblend::registration
