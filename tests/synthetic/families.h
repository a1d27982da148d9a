// Space-time meshes of moving spheres and tori out of each cell kind, and families that move their
// vertices at will. All are closed; how they fold is up to the fields.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <functional>
#include <vector>

#include "core/mesh/registered_family.h"
#include "core/mesh/space_time_mesh.h"

namespace liquidblend::synthetic {

// Layers of vertices at every frame, one more before the first and one after the last: the end
// slabs. A point p of the surface at frame 0 is at centre + velocity * t + (1 + growth * t) * p.
struct ComplexOptions {
  int num_frames = 8;  // >= 1
  Eigen::Vector3f centre_m = {0, 0, 0};
  Eigen::Vector3f velocity_m_per_frame = {0, 0, 0};
  float growth_per_frame = 0.0F;  // 1 + growth * t > 0 from -1 to num_frames
};

// The surfaces have radius 1 m. Spheres from a cube of cells_per_side^2 quads a side, or from an
// icosahedron of 20 * 4^subdivisions triangles.
mesh::SpaceTimeMesh HexahedralSphere(int cells_per_side, const ComplexOptions& options = {});
mesh::SpaceTimeMesh HexahedralTorus(int num_major, int num_minor,
                                    const ComplexOptions& options = {});
mesh::SpaceTimeMesh WedgeSphere(int subdivisions, const ComplexOptions& options = {});
// The wedges, each cut into three by the rule of the paper's appendix: the diagonal of a side goes
// through the vertex of the higher number.
mesh::SpaceTimeMesh TetrahedralSphere(int subdivisions, const ComplexOptions& options = {});
// All four kinds: a sphere of quads and triangles, some of whose hexahedra and wedges are cones
// (pyramids and tetrahedra) from their centroids.
mesh::SpaceTimeMesh MixedSphere(int cells_per_side, const ComplexOptions& options = {});

// Number and place (m, m, m, frames) of a vertex -> its displacement (m, m, m, frames).
using Field = std::function<Eigen::Vector4f(int64_t, const Eigen::Vector4f&)>;

// A sum of plane waves through space-time whose amplitudes are these; it folds where they are large
// against the wavelengths of 1 to 3 m and 3 to 9 frames.
Field SmoothWarp(uint64_t seed, float amplitude_m, float amplitude_frames);

// Each vertex anywhere within these amplitudes, independent of its neighbours.
Field Noise(uint64_t seed, float amplitude_m, float amplitude_frames);

struct TargetFields {
  Field displacement;
  Field extrapolation;  // none: as displacement
};

// A family that owns its arrays; its domain is twice the source's bounds.
mesh::RegisteredFamily MakeFamily(mesh::SpaceTimeMesh mesh,
                                  const std::vector<TargetFields>& targets);

}  // namespace liquidblend::synthetic
