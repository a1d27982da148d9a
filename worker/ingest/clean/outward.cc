#include "worker/ingest/clean/outward.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "core/base/status_macros.h"

namespace liquidblend::ingest {
namespace {

using Eigen::Vector3d;

// Volumes below this share of the sum of their terms may be due to rounding.
constexpr double kRounding = 1e-9;
// The most comparisons of a triangle with rays, on average, those of searches among them. Foam of a
// hundred thousand bubbles takes tens.
constexpr int64_t kMostComparisons = 1000;

// Places of a part at which the other parts' winding number is looked up. Parts that cross each
// other may differ in it; most places decide.
constexpr int kNumPlaces = 5;

// A connected part of the surface.
struct SurfacePart {
  int32_t first_triangle = -1;
  int32_t num_triangles = 0;
  int facing = 0;          // 1: outward, -1: inward, 0: it encloses no volume
  int num_at_liquid = 0;   // of its places, those that bound liquid
  double volume = 0.0;     // signed, times 6
  double magnitude = 0.0;  // of the volume's terms, summed up

  bool IsInsideOut() const { return facing != 0 && 2 * num_at_liquid < kNumPlaces; }
};

struct PartsOfFrame {
  std::vector<SurfacePart> parts;  // in the order of their first triangles
  std::vector<int32_t> part_of;    // per vertex
};

Vector3d Position(const mesh::TriangleMesh& mesh, int32_t v) {
  return mesh.vertices.col(v).cast<double>();
}

PartsOfFrame FindParts(const mesh::TriangleMesh& mesh) {
  PartsOfFrame found;
  found.part_of.assign(mesh.num_vertices(), -1);
  const std::vector<int32_t> roots = mesh::ComponentRoots(mesh);
  for (int32_t t = 0; t < mesh.num_triangles(); ++t) {
    int32_t& number = found.part_of[roots[mesh.triangles(0, t)]];
    if (number < 0) {
      number = static_cast<int32_t>(found.parts.size());
      found.parts.emplace_back().first_triangle = t;
    }
    // With the origin at a vertex of the part the terms are small, wherever the part lies.
    SurfacePart& part = found.parts[number];
    const Vector3d origin = Position(mesh, mesh.triangles(0, part.first_triangle));
    const Vector3d a = Position(mesh, mesh.triangles(0, t)) - origin,
                   b = Position(mesh, mesh.triangles(1, t)) - origin,
                   c = Position(mesh, mesh.triangles(2, t)) - origin;
    const double term = a.dot(b.cross(c));
    ++part.num_triangles;
    part.volume += term;
    part.magnitude += std::abs(term);
  }
  for (size_t v = 0; v < roots.size(); ++v) found.part_of[v] = found.part_of[roots[v]];
  for (SurfacePart& part : found.parts) {
    if (std::abs(part.volume) <= kRounding * part.magnitude) continue;
    part.facing = part.volume > 0 ? 1 : -1;
  }
  return found;
}

// A place on a part, and the ray from there along x.
struct Ray {
  int32_t part;
  Vector3d from;
  int winding = 0;  // of the other parts, at `from`
};

// The place is no special one of its triangle, so that hardly any ray meets an edge of others.
Ray RayFrom(const mesh::TriangleMesh& mesh, int32_t part, int32_t t) {
  const auto corners = mesh.triangles.col(t);
  return {part, 0.4142 * Position(mesh, corners[0]) + 0.3178 * Position(mesh, corners[1]) +
                    0.268 * Position(mesh, corners[2])};
}

// Rays from places that are spread over each part with this facing.
std::vector<Ray> RaysFromParts(const mesh::TriangleMesh& mesh, const PartsOfFrame& found,
                               int facing) {
  std::vector<Ray> rays;
  std::vector<int32_t> num_passed(found.parts.size(), 0);  // triangles, per part
  for (int32_t t = 0; t < mesh.num_triangles(); ++t) {
    const int32_t number = found.part_of[mesh.triangles(0, t)];
    const SurfacePart& part = found.parts[number];
    if (part.facing != facing) continue;
    const int32_t n = num_passed[number]++;
    for (int64_t k = 0; k < kNumPlaces; ++k) {
      if (n == (2 * k + 1) * part.num_triangles / (2 * kNumPlaces)) {
        rays.push_back(RayFrom(mesh, number, t));
      }
    }
  }
  return rays;
}

// Twice the area of (a, b, p) as seen along x; never 0. It is measured from the vertex of lower
// index, so that the two triangles at an edge see exactly opposite values.
double SideOf(const mesh::TriangleMesh& mesh, int32_t a, int32_t b, const Vector3d& p) {
  const Vector3d low = Position(mesh, std::min(a, b));
  const Vector3d along = Position(mesh, std::max(a, b)) - low;
  const double side = along.y() * (p.z() - low.z()) - along.z() * (p.y() - low.y());
  const double strict = side == 0.0 ? 1e-300 : side;
  return a < b ? strict : -strict;
}

// What the triangle adds to the winding number at the begin of the ray: 1 if the ray leaves liquid
// through it, -1 if it enters there, 0 if it misses it.
int WindingBy(const mesh::TriangleMesh& mesh, int32_t t, const Vector3d& from) {
  const auto corners = mesh.triangles.col(t);
  const double c = SideOf(mesh, corners[0], corners[1], from),
               a = SideOf(mesh, corners[1], corners[2], from);
  if ((a > 0) != (c > 0)) return 0;
  const double b = SideOf(mesh, corners[2], corners[0], from);
  if ((b > 0) != (c > 0)) return 0;
  const double x = (a * mesh.vertices(0, corners[0]) + b * mesh.vertices(0, corners[1]) +
                    c * mesh.vertices(0, corners[2])) /
                   (a + b + c);
  if (x <= from.x()) return 0;
  return c > 0 ? 1 : -1;
}

// Rays in strips along y, as many in a strip as there are strips, and within a strip in order of y.
class RayStrips {
 public:
  explicit RayStrips(std::vector<Ray> rays) {
    const auto by_z = [](const Ray& a, const Ray& b) { return a.from.z() < b.from.z(); };
    const auto by_y = [](const Ray& a, const Ray& b) { return a.from.y() < b.from.y(); };
    std::sort(rays.begin(), rays.end(), by_z);
    const auto size = static_cast<size_t>(std::ceil(std::sqrt(static_cast<double>(rays.size()))));
    for (size_t begin = 0; begin < rays.size(); begin += size) {
      const size_t end = std::min(begin + size, rays.size());
      Strip& strip = strips_.emplace_back();
      strip.low_z = rays[begin].from.z();
      strip.high_z = rays[end - 1].from.z();
      strip.rays.assign(rays.begin() + begin, rays.begin() + end);
      std::sort(strip.rays.begin(), strip.rays.end(), by_y);
    }
  }

