#include "worker/spacetime/match_volume.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>

namespace liquidblend::spacetime {
namespace {

constexpr int kRounds = 4;
constexpr double kMaxOffsetEdges = 0.1;  // a frame that needs more is left as it is

struct Slice {
  double volume_m3 = 0, area_m2 = 0;
};

Slice Measure(const mesh::SpaceTimeMesh& mesh, const FrameHexahedra& frame) {
  Slice slice;
  for (const mesh::Hexahedron& hexahedron : frame.hexahedra) {
    std::array<Eigen::Vector3d, 4> corner;
    for (int c = 0; c < 4; ++c) {
      const Eigen::Vector4d a = mesh.vertices.col(hexahedron[c]).cast<double>();
      const Eigen::Vector4d b = mesh.vertices.col(hexahedron[c + 4]).cast<double>();
      corner[c] = (a + (frame.time - a.w()) / (b.w() - a.w()) * (b - a)).head<3>();
    }
    // Corners 0, 2, 3, 1 go round the quad, seen from outside of the liquid.
    const Eigen::Vector3d across = corner[3] - corner[0], other = corner[2] - corner[1];
    const Eigen::Vector3d area = 0.5 * other.cross(across);
    const Eigen::Vector3d centre = 0.25 * (corner[0] + corner[1] + corner[2] + corner[3]);
    slice.volume_m3 += area.dot(centre) / 3;
    slice.area_m2 += area.norm();
  }
  return slice;
}

// Outward, metres.
double OffsetOf(const mesh::SpaceTimeMesh& mesh, const FrameHexahedra& frame) {
  const Slice slice = Measure(mesh, frame);
  if (!(slice.area_m2 > 0)) return 0.0;
  const double offset = (frame.volume_m3 - slice.volume_m3) / slice.area_m2;
  return std::abs(offset) <= kMaxOffsetEdges * mesh.edge_length_m ? offset : 0.0;
}

}  // namespace

void MatchVolumes(std::span<const FrameHexahedra> frames, const parallel::Arena& arena,
                  mesh::SpaceTimeMesh& mesh) {
  if (frames.empty()) return;
  std::vector<double> offset(frames.size());
  const std::vector<char> rigid = mesh::RigidVertices(mesh);
  for (int round = 0; round < kRounds; ++round) {
    arena.Run(static_cast<int64_t>(frames.size()),
              [&](int64_t n) { offset[n] = OffsetOf(mesh, frames[n]); });
    arena.For(mesh.num_vertices(), [&](int64_t v) {
      if (rigid[v]) return;
      const double time = mesh.vertices(3, v);
      const auto after =
          std::lower_bound(frames.begin(), frames.end(), time,
                           [](const FrameHexahedra& frame, double t) { return frame.time < t; });
      const int64_t n = after - frames.begin();
      double wanted = 0;
      if (after == frames.begin()) {
        wanted = offset.front();
      } else if (after == frames.end()) {
        wanted = offset.back();
      } else {
        const double share = (time - frames[n - 1].time) / (frames[n].time - frames[n - 1].time);
        wanted = (1 - share) * offset[n - 1] + share * offset[n];
      }
      const Eigen::Vector3f normal = mesh.normals.col(v).head<3>();
      mesh.vertices.col(v).head<3>() += static_cast<float>(wanted) * normal;
    });
  }
}

}  // namespace liquidblend::spacetime
