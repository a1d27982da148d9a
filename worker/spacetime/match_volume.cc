#include "worker/spacetime/match_volume.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

#include "core/mesh/union_find.h"

namespace liquidblend::spacetime {
namespace {

constexpr int kRounds = 4;
// Parts that need a larger offset stay unchanged: limits for a part that corresponds to one of the
// frame, and for all others together.
constexpr double kMaxOffsetEdges = 0.15;
constexpr double kMaxRestOffsetEdges = 0.1;
// Smallest spatial length of unit normals in space-time: shorter ones belong to surfaces that
// appear and vanish within a frame, which have no direction in space.
constexpr float kMinSpatial = 0.1f;
constexpr double kMaxShift = 2.0;   // edges; between a part's centres in slice and frame ...
constexpr double kMaxChange = 1.3;  // ... and its volumes' ratio
constexpr double kExplained = 0.5;  // of what parts without partners lack, left by the one that met

// One frame's hexahedra by part.
struct FrameSlice {
  const FrameHexahedra* frame = nullptr;
  std::vector<int32_t> part_of;   // per hexahedron
  std::vector<int32_t> group_of;  // per part: of parts of which only the sum is known
  std::vector<double> wanted_m3;  // per group
  std::vector<double> offset_m;   // per part, outward
};

// Numbers the parts of a slice. Hexahedra that share an earlier corner are of one part.
std::vector<int32_t> NumberParts(std::span<const mesh::Hexahedron> hexahedra) {
  std::vector<int32_t> part_of;
  if (hexahedra.empty()) return part_of;
  int32_t low = hexahedra.front()[0], high = low;
  for (const mesh::Hexahedron& hexahedron : hexahedra) {
    const auto [first, last] = std::minmax_element(hexahedron.begin(), hexahedron.begin() + 4);
    low = std::min(low, *first);
    high = std::max(high, *last);
  }
  mesh::UnionFind sets(high - low + 1);
  for (const mesh::Hexahedron& hexahedron : hexahedra) {
    for (int c = 1; c < 4; ++c) sets.Join(hexahedron[0] - low, hexahedron[c] - low);
  }
  std::vector<int32_t> number(high - low + 1, -1);
  int32_t count = 0;
  for (const mesh::Hexahedron& hexahedron : hexahedra) {
    int32_t& part = number[sets.Root(hexahedron[0] - low)];
    if (part < 0) part = count++;
    part_of.push_back(part);
  }
  return part_of;
}

std::vector<mesh::Component> Measure(const mesh::SpaceTimeMesh& mesh, const FrameSlice& slice) {
  mesh::ComponentSums parts;
  for (size_t h = 0; h < slice.part_of.size(); ++h) {
    const mesh::Hexahedron& hexahedron = slice.frame->hexahedra[h];
    std::array<Eigen::Vector3d, 4> corner;
    for (int c = 0; c < 4; ++c) {
      const Eigen::Vector4d a = mesh.vertices.col(hexahedron[c]).cast<double>();
      const Eigen::Vector4d b = mesh.vertices.col(hexahedron[c + 4]).cast<double>();
      corner[c] = (a + (slice.frame->time - a.w()) / (b.w() - a.w()) * (b - a)).head<3>();
    }
    // Corners 0, 2, 3, 1 go round the quad, seen from outside of the liquid.
    const Eigen::Vector3d across = corner[3] - corner[0], other = corner[2] - corner[1];
    parts.Add(static_cast<size_t>(slice.part_of[h]),
              0.25 * (corner[0] + corner[1] + corner[2] + corner[3]), 0.5 * other.cross(across));
  }
  return parts.Components();
}

// Finds partners: for each part, the nearest of the others with about the same volume, if that
// one's own nearest is this part; -1: none.
std::vector<int32_t> Partners(const std::vector<mesh::Component>& parts,
                              const std::vector<mesh::Component>& others, double max_shift_m) {
  const auto nearest = [&](const mesh::Component& part, const std::vector<mesh::Component>& among) {
    int32_t best = -1;
    double least = max_shift_m;
    for (size_t n = 0; n < among.size(); ++n) {
      const double ratio = among[n].volume / part.volume;
      const double distance = (among[n].centre - part.centre).norm();
      if (!(ratio < kMaxChange && ratio > 1 / kMaxChange) || !(distance <= least)) continue;
      best = static_cast<int32_t>(n);
      least = distance;
    }
    return best;
  };
  std::vector<int32_t> partners;
  for (size_t n = 0; n < parts.size(); ++n) {
    const int32_t best = nearest(parts[n], others);
    const bool is_mutual = best >= 0 && nearest(others[best], parts) == static_cast<int32_t>(n);
    partners.push_back(is_mutual ? best : -1);
  }
  return partners;
}

// Removes partners of parts that have merged with others between two frames, or only there. Such a
// part still has the place and volume of the part before: a pool that has taken in a drop, for
// example. The volume that the part is short of, or has too much of, then explains the error of the
// parts without partners, if that is more than moving them can correct.
void PartFromMet(const std::vector<mesh::Component>& parts,
                 const std::vector<mesh::Component>& wanted, double max_offset_m,
                 std::vector<int32_t>& partners) {
  double missing_m3 = 0, area_m2 = 0;  // of those without partners
  for (const mesh::Component& part : wanted) missing_m3 += part.volume;
  for (size_t n = 0; n < parts.size(); ++n) {
    missing_m3 -= partners[n] < 0 ? parts[n].volume : wanted[partners[n]].volume;
    if (partners[n] < 0) area_m2 += parts[n].area;
  }
  const auto lacks_m3 = [&](size_t n) { return wanted[partners[n]].volume - parts[n].volume; };
  while (std::abs(missing_m3) > max_offset_m * area_m2) {
    int32_t best = -1;
    double least = kExplained * std::abs(missing_m3);
    for (size_t n = 0; n < parts.size(); ++n) {
      const double left = partners[n] < 0 ? least : std::abs(missing_m3 + lacks_m3(n));
      if (!(left < least)) continue;
      best = static_cast<int32_t>(n);
      least = left;
    }
    if (best < 0) return;
    missing_m3 += lacks_m3(best);
    area_m2 += parts[best].area;
    partners[best] = -1;
  }
}

FrameSlice SliceOf(const mesh::SpaceTimeMesh& mesh, const FrameHexahedra& frame) {
  FrameSlice slice = {&frame, NumberParts(frame.hexahedra), {}, {}, {}};
  const std::vector<mesh::Component> parts = Measure(mesh, slice);
  std::vector<int32_t> partners = Partners(parts, frame.parts, kMaxShift * mesh.edge_length_m);
  PartFromMet(parts, frame.parts, kMaxRestOffsetEdges * mesh.edge_length_m, partners);
  double rest_m3 = 0;  // group 0: all that has no partner
  for (const mesh::Component& part : frame.parts) rest_m3 += part.volume;
  slice.wanted_m3 = {0.0};
  for (const int32_t partner : partners) {
    slice.group_of.push_back(partner < 0 ? 0 : static_cast<int32_t>(slice.wanted_m3.size()));
    if (partner < 0) continue;
    slice.wanted_m3.push_back(frame.parts[partner].volume);
    rest_m3 -= slice.wanted_m3.back();
  }
  slice.wanted_m3[0] = rest_m3;
  slice.offset_m.resize(parts.size());
  return slice;
}

void UpdateOffsets(const mesh::SpaceTimeMesh& mesh, FrameSlice& slice) {
  const std::vector<mesh::Component> parts = Measure(mesh, slice);
  std::vector<double> volume_m3(slice.wanted_m3.size()), area_m2(slice.wanted_m3.size());
  for (size_t n = 0; n < parts.size(); ++n) {
    volume_m3[slice.group_of[n]] += parts[n].volume;
    area_m2[slice.group_of[n]] += parts[n].area;
  }
  for (size_t n = 0; n < parts.size(); ++n) {
    const int32_t group = slice.group_of[n];
    const double offset =
        area_m2[group] > 0 ? (slice.wanted_m3[group] - volume_m3[group]) / area_m2[group] : 0.0;
    const double limit = group == 0 ? kMaxRestOffsetEdges : kMaxOffsetEdges;
    slice.offset_m[n] = std::abs(offset) <= limit * mesh.edge_length_m ? offset : 0.0;
  }
}

Eigen::Vector3f InSpace(const Eigen::Vector4f& normal) {
  const Eigen::Vector3f space = normal.head<3>();
  return space / std::max(space.norm(), kMinSpatial);
}

// Parts of slabs: vertices that cells connect without crossing a frame.
struct SlabParts {
  std::vector<int32_t> of_vertex;
  int32_t count = 0;
};

SlabParts NumberSlabParts(std::span<const FrameHexahedra> frames, const mesh::SpaceTimeMesh& mesh) {
  std::vector<char> is_crossed(mesh.hexahedra.size(), 0);
  for (const FrameHexahedra& frame : frames) {
    const auto first = frame.hexahedra.data() - mesh.hexahedra.data();
    std::fill_n(is_crossed.begin() + first, frame.hexahedra.size(), char{1});
  }
  mesh::UnionFind sets(mesh.num_vertices());
  for (size_t h = 0; h < mesh.hexahedra.size(); ++h) {
    const mesh::Hexahedron& corners = mesh.hexahedra[h];
    for (int c = 1; c < 4; ++c) {
      sets.Join(corners[0], corners[c]);
      sets.Join(corners[4], corners[c + 4]);
    }
    if (is_crossed[h] == 0) sets.Join(corners[0], corners[4]);
  }
  SlabParts parts;
  parts.of_vertex.resize(mesh.num_vertices());
  for (int32_t v = 0; v < mesh.num_vertices(); ++v) {  // a root is the lowest of its set
    const int32_t root = sets.Root(v);
    parts.of_vertex[v] = root == v ? parts.count++ : parts.of_vertex[root];
  }
  return parts;
}

// The parts of the slices before and after a vertex; -1: none.
struct PartsBeside {
  int32_t before = -1, after = -1;
};

// Offsets of vertices, from the corrections of the slices' parts. A vertex on a layer within a slab
// may have no time edge to a frame; it follows the vertices that it is connected with.
class Offsets {
 public:
  Offsets(std::span<const FrameHexahedra> frames, const std::vector<FrameSlice>& slices,
          const mesh::SpaceTimeMesh& mesh)
      : slab_parts_(NumberSlabParts(frames, mesh)), beside_(mesh.num_vertices()) {
    for (const FrameSlice& slice : slices) {
      const auto first = static_cast<int32_t>(time_.size());
      for (size_t h = 0; h < slice.part_of.size(); ++h) {
        for (int c = 0; c < 4; ++c) {
          beside_[slice.frame->hexahedra[h][c]].after = first + slice.part_of[h];
          beside_[slice.frame->hexahedra[h][c + 4]].before = first + slice.part_of[h];
        }
      }
      time_.resize(time_.size() + slice.offset_m.size(), slice.frame->time);
    }
  }

