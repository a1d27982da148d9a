#include "client/cli/export/voxels.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>

#include "absl/container/flat_hash_set.h"
#include "absl/strings/str_cat.h"

namespace liquidblend::cli {
namespace {

constexpr double kMaxBytes = 24e9;
constexpr double kMaxVoxels = 1e8;          // along the surface, each with a few to both sides
constexpr double kMaxCoordinate = 1 << 30;  // in voxels; the library adds some
constexpr int64_t kMaxSamples = 400'000'000;

constexpr double kReach = 1.5;    // of a sample, in voxels: half of the band, which boxes overrate
constexpr double kSpacing = 3.0;  // of samples, in voxels: their boxes touch

// Nodes of OpenVDB's tree: their width, in voxels, and the bytes that one takes while a level set
// is made, measured with scattered triangles, lines and planes. Several trees have it then.
struct NodeKind {
  double width;
  double num_bytes;
};
constexpr std::array<NodeKind, 3> kNodes = {{{8.0, 7.5e3}, {128.0, 132e3}, {4096.0, 1.05e6}}};

using Vector = std::array<double, 3>;  // in voxels
using NodeKey = std::array<int32_t, 3>;

Vector Mix(const Vector& a, const Vector& b, double share) {
  Vector mixed;
  for (size_t k = 0; k < 3; ++k) mixed[k] = a[k] + share * (b[k] - a[k]);
  return mixed;
}

double Distance(const Vector& a, const Vector& b) {
  const double x = a[0] - b[0], y = a[1] - b[1], z = a[2] - b[2];
  return std::sqrt(x * x + y * y + z * z);
}

// The leaf that a point is in, moved by `shift` in each direction.
NodeKey KeyAt(const Vector& point, double shift) {
  NodeKey key;
  for (size_t k = 0; k < 3; ++k) {
    key[k] = static_cast<int32_t>(std::floor((point[k] + shift) / kNodes[0].width));
  }
  return key;
}

// Nodes that hold voxels near a surface.
class NodeCounter {
 public:
  // Adds those around a point.
  void Add(const Vector& point) {
    ++num_samples_;
    AddLeaves(KeyAt(point, -kReach), KeyAt(point, kReach));
  }

  bool is_full() const { return num_bytes_ > kMaxBytes || num_samples_ > kMaxSamples; }

 private:
  void AddLeaves(const NodeKey& low, const NodeKey& high) {
    if (low == low_ && high == high_) return;  // as for the sample before
    low_ = low;
    high_ = high;
    for (int32_t x = low[0]; x <= high[0]; ++x) {
      for (int32_t y = low[1]; y <= high[1]; ++y) {
        for (int32_t z = low[2]; z <= high[2]; ++z) AddNode(0, {x, y, z});
      }
    }
  }

  // Adds a node, and those that it is in.
  void AddNode(size_t kind, const NodeKey& key) {
    if (!nodes_[kind].insert(key).second) return;
    num_bytes_ += kNodes[kind].num_bytes;
    if (kind + 1 == kNodes.size()) return;
    const auto factor = static_cast<int32_t>(kNodes[kind + 1].width / kNodes[kind].width);
    NodeKey parent;
    for (size_t k = 0; k < 3; ++k) parent[k] = (key[k] - (key[k] < 0 ? factor - 1 : 0)) / factor;
    AddNode(kind + 1, parent);
  }

