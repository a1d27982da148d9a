#include "core/finish/smooth_surface.h"

#include <cassert>

#include "absl/strings/str_cat.h"

namespace liquidblend::finish {
namespace {

constexpr int kMaxPasses = 32;
// Taubin 1995: 1/strength + 1/back = pass band, of which 0.1 is the usual choice.
constexpr double kPassBand = 0.1;

// Counts the neighbours of each vertex. In a closed surface each edge runs once in either
// direction.
Eigen::VectorXf CountNeighbors(const mesh::TriangleMesh& surface) {
  Eigen::VectorXf count = Eigen::VectorXf::Zero(surface.num_vertices());
  for (const int v : surface.triangles.reshaped()) count[v] += 1.0F;
  return count;
}

// One pass: vertices += factor * (mean of the neighbours - vertices).
void Pass(const mesh::TriangleMesh& surface, const Eigen::VectorXf& num_neighbors, float factor,
          Eigen::Matrix3Xf& vertices) {
  Eigen::Matrix3Xf sum = Eigen::Matrix3Xf::Zero(3, vertices.cols());
  for (Eigen::Index t = 0; t < surface.num_triangles(); ++t) {
    for (int k = 0; k < 3; ++k) {
      sum.col(surface.triangles(k, t)) += vertices.col(surface.triangles((k + 1) % 3, t));
    }
  }
  for (Eigen::Index v = 0; v < vertices.cols(); ++v) {
    if (num_neighbors[v] == 0.0F) continue;
    const Eigen::Vector3f mean = sum.col(v) / num_neighbors[v];
    vertices.col(v) += factor * (mean - vertices.col(v));
  }
}

// The factor of the pass outward that undoes the shrinking of one with this strength.
double FactorBack(double strength) { return 1.0 / (kPassBand - 1.0 / strength); }

}  // namespace

absl::Status SmoothingOptions::Validate() const {
  if (passes < 0 || passes > kMaxPasses) {
    return absl::InvalidArgumentError(
        absl::StrCat("passes is ", passes, ", not in [0, ", kMaxPasses, "]"));
  }
  if (!(strength > 0.0 && strength <= 1.0)) {
    return absl::InvalidArgumentError(absl::StrCat("strength is ", strength, ", not in (0, 1]"));
  }
  if (!(max_offset_edges > 0.0)) {
    return absl::InvalidArgumentError(
        absl::StrCat("max_offset_edges is ", max_offset_edges, ", not greater than 0"));
  }
  return absl::OkStatus();
}

void SmoothSurface(const SmoothingOptions& options, mesh::TriangleMesh& surface) {
  assert(options.Validate().ok());
  if (options.passes == 0) return;
  const Eigen::VectorXf num_neighbors = CountNeighbors(surface);
  Eigen::Matrix3Xf moved = surface.vertices;
  for (int pass = 0; pass < options.passes; ++pass) {
    Pass(surface, num_neighbors, static_cast<float>(options.strength), moved);
    if (options.kind == SmoothingKind::kTaubin) {
      Pass(surface, num_neighbors, static_cast<float>(FactorBack(options.strength)), moved);
    }
  }
  const auto limit = static_cast<float>(options.max_offset_edges * mesh::MeanEdgeLength(surface));
  for (Eigen::Index v = 0; v < surface.num_vertices(); ++v) {
    Eigen::Vector3f offset = moved.col(v) - surface.vertices.col(v);
    const float length = offset.norm();
    if (length > limit) offset *= limit / length;
    surface.vertices.col(v) += offset;
  }
}

}  // namespace liquidblend::finish
