#include "core/finish/velocities.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <vector>

#include "core/finish/normals.h"

namespace liquidblend::finish {
namespace {

using Eigen::Matrix4f;
using Eigen::Vector4f;

// Regularisation of the fit, as a share of its trace. It leaves directions unchanged in which there
// is no edge, first of all the normal's.
constexpr float kRegularisation = 1e-4F;
// Lowest rate of time. In a fold time may stand still or run backwards; a particle there gets the
// speed at this rate.
constexpr float kLeastTimeRate = 0.1F;
// Largest change of a velocity, beside its own length. Where a registration is steep because it
// found no match, as in chaotic jets, the fit would give a still vertex a high speed.
constexpr float kMostChange = 0.1F;  // edges per frame

// The value of vertex v: x, y, z in metres, t in frames.
Vector4f At(const mesh::TimeAxis& axis, std::span<const mesh::Float4> values, int32_t v) {
  Vector4f at = Eigen::Map<const Vector4f>(values[v].data());
  at[3] = static_cast<float>(axis.Frames(at[3]));
  return at;
}

// One vertex of the slice: the edge it lies on, as blended and in the source.
struct Crossing {
  int32_t low, high;  // the family's vertices
  float share;        // of `high`
  Vector4f blended;   // from low to high
  Vector4f source;
  Vector4f place;  // of the vertex, as blended
};

std::vector<Crossing> FindCrossings(const mesh::RegisteredFamily& family,
                                    const CrossedEdges& crossed) {
  const mesh::TimeAxis axis = family.time_axis();
  const double time = axis.Frames(crossed.time_ticks);
  std::vector<Crossing> crossings(crossed.low.size());
  for (int32_t i = 0; i < static_cast<int32_t>(crossings.size()); ++i) {
    const Vector4f a = At(axis, crossed.low_positions, i);
    const Vector4f b = At(axis, crossed.high_positions, i);
    const double from = axis.Frames(crossed.low_positions[i][3]);
    const double to = axis.Frames(crossed.high_positions[i][3]);
    Crossing& crossing = crossings[i];
    crossing.low = crossed.low[i];
    crossing.high = crossed.high[i];
    crossing.share = static_cast<float>((time - from) / (to - from));
    crossing.blended = b - a;
    crossing.place = a + crossing.share * (b - a);
    crossing.source =
        At(axis, family.vertices, crossing.high) - At(axis, family.vertices, crossing.low);
  }
  return crossings;
}

// Sums over a vertex and its neighbours: `total[i]` = own[i] + own of each neighbour.
template <typename Value>
std::vector<Value> AddNeighbors(const mesh::TriangleMesh& surface, const std::vector<Value>& own) {
  std::vector<Value> total = own;
  for (Eigen::Index t = 0; t < surface.num_triangles(); ++t) {
    for (int k = 0; k < 3; ++k) {
      total[surface.triangles(k, t)] += own[surface.triangles((k + 1) % 3, t)];
    }
  }
  return total;
}

// Sets velocities along the normals. An edge (dx, dt) of the hypersurface satisfies n . dx = v dt
// for the speed v along the normal n; v is the least-squares fit over the edges around.
void AddNormalVelocities(const std::vector<Crossing>& crossings, float frames_per_second,
                         mesh::TriangleMesh& surface) {
  mesh::TriangleMesh with_normals;
  with_normals.vertices = surface.vertices;
  with_normals.triangles = surface.triangles;
  AddNormals(with_normals);
  const Eigen::Matrix3Xf& normals = with_normals.normals;
  std::vector<Eigen::Array2f> sums(crossings.size());
  for (size_t i = 0; i < crossings.size(); ++i) {
    const Vector4f& edge = crossings[i].blended;
    const float along_normal = normals.col(static_cast<Eigen::Index>(i)).dot(edge.head<3>());
    sums[i] = Eigen::Array2f(along_normal * edge[3], edge[3] * edge[3]);
  }
  sums = AddNeighbors(surface, sums);
  surface.velocities.resize(3, surface.num_vertices());
  for (Eigen::Index i = 0; i < surface.num_vertices(); ++i) {
    const float speed = sums[i][1] > 0.0F ? sums[i][0] / sums[i][1] : 0.0F;
    surface.velocities.col(i) = frames_per_second * speed * normals.col(i);
  }
}

// The least-squares fit of a linear map to pairs: moved = map * source.
struct Fit {
  Matrix4f moved_source = Matrix4f::Zero();   // sum of moved source^T
  Matrix4f source_source = Matrix4f::Zero();  // sum of source source^T