  void Set(const std::vector<FrameSlice>& slices) {
    offset_m_.clear();
    for (const FrameSlice& slice : slices) {
      offset_m_.insert(offset_m_.end(), slice.offset_m.begin(), slice.offset_m.end());
    }
    means_.assign(slab_parts_.count, {});
    for (size_t v = 0; v < beside_.size(); ++v) {
      Means& means = means_[slab_parts_.of_vertex[v]];
      AddTo(means.before, beside_[v].before);
      AddTo(means.after, beside_[v].after);
    }
  }

  // The offset of a vertex at this time: metres, outward.
  double At(int64_t v, double time) const {
    const Means& means = means_[slab_parts_.of_vertex[v]];
    const std::optional<Needed> before = NeededBy(beside_[v].before, means.before);
    const std::optional<Needed> after = NeededBy(beside_[v].after, means.after);
    if (!before) return after ? after->offset_m : 0.0;
    if (!after) return before->offset_m;
    const double share = std::clamp((time - before->time) / (after->time - before->time), 0.0, 1.0);
    return (1 - share) * before->offset_m + share * after->offset_m;
  }

 private:
  struct Needed {
    double time = 0, offset_m = 0;
  };
  struct MeanNeeded {
    Needed sum;
    int64_t count = 0;
  };
  struct Means {
    MeanNeeded before, after;
  };

