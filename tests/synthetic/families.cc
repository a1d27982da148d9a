#include "tests/synthetic/families.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <memory>
#include <numbers>
#include <numeric>
#include <random>
#include <string>
#include <utility>

#include "absl/strings/str_cat.h"
#include "tests/synthetic/shapes.h"

namespace liquidblend::synthetic {
namespace {

using mesh::Float4;
using mesh::Hexahedron;
using mesh::SpaceTimeMesh;
using mesh::Wedge;

// Triangles and quads, counter-clockwise from outside.
struct Surface {
  std::vector<Eigen::Vector3f> points;
  std::vector<std::vector<int32_t>> polygons;
};

Surface CubeSphere(int n) {
  Surface surface;
  std::map<std::array<int, 3>, int32_t> numbers;
  const auto vertex = [&](std::array<int, 3> at) {
    const auto [it, is_new] = numbers.try_emplace(at, static_cast<int32_t>(surface.points.size()));
    if (is_new) {
      const Eigen::Vector3i centred(2 * at[0] - n, 2 * at[1] - n, 2 * at[2] - n);
      surface.points.push_back(centred.cast<float>().normalized());
    }
    return it->second;
  };
  for (int axis = 0; axis < 3; ++axis) {
    for (int k = 0; k < 2 * n * n; ++k) {
      const bool is_high = k >= n * n;
      const int u = k % n;
      const int v = k / n % n;
      const auto corner = [&](int a, int b) {
        std::array<int, 3> at = {};
        at[axis] = is_high ? n : 0;
        at[(axis + 1) % 3] = u + a;
        at[(axis + 2) % 3] = v + b;
        return vertex(at);
      };
      std::vector<int32_t> quad = {corner(0, 0), corner(1, 0), corner(1, 1), corner(0, 1)};
      if (!is_high) std::reverse(quad.begin(), quad.end());
      surface.polygons.push_back(std::move(quad));
    }
  }
  return surface;
}

Surface TorusGrid(int num_major, int num_minor) {
  constexpr float kMajor = 0.7F;
  constexpr float kMinor = 0.3F;
  Surface surface;
  for (int i = 0; i < num_major; ++i) {
    for (int j = 0; j < num_minor; ++j) {
      const float phi =
          2 * std::numbers::pi_v<float> * static_cast<float>(i) / static_cast<float>(num_major);
      const float psi =
          2 * std::numbers::pi_v<float> * static_cast<float>(j) / static_cast<float>(num_minor);
      const float r = kMajor + kMinor * std::cos(psi);
      surface.points.emplace_back(r * std::cos(phi), r * std::sin(phi), kMinor * std::sin(psi));
      const auto vertex = [&](int a, int b) {
        return (i + a) % num_major * num_minor + (j + b) % num_minor;
      };
      surface.polygons.push_back({vertex(0, 0), vertex(1, 0), vertex(1, 1), vertex(0, 1)});
    }
  }
  return surface;
}

Surface TriangulatedSphere(int subdivisions) {
  const mesh::TriangleMesh sphere = Icosphere(Eigen::Vector3f::Zero(), 1.0, subdivisions);
  Surface surface;
  for (Eigen::Index v = 0; v < sphere.vertices.cols(); ++v) {
    surface.points.push_back(sphere.vertices.col(v));
  }
  for (Eigen::Index t = 0; t < sphere.triangles.cols(); ++t) {
    surface.polygons.push_back(
        {sphere.triangles(0, t), sphere.triangles(1, t), sphere.triangles(2, t)});
  }
  return surface;
}

Surface SplitSomeQuads(const Surface& quads) {
  Surface surface;
  surface.points = quads.points;
  for (size_t q = 0; q < quads.polygons.size(); ++q) {
    const std::vector<int32_t>& quad = quads.polygons[q];
    if (q % 3 == 0) {
      surface.polygons.push_back({quad[0], quad[1], quad[2]});
      surface.polygons.push_back({quad[0], quad[2], quad[3]});
    } else {
      surface.polygons.push_back(quad);
    }
  }
  return surface;
}

// Surface x time: quads become hexahedra, triangles wedges.
SpaceTimeMesh Extrude(const Surface& surface, const ComplexOptions& options) {
  const auto n = static_cast<int32_t>(surface.points.size());
  SpaceTimeMesh mesh;
  mesh.num_frames = options.num_frames;
  mesh.edge_length_m =
      (surface.points[surface.polygons[0][0]] - surface.points[surface.polygons[0][1]]).norm();
  mesh.num_first_vertices = n;
  mesh.num_last_vertices = n;
  const int num_layers = options.num_frames + 2;
  mesh.vertices.resize(4, int64_t{num_layers} * n);
  for (int layer = 0; layer < num_layers; ++layer) {
    const auto t = static_cast<float>(layer - 1);
    for (int32_t v = 0; v < n; ++v) {
      const Eigen::Vector3f p = options.centre_m + options.velocity_m_per_frame * t +
                                (1.0F + options.growth_per_frame * t) * surface.points[v];
      mesh.vertices.col(int64_t{layer} * n + v) = Eigen::Vector4f(p.x(), p.y(), p.z(), t);
    }
  }
  for (int32_t low = 0; low + n < num_layers * n; low += n) {
    const int32_t high = low + n;
    for (const std::vector<int32_t>& p : surface.polygons) {
      if (p.size() == 3) {
        mesh.wedges.push_back(
            Wedge{low + p[0], low + p[2], low + p[1], high + p[0], high + p[2], high + p[1]});
      } else {
        mesh.hexahedra.push_back(Hexahedron{low + p[0], low + p[3], low + p[1], low + p[2],
                                            high + p[0], high + p[3], high + p[1], high + p[2]});
      }
    }
  }
  return mesh;
}

// The facets of a cell, outward, become the bases of tetrahedra and pyramids with one apex.
template <typename Cell>
void AddCone(const Cell& cell, const std::vector<std::vector<int>>& facets, int32_t apex,
             SpaceTimeMesh& mesh) {
  for (const std::vector<int>& f : facets) {
    if (f.size() == 3) {
      mesh.tetrahedra.push_back({cell[f[0]], cell[f[2]], cell[f[1]], apex});
    } else {
      mesh.pyramids.push_back({cell[f[0]], cell[f[3]], cell[f[2]], cell[f[1]], apex});
    }
  }
}

// Replaces every `period`-th cell by a cone from its centroid.
template <typename Cell>
void ConeSome(int period, const std::vector<std::vector<int>>& facets, std::vector<Cell>& cells,
              std::vector<Eigen::Vector4f>& centroids, SpaceTimeMesh& mesh) {
  std::vector<Cell> kept;
  for (size_t c = 0; c < cells.size(); ++c) {
    if (c % period != 0) {
      kept.push_back(cells[c]);
      continue;
    }
    Eigen::Vector4f sum = Eigen::Vector4f::Zero();
    for (const int32_t v : cells[c]) sum += mesh.vertices.col(v);
    const auto apex =
        static_cast<int32_t>(mesh.num_vertices() + static_cast<int64_t>(centroids.size()));
    centroids.push_back(sum / static_cast<float>(cells[c].size()));
    AddCone(cells[c], facets, apex, mesh);
  }
  cells = std::move(kept);
}

// Numbers the vertices by time, so that the end slabs stand first and last.
void SortVertices(SpaceTimeMesh& mesh) {
  std::vector<int32_t> order(mesh.num_vertices());
  std::iota(order.begin(), order.end(), 0);
  std::stable_sort(order.begin(), order.end(),
                   [&](int32_t a, int32_t b) { return mesh.vertices(3, a) < mesh.vertices(3, b); });
  std::vector<int32_t> new_from_old(order.size());
  Eigen::Matrix4Xf vertices(4, mesh.num_vertices());
  for (size_t k = 0; k < order.size(); ++k) {
    vertices.col(static_cast<int64_t>(k)) = mesh.vertices.col(order[k]);
    new_from_old[order[k]] = static_cast<int32_t>(k);
  }
  mesh.vertices = std::move(vertices);
  const auto renumber = [&](auto& cells) {
    for (auto& cell : cells) {
      for (int32_t& v : cell) v = new_from_old[v];
    }
  };
  renumber(mesh.tetrahedra);
  renumber(mesh.pyramids);
  renumber(mesh.wedges);
  renumber(mesh.hexahedra);
}

// Corners 0 1 2 of a wedge by falling number p > q > r, and 3 4 5 above them p' q' r': diagonals
// p q', p r', q r'.
void AddThreeTetrahedra(const Wedge& wedge, SpaceTimeMesh& mesh) {
  std::array<int, 3> by_number = {0, 1, 2};
  std::sort(by_number.begin(), by_number.end(), [&](int a, int b) { return wedge[a] > wedge[b]; });
  const auto [p, q, r] = by_number;
  const bool is_even = (q - p + 3) % 3 == 1;
  for (const std::array<int, 4>& corners :
       {std::array{p, q, r, r + 3}, std::array{p, q, r + 3, q + 3},
        std::array{p, q + 3, r + 3, p + 3}}) {
    mesh::Tetrahedron cell;
    for (int k = 0; k < 4; ++k) cell[k] = wedge[corners[k]];
    if (!is_even) std::swap(cell[0], cell[1]);
    mesh.tetrahedra.push_back(cell);
  }
}

struct Wave {
  Eigen::Vector4f wave_vector;
  Eigen::Vector4f amplitude;
  float phase;
};

// What a family's spans look at.
struct Storage {
  SpaceTimeMesh mesh;
  std::vector<std::vector<Float4>> fields;
};

std::span<const Float4> Evaluate(const Field& field, Storage& storage) {
  if (!field) return {};
  std::vector<Float4>& values = storage.fields.emplace_back();
  values.reserve(storage.mesh.num_vertices());
  for (int64_t v = 0; v < storage.mesh.num_vertices(); ++v) {
    const Eigen::Vector4f value = field(v, storage.mesh.vertices.col(v));
    values.push_back({value[0], value[1], value[2], value[3]});
  }
  return values;
}

}  // namespace

SpaceTimeMesh HexahedralSphere(int cells_per_side, const ComplexOptions& options) {
  return Extrude(CubeSphere(cells_per_side), options);
}

SpaceTimeMesh HexahedralTorus(int num_major, int num_minor, const ComplexOptions& options) {
  return Extrude(TorusGrid(num_major, num_minor), options);
}

SpaceTimeMesh WedgeSphere(int subdivisions, const ComplexOptions& options) {
  return Extrude(TriangulatedSphere(subdivisions), options);
}

SpaceTimeMesh TetrahedralSphere(int subdivisions, const ComplexOptions& options) {
  SpaceTimeMesh mesh = WedgeSphere(subdivisions, options);
  for (const Wedge& wedge : mesh.wedges) AddThreeTetrahedra(wedge, mesh);
  mesh.wedges.clear();
  return mesh;
}

SpaceTimeMesh MixedSphere(int cells_per_side, const ComplexOptions& options) {
  SpaceTimeMesh mesh = Extrude(SplitSomeQuads(CubeSphere(cells_per_side)), options);
  std::vector<Eigen::Vector4f> centroids;
  ConeSome(2, {{0, 2, 1}, {3, 4, 5}, {0, 1, 4, 3}, {1, 2, 5, 4}, {2, 0, 3, 5}}, mesh.wedges,
           centroids, mesh);
  ConeSome(3, {{0, 2, 3, 1}, {4, 5, 7, 6}, {0, 1, 5, 4}, {2, 6, 7, 3}, {0, 4, 6, 2}, {1, 3, 7, 5}},
           mesh.hexahedra, centroids, mesh);
  const int64_t num_layered = mesh.num_vertices();
  mesh.vertices.conservativeResize(Eigen::NoChange,
                                   num_layered + static_cast<int64_t>(centroids.size()));
  for (size_t k = 0; k < centroids.size(); ++k) {
    mesh.vertices.col(num_layered + static_cast<int64_t>(k)) = centroids[k];
  }
  SortVertices(mesh);
  return mesh;
}

Field SmoothWarp(uint64_t seed, float amplitude_m, float amplitude_frames) {
  constexpr int kNumWaves = 4;
  constexpr float kTwoPi = 2 * std::numbers::pi_v<float>;
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<float> one(-1.0F, 1.0F);
  std::vector<Wave> waves(kNumWaves);
  const Eigen::Vector4f amplitude(amplitude_m, amplitude_m, amplitude_m, amplitude_frames);
  for (Wave& wave : waves) {
    const float length_m = 2.0F + one(random);
    const float length_frames = 6.0F + 3.0F * one(random);
    const Eigen::Vector3f direction(one(random), one(random), one(random));
    const Eigen::Vector3f k = direction.normalized() * (kTwoPi / length_m);
    wave.wave_vector = {k.x(), k.y(), k.z(), kTwoPi / length_frames};
    const Eigen::Vector4f share(one(random), one(random), one(random), one(random));
    wave.amplitude = amplitude.cwiseProduct(share);
    wave.phase = std::numbers::pi_v<float> * one(random);
  }
  return [waves](int64_t, const Eigen::Vector4f& at) {
    Eigen::Vector4f sum = Eigen::Vector4f::Zero();
    for (const Wave& wave : waves) {
      sum += wave.amplitude * std::sin(wave.wave_vector.dot(at) + wave.phase);
    }
    return sum;
  };
}

Field Noise(uint64_t seed, float amplitude_m, float amplitude_frames) {
  return [=](int64_t vertex, const Eigen::Vector4f&) {
    std::seed_seq key{seed, static_cast<uint64_t>(vertex)};
    std::minstd_rand random(key);
    std::uniform_real_distribution<float> one(-1.0F, 1.0F);
    const float x = amplitude_m * one(random);
    const float y = amplitude_m * one(random);
    const float z = amplitude_m * one(random);
    return Eigen::Vector4f(x, y, z, amplitude_frames * one(random));
  };
}

mesh::RegisteredFamily MakeFamily(SpaceTimeMesh mesh, const std::vector<TargetFields>& targets) {
  const auto storage = std::make_shared<Storage>();
  storage->mesh = std::move(mesh);
  mesh::RegisteredFamily family = mesh::ViewOf(storage->mesh);
  family.name = "synthetic";
  family.source = "source";
  family.version = 1;
  for (const TargetFields& fields : targets) {
    mesh::FamilyTarget& target = family.targets.emplace_back();
    target.name = absl::StrCat("target-", family.targets.size());
    target.displacement = Evaluate(fields.displacement, *storage);
    target.extrapolation = Evaluate(fields.extrapolation, *storage);
  }
  for (int k = 0; k < 3; ++k) {
    const float margin = (family.domain_max[k] - family.domain_min[k]) / 2;
    family.domain_min[k] -= margin;
    family.domain_max[k] += margin;
  }
  family.storage = storage;
  return family;
}

}  // namespace liquidblend::synthetic