  void Add(const Vector4f& moved, const Vector4f& source) {
    moved_source.noalias() += moved * source.transpose();
    source_source.noalias() += source * source.transpose();
  }
  Fit& operator+=(const Fit& other) {
    moved_source += other.moved_source;
    source_source += other.source_source;
    return *this;
  }
  Vector4f Apply(const Vector4f& x) const {
    Matrix4f regular = source_source;
    regular.diagonal().array() += kRegularisation * source_source.trace();
    const Vector4f solved = regular.llt().solve(x);
    const Vector4f result = moved_source * solved;
    return result.allFinite() ? result : Vector4f::Zero();  // nothing to fit
  }
};

// Fits the derivative of the blend's motion around each vertex of the slice.
//   scale  of lengths and times: edges and frames
std::vector<Fit> FitMotion(const mesh::RegisteredFamily& family,
                           const std::vector<Crossing>& crossings, const Vector4f& scale,
                           const mesh::TriangleMesh& surface) {
  const mesh::TimeAxis axis = family.time_axis();
  std::vector<Vector4f> source(crossings.size());  // where the slice's vertices come from
  std::vector<Vector4f> moved(crossings.size());   // and how far
  std::vector<Fit> fits(crossings.size());
  for (size_t i = 0; i < crossings.size(); ++i) {
    const Crossing& crossing = crossings[i];
    const Vector4f edge = scale.cwiseProduct(crossing.source);
    fits[i].Add(scale.cwiseProduct(crossing.blended) - edge, edge);
    const Vector4f low = scale.cwiseProduct(At(axis, family.vertices, crossing.low));
    source[i] = low + crossing.share * edge;
    moved[i] = scale.cwiseProduct(crossing.place) - source[i];
  }
  fits = AddNeighbors(surface, fits);
  for (Eigen::Index t = 0; t < surface.num_triangles(); ++t) {
    for (int k = 0; k < 3; ++k) {
      const int i = surface.triangles(k, t);
      const int j = surface.triangles((k + 1) % 3, t);
      fits[i].Add(moved[j] - moved[i], source[j] - source[i]);
    }
  }
  return fits;
}

void CarryVelocities(const mesh::RegisteredFamily& family, const std::vector<Crossing>& crossings,
                     mesh::TriangleMesh& surface) {
  const float unit_m = family.edge_length_m > 0.0 ? static_cast<float>(family.edge_length_m) : 1.0F;
  const auto fps = static_cast<float>(family.frames_per_second);
  const Vector4f scale(1 / unit_m, 1 / unit_m, 1 / unit_m, 1.0F);  // edges and frames
  const std::vector<Fit> fits = FitMotion(family, crossings, scale, surface);
  surface.velocities.resize(3, surface.num_vertices());
  for (size_t i = 0; i < crossings.size(); ++i) {
    const Crossing& crossing = crossings[i];
    const Eigen::Map<const Eigen::Vector3f> low(family.velocities[crossing.low].data());
    const Eigen::Map<const Eigen::Vector3f> high(family.velocities[crossing.high].data());
    const Eigen::Vector3f velocity = low + crossing.share * (high - low);
    Vector4f direction;
    direction << velocity / (fps * unit_m), 1.0F;
    const Vector4f change = fits[i].Apply(direction);
    const float time_rate = std::max(1.0F + change[3], kLeastTimeRate);
    const Eigen::Vector3f carried = (velocity + fps * unit_m * change.head<3>()) / time_rate;
    const float most = velocity.norm() + kMostChange * fps * unit_m;
    const float length = (carried - velocity).norm();
    const float share = length > most ? most / length : 1.0F;
    surface.velocities.col(static_cast<Eigen::Index>(i)) = velocity + share * (carried - velocity);
  }
}

}  // namespace

void AddVelocities(const mesh::RegisteredFamily& family, const CrossedEdges& crossed,
                   mesh::TriangleMesh& surface) {
  const std::vector<Crossing> crossings = FindCrossings(family, crossed);
  if (family.velocities.empty()) {
    AddNormalVelocities(crossings, static_cast<float>(family.frames_per_second), surface);
  } else {
    CarryVelocities(family, crossings, surface);
  }
}

}  // namespace liquidblend::finish
