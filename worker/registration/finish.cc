#include "worker/registration/finish.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <optional>

#include "core/mesh/cross_product.h"

namespace liquidblend::registration {
namespace {

constexpr int kRelaxSweeps = 3;    // of the averaging inside a folded region
constexpr float kSameSide = 0.3f;  // cosine: neighbours that belong to the same sheet
constexpr float kTurned = -0.1f;   // cosine: turned against each other
constexpr double kMaxTurnedShare = 0.125;

// An orthonormal basis T of the tangent space with det(T, N) > 0.
Eigen::Matrix<float, 4, 3> TangentBasis(const Eigen::Vector4f& normal) {
  Eigen::Index largest = 0;
  normal.cwiseAbs().maxCoeff(&largest);
  Eigen::Matrix<float, 4, 3> basis;
  for (int axis = 0, c = 0; axis < 4; ++axis) {
    if (axis == largest) continue;
    Eigen::Vector4f t = Eigen::Vector4f::Unit(axis);
    t -= normal.dot(t) * normal;
    for (int k = 0; k < c; ++k) t -= basis.col(k).dot(t) * basis.col(k);
    basis.col(c++) = t.normalized();
  }
  Eigen::Matrix4f frame;
  frame << basis, normal;
  if (frame.determinant() < 0) basis.col(0) = -basis.col(0);
  return basis;
}

// The normal of the image of a linear map of the tangent space; zero where it has none.
Eigen::Vector4f ImageNormal(const Eigen::Matrix<float, 4, 3>& columns) {
  const Eigen::Vector4f normal = mesh::CrossProduct(columns);
  const float length = normal.norm();
  return length > 0 ? Eigen::Vector4f(normal / length) : Eigen::Vector4f(Eigen::Vector4f::Zero());
}

// The deformed surface's normal at v by least squares over its neighbours; zero where undefined.
Eigen::Vector4f EstimateNormal(const Surface& source, const IndexLists& neighbors,
                               const Points& displacement, int64_t v) {
  const Eigen::Matrix<float, 4, 3> basis = TangentBasis(source.mesh.normals.col(v));
  Eigen::Matrix<float, 4, 3> image = Eigen::Matrix<float, 4, 3>::Zero();
  Eigen::Matrix3f spread = 1e-4f * Eigen::Matrix3f::Identity();
  for (const int32_t w : neighbors[v]) {
    const Eigen::Vector4f offset = source.points.col(w) - source.points.col(v);
    const Eigen::Vector3f local = basis.transpose() * offset;
    image += (offset + displacement.col(w) - displacement.col(v)) * local.transpose();
    spread += local * local.transpose();
  }
  return ImageNormal(image * spread.inverse());
}

Points ImageNormals(const Surface& source, const IndexLists& neighbors, const Points& displacement,
                    const parallel::Arena& arena) {
  Points normals(4, source.points.cols());
  arena.For(normals.cols(), [&](int64_t v) {
    normals.col(v) = EstimateNormal(source, neighbors, displacement, v);
  });
  return normals;
}

bool IsTurned(const Surface& source, const IndexLists& neighbors, const Points& normals,
              int64_t v) {
  int num_same = 0, num_turned = 0;
  for (const int32_t w : neighbors[v]) {
    if (source.mesh.normals.col(v).dot(source.mesh.normals.col(w)) < kSameSide) continue;
    ++num_same;
    num_turned += normals.col(v).dot(normals.col(w)) < kTurned ? 1 : 0;
  }
  return num_turned > kMaxTurnedShare * num_same;
}

// The vertices flagged and their neighbours, ascending.
std::vector<int32_t> WithRing(const std::vector<int32_t>& vertices, const IndexLists& neighbors) {
  std::vector<int32_t> region = vertices;
  for (const int32_t v : vertices) {
    const auto around = neighbors[v];
    region.insert(region.end(), around.begin(), around.end());
  }
  std::sort(region.begin(), region.end());
  region.erase(std::unique(region.begin(), region.end()), region.end());
  return region;
}

// Inverse-distance averaging of the displacements inside a region; outside they stay.
void AverageInside(const Surface& source, const IndexLists& neighbors,
                   const std::vector<int32_t>& region, const parallel::Arena& arena,
                   Points& displacement) {
  const int64_t count = static_cast<int64_t>(region.size());
  Points next(4, count);
  for (int sweep = 0; sweep < kRelaxSweeps; ++sweep) {
    arena.For(count, [&](int64_t n) {
      const int32_t v = region[n];
      Eigen::Vector4f sum = Eigen::Vector4f::Zero();
      float total = 0;
      for (const int32_t w : neighbors[v]) {
        const float weight =
            1.0f / std::max(1e-3f, (source.points.col(w) - source.points.col(v)).norm());
        sum += weight * displacement.col(w);
        total += weight;
      }
      next.col(n) = total > 0 ? Eigen::Vector4f(sum / total) : Eigen::Vector4f(displacement.col(v));
    });
    for (int64_t n = 0; n < count; ++n) displacement.col(region[n]) = next.col(n);
  }
}

struct Residual {
  Eigen::Vector4f along_normal;  // to be added to the displacement
  float weight;
  float distance;
};

std::optional<Residual> ResidualAt(const Surface& source, const Points& normals,
                                   const ClosestPointSearch& target,
                                   const ProjectionOptions& options, const Points& displacement,
                                   int64_t v) {
  const Eigen::Vector4f p = source.points.col(v) + displacement.col(v);
  const Eigen::Vector4f image = normals.col(v);
  const bool at_end = source.InFirstSlab(v) || source.InLastSlab(v);
  const auto end =
      source.InFirstSlab(v) ? ClosestPointSearch::End::kFirst : ClosestPointSearch::End::kLast;
  auto match = at_end ? target.FindAtEnd(end, p, image) : target.Find(p, image);
  if (!match) return std::nullopt;
  Eigen::Vector4f offset = match->position - p;
  if (at_end) {
    offset[3] = 0;
    match->normal[3] = 0;
    match->normal.normalize();
  }
  const float distance = offset.norm();
  const float q = 1 - distance * distance / (options.max_distance * options.max_distance);
  if (!(q > 0)) return std::nullopt;
  return Residual{match->normal.dot(offset) * match->normal, q * q, distance};
}

}  // namespace

double ProjectOntoTarget(const Surface& source, const IndexLists& neighbors,
                         const ClosestPointSearch& target, const ProjectionOptions& options,
                         const parallel::Arena& arena, Points& displacement) {
  const int64_t count = source.points.cols();
  Points residual = Points::Zero(4, count);
  Eigen::VectorXf weight = Eigen::VectorXf::Zero(count);
  Eigen::VectorXf distance = Eigen::VectorXf::Constant(count, -1.0f);
  const Points normals = ImageNormals(source, neighbors, displacement, arena);
  arena.For(count, [&](int64_t v) {
    const auto found = ResidualAt(source, normals, target, options, displacement, v);
    if (!found) return;
    residual.col(v) = found->along_normal;
    weight[v] = options.stiffness * found->weight;
    distance[v] = found->distance;
  });
  Points correction = residual, next(4, count);
  for (int sweep = 0; sweep < options.sweeps; ++sweep) {
    arena.For(count, [&](int64_t v) {
      Eigen::Vector4f mean = Eigen::Vector4f::Zero();
      const auto around = neighbors[v];
      for (const int32_t w : around) mean += correction.col(w);
      if (!around.empty()) mean /= static_cast<float>(around.size());
      next.col(v) = (weight[v] * residual.col(v) + mean) / (weight[v] + 1);
    });
    correction.swap(next);
  }
  displacement += correction;
  const double found = arena.Sum(count, [&](int64_t v) { return distance[v] >= 0 ? 1.0 : 0.0; });
  return found > 0
             ? arena.Sum(count, [&](int64_t v) { return std::max(0.0f, distance[v]); }) / found
             : 0.0;
}

int64_t RelaxFolds(const Surface& source, const IndexLists& neighbors, int max_rounds,
                   const parallel::Arena& arena, Points& displacement) {
  const int64_t count = source.points.cols();
  Points normals = ImageNormals(source, neighbors, displacement, arena);
  std::vector<char> turned(count, 0);
  arena.For(count, [&](int64_t v) { turned[v] = IsTurned(source, neighbors, normals, v); });
  for (int round = 0;; ++round) {
    std::vector<int32_t> bad;
    for (int64_t v = 0; v < count; ++v) {
      if (turned[v]) bad.push_back(static_cast<int32_t>(v));
    }
    if (bad.empty() || round == max_rounds) return static_cast<int64_t>(bad.size());
    const std::vector<int32_t> region = WithRing(bad, neighbors);
    AverageInside(source, neighbors, region, arena, displacement);
    const std::vector<int32_t> changed = WithRing(region, neighbors);
    const int64_t num_changed = static_cast<int64_t>(changed.size());
    arena.For(num_changed, [&](int64_t n) {
      normals.col(changed[n]) = EstimateNormal(source, neighbors, displacement, changed[n]);
    });
    const std::vector<int32_t> affected = WithRing(changed, neighbors);
    arena.For(static_cast<int64_t>(affected.size()), [&](int64_t n) {
      turned[affected[n]] = IsTurned(source, neighbors, normals, affected[n]);
    });
  }
}

Points Smooth(const Points& displacement, const IndexLists& neighbors, int sweeps,
              const parallel::Arena& arena) {
  Points smooth = displacement, next(4, displacement.cols());
  for (int sweep = 0; sweep < sweeps; ++sweep) {
    arena.For(smooth.cols(), [&](int64_t v) {
      Eigen::Vector4f sum = smooth.col(v);
      for (const int32_t w : neighbors[v]) sum += smooth.col(w);
      next.col(v) = sum / static_cast<float>(neighbors[v].size() + 1);
    });
    smooth.swap(next);
  }
  return smooth;
}

}  // namespace liquidblend::registration