  std::array<absl::flat_hash_set<NodeKey>, kNodes.size()> nodes_;
  NodeKey low_ = {1, 1, 1}, high_ = {0, 0, 0};  // of no box
  double num_bytes_ = 0.0;
  int64_t num_samples_ = 0;
};

struct Triangle {
  std::array<Vector, 3> corners;
  double length = 0.0;  // of the longest side, which is that of the first two corners
  double height = 0.0;  // over it
  double area = 0.0;
};

Triangle MakeTriangle(const Mesh& mesh, size_t index, double voxel_size_m) {
  Triangle triangle;
  std::array<Vector, 3>& corners = triangle.corners;
  for (size_t n = 0; n < 3; ++n) {
    const float* position = &mesh.positions[3 * size_t{mesh.triangles[3 * index + n]}];
    for (size_t k = 0; k < 3; ++k) corners[n][k] = double{position[k]} / voxel_size_m;
  }
  for (int turn = 0; turn < 3; ++turn) {
    const double length = Distance(corners[0], corners[1]);
    const bool is_longest =
        length >= Distance(corners[1], corners[2]) && length >= Distance(corners[2], corners[0]);
    triangle.length = length;
    if (is_longest) break;
    std::rotate(corners.begin(), corners.begin() + 1, corners.end());
  }
  if (triangle.length == 0.0) return triangle;
  double along = 0.0;  // of the third corner
  for (size_t k = 0; k < 3; ++k) {
    along += (corners[1][k] - corners[0][k]) * (corners[2][k] - corners[0][k]);
  }
  const double share = along / (triangle.length * triangle.length);
  triangle.height = Distance(Mix(corners[0], corners[1], share), corners[2]);
  triangle.area = triangle.length * triangle.height / 2.0;
  return triangle;
}

// Rows of samples from the longest side to the corner that faces it.
void AddTriangle(const Triangle& triangle, NodeCounter& counter) {
  const double num_rows = std::ceil(triangle.height / kSpacing);
  for (double row = 0.0; row <= num_rows; ++row) {
    const double up = num_rows > 0.0 ? row / num_rows : 0.0;
    const Vector begin = Mix(triangle.corners[0], triangle.corners[2], up);
    const Vector end = Mix(triangle.corners[1], triangle.corners[2], up);
    const double num_steps = std::ceil(Distance(begin, end) / kSpacing);
    for (double step = 0.0; step <= num_steps && !counter.is_full(); ++step) {
      counter.Add(num_steps > 0.0 ? Mix(begin, end, step / num_steps) : begin);
    }
  }
}

absl::Status TooFine(double voxel_size_m, absl::string_view why) {
  return absl::InvalidArgumentError(
      absl::StrCat("--voxel-size ", voxel_size_m, ": ", why, "; choose a larger one"));
}

absl::Status CheckCoordinates(const Mesh& mesh, double voxel_size_m) {
  float farthest = 0.0F;
  for (const float x : mesh.positions) farthest = std::max(farthest, std::abs(x));
  if (farthest / voxel_size_m <= kMaxCoordinate) return absl::OkStatus();
  return TooFine(voxel_size_m,
                 absl::StrCat("a surface ", farthest, " metres from the origin is more than ",
                              kMaxCoordinate, " voxels away from it"));
}

}  // namespace

absl::Status CheckVoxels(const Mesh& mesh, double voxel_size_m) {
  const absl::Status far = CheckCoordinates(mesh, voxel_size_m);
  if (!far.ok()) return far;
  double area = 0.0;
  for (size_t t = 0; t < mesh.num_triangles(); ++t) {
    area += MakeTriangle(mesh, t, voxel_size_m).area;
  }
  if (area > kMaxVoxels) {
    return TooFine(voxel_size_m,
                   absl::StrCat("a surface of ", area * voxel_size_m * voxel_size_m,
                                " square metres would have more than ", kMaxVoxels, " voxels"));
  }
  NodeCounter counter;
  for (size_t t = 0; t < mesh.num_triangles() && !counter.is_full(); ++t) {
    AddTriangle(MakeTriangle(mesh, t, voxel_size_m), counter);
  }
  if (!counter.is_full()) return absl::OkStatus();
  return TooFine(voxel_size_m, absl::StrCat("a level set around this surface would take more than ",
                                            kMaxBytes / 1e9, " GB"));
}

}  // namespace liquidblend::cli