  void AddTo(MeanNeeded& mean, int32_t part) const {
    if (part < 0) return;
    mean.sum.time += time_[part];
    mean.sum.offset_m += offset_m_[part];
    ++mean.count;
  }
  std::optional<Needed> NeededBy(int32_t part, const MeanNeeded& mean) const {
    if (part >= 0) return Needed{time_[part], offset_m_[part]};
    if (mean.count == 0) return std::nullopt;
    const auto count = static_cast<double>(mean.count);
    return Needed{mean.sum.time / count, mean.sum.offset_m / count};
  }

  const SlabParts slab_parts_;
  std::vector<PartsBeside> beside_;  // per vertex
  std::vector<double> time_;         // per part of all slices: its frame's
  std::vector<double> offset_m_;     // likewise
  std::vector<Means> means_;         // per part of a slab
};

}  // namespace

void MatchVolumes(std::span<const FrameHexahedra> frames, const parallel::Arena& arena,
                  mesh::SpaceTimeMesh& mesh) {
  if (frames.empty()) return;
  std::vector<FrameSlice> slices(frames.size());
  arena.Run(static_cast<int64_t>(frames.size()),
            [&](int64_t n) { slices[n] = SliceOf(mesh, frames[n]); });
  Offsets offsets(frames, slices, mesh);
  const std::vector<char> rigid = mesh::RigidVertices(mesh);
  for (int round = 0; round < kRounds; ++round) {
    arena.Run(static_cast<int64_t>(frames.size()),
              [&](int64_t n) { UpdateOffsets(mesh, slices[n]); });
    offsets.Set(slices);
    arena.For(mesh.num_vertices(), [&](int64_t v) {
      if (rigid[v]) return;
      const auto offset = static_cast<float>(offsets.At(v, mesh.vertices(3, v)));
      mesh.vertices.col(v).head<3>() += offset * InSpace(mesh.normals.col(v));
    });
  }
}

}  // namespace liquidblend::spacetime