  // Calls `visit` with the rays that begin between these y and z, and with some at other z. Takes
  // the comparisons from `num_left`; ends, and returns false, once that is below 0.
  template <typename Visit>
  bool VisitBetween(const Vector3d& low, const Vector3d& high, int64_t& num_left,
                    const Visit& visit) {
    auto strip =
        std::lower_bound(strips_.begin(), strips_.end(), low.z(),
                         [](const Strip& candidate, double z) { return candidate.high_z < z; });
    for (; strip != strips_.end() && strip->low_z <= high.z(); ++strip) {
      num_left -= std::bit_width(strip->rays.size());  // of the search
      if (num_left < 0) return false;
      auto ray = std::lower_bound(strip->rays.begin(), strip->rays.end(), low.y(),
                                  [](const Ray& a, double y) { return a.from.y() < y; });
      for (; ray != strip->rays.end() && ray->from.y() <= high.y(); ++ray) {
        if (--num_left < 0) return false;
        visit(*ray);
      }
    }
    return true;
  }

  // All rays.
  template <typename Visit>
  void VisitAll(const Visit& visit) const {
    for (const Strip& strip : strips_) {
      for (const Ray& ray : strip.rays) visit(ray);
    }
  }

 private:
  struct Strip {
    double low_z = 0.0, high_z = 0.0;
    std::vector<Ray> rays;
  };
  std::vector<Strip> strips_;  // in order of z
};

// Sets the winding numbers at the begins of rays.
// Errors: kInvalidArgument if triangles take more than kMostComparisons.
absl::Status FindWindings(const mesh::TriangleMesh& mesh, const PartsOfFrame& found,
                          RayStrips& rays) {
  int64_t num_left = kMostComparisons * mesh.num_triangles();
  for (int32_t t = 0; t < mesh.num_triangles(); ++t) {
    const auto corners = mesh.triangles.col(t);
    Eigen::Matrix3f positions;
    for (int k = 0; k < 3; ++k) positions.col(k) = mesh.vertices.col(corners[k]);
    const Vector3d low = positions.rowwise().minCoeff().cast<double>(),
                   high = positions.rowwise().maxCoeff().cast<double>();
    const auto add = [&](Ray& ray) {
      const bool is_other = found.part_of[corners[0]] != ray.part;
      if (is_other && ray.from.x() < high.x()) ray.winding += WindingBy(mesh, t, ray.from);
    };
    if (!rays.VisitBetween(low, high, num_left, add)) {
      return absl::InvalidArgumentError(
          "thousands of parts lie beside one another all over, and some seem to be inside out");
    }
  }
  return absl::OkStatus();
}

// Finds what is inside out of the parts with this facing. Returns whether there is any.
absl::StatusOr<bool> FindInsideOut(const mesh::TriangleMesh& mesh, int facing,
                                   PartsOfFrame& found) {
  RayStrips rays(RaysFromParts(mesh, found, facing));
  LB_RETURN_IF_ERROR(FindWindings(mesh, found, rays));
  rays.VisitAll([&](const Ray& ray) {
    const bool is_at_liquid = std::max(ray.winding, ray.winding + facing) > 0;
    found.parts[ray.part].num_at_liquid += is_at_liquid;
  });
  return std::any_of(found.parts.begin(), found.parts.end(), [&](const SurfacePart& part) {
    return part.facing == facing && part.IsInsideOut();
  });
}

// Turns the triangles of the parts that are inside out. A second call turns them back.
void TurnInsideOut(const PartsOfFrame& found, mesh::TriangleMesh& mesh) {
  for (int32_t t = 0; t < mesh.num_triangles(); ++t) {
    const SurfacePart& part = found.parts[found.part_of[mesh.triangles(0, t)]];
    if (part.IsInsideOut()) std::swap(mesh.triangles(1, t), mesh.triangles(2, t));
  }
}

}  // namespace

absl::Status CheckOutward(const mesh::TriangleMesh& mesh) {
  if (mesh.num_triangles() == 0) return absl::OkStatus();
  const double volume_m3 = mesh::Volume(mesh);
  if (volume_m3 > 0) return absl::OkStatus();
  return absl::InvalidArgumentError(
      absl::StrCat("the signed volume is ", volume_m3,
                   " m^3: the triangles must be counter-clockwise seen from outside"));
}

absl::StatusOr<TurnedParts> TurnPartsOutward(mesh::TriangleMesh& mesh) {
  TurnedParts turned;
  PartsOfFrame found = FindParts(mesh);
  const auto faces_inward = [](const SurfacePart& part) { return part.facing < 0; };
  if (std::none_of(found.parts.begin(), found.parts.end(), faces_inward)) return turned;
  LB_ASSIGN_OR_RETURN(const bool has_any, FindInsideOut(mesh, -1, found));
  if (!has_any) return turned;
  LB_RETURN_IF_ERROR(FindInsideOut(mesh, 1, found).status());  // their bubbles face outward
  TurnInsideOut(found, mesh);
  if (!CheckOutward(mesh).ok()) {  // a tangle without an outside, or a volume of rounding errors
    TurnInsideOut(found, mesh);
    return turned;
  }
  for (const SurfacePart& part : found.parts) {
    if (!part.IsInsideOut()) continue;
    if (turned.count++ > 0) continue;
    turned.first = mesh.vertices.col(mesh.triangles(0, part.first_triangle));
  }
  return turned;
}

}  // namespace liquidblend::ingest
