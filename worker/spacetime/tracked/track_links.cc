#include "worker/spacetime/tracked/track_links.h"

#include <algorithm>
#include <numeric>
#include <utility>

#include "worker/spacetime/field/frame_topology.h"
#include "worker/spacetime/field/point_grid.h"

namespace liquidblend::spacetime {
namespace {

// A vertex of the same number is preferred to one that lies closer by less than this.
constexpr float kNumberBonusEdges = 0.25f;
// So close, a vertex of the same number is the one.
constexpr float kSameEdges = 0.1f;
constexpr double kMovingEdges = 0.1;
constexpr int kVotingSweeps = 2;

// Metres per frame step; zero if the frame has no velocities.
Eigen::Matrix3Xf StepsOf(const mesh::TriangleMesh& frame, double step_s) {
  if (frame.velocities.cols() == 0) return Eigen::Matrix3Xf::Zero(3, frame.num_vertices());
  return static_cast<float>(step_s) * frame.velocities;
}

struct TrackedFrame {
  TrackedFrame(const mesh::TriangleMesh& mesh, double step_s)
      : frame(mesh),
        topology(mesh),
        steps(StepsOf(mesh, step_s)),
        normals(VertexNormals(mesh)),
        has_velocities(mesh.velocities.cols() > 0) {}
  const mesh::TriangleMesh& frame;
  FrameTopology topology;
  Eigen::Matrix3Xf steps;
  Eigen::Matrix3Xf normals;
  bool has_velocities;
};

class Linker {
 public:
  Linker(const mesh::TriangleMesh& earlier, const mesh::TriangleMesh& later,
         const LinkOptions& options)
      : a_(earlier, options.step_s),
        b_(later, options.step_s),
        edge_(static_cast<float>(options.edge_length_m)),
        reach_(static_cast<float>(options.edge_length_m * options.reach_edges)),
        share_a_(a_.has_velocities ? (b_.has_velocities ? 0.5f : 1.0f) : 0.0f) {}

  std::vector<int32_t> Link() const {
    std::vector<int32_t> link = ChooseLinks();
    for (int sweep = 0; sweep < kVotingSweeps; ++sweep) Vote(link);
    return link;
  }

 private:
  // How far apart vertex i of the earlier and j of the later frame are when they meet half-way.
  float Gap(int32_t i, int32_t j) const {
    const Eigen::Vector3f step = share_a_ * a_.steps.col(i) + (1.0f - share_a_) * b_.steps.col(j);
    return (a_.frame.vertices.col(i) + step - b_.frame.vertices.col(j)).norm();
  }

  // Per vertex of `from`: that of `to` with the smallest gap, or -1. Few need to look as far as the
  // reach, and those of `known` need not look at all.
  template <typename GapOf>
  std::vector<int32_t> Nearest(const TrackedFrame& from, float direction, const TrackedFrame& to,
                               const std::vector<int32_t>& known, const GapOf& gap_of) const {
    const PointGrid close(to.frame.vertices, reach_ / 2);
    const PointGrid wide(to.frame.vertices, reach_);
    std::vector<int32_t> nearest = known;
    for (int32_t i = 0; i < from.frame.num_vertices(); ++i) {
      if (nearest[i] >= 0) continue;
      std::pair<float, int32_t> best = {reach_, -1};
      const auto consider = [&](int32_t j) {
        if (from.normals.col(i).dot(to.normals.col(j)) <= 0.0f) return;
        best = std::min(best, std::pair(gap_of(i, j), j));
      };
      const Eigen::Vector3f at = from.frame.vertices.col(i) + direction * from.steps.col(i);
      close.ForEachNear(at, consider);
      if (best.second < 0) wide.ForEachNear(at, consider);
      nearest[i] = best.second;
    }
    return nearest;
  }

  // Vertices of triangles that both frames have, number by number, if that is at least half of
  // them.
  std::vector<uint8_t> SameNumbers() const {
    std::vector<uint8_t> is_same(a_.frame.num_vertices(), 0);
    int64_t num_same = 0;
    for (int64_t t = 0; t < a_.frame.num_triangles(); ++t) {
      const Corners corners = CornersOf(a_.frame, t);
      if (b_.topology.Find(corners) < 0) continue;
      ++num_same;
      for (const int32_t v : corners) is_same[v] = 1;
    }
    if (2 * num_same < std::max(a_.frame.num_triangles(), b_.frame.num_triangles())) {
      std::fill(is_same.begin(), is_same.end(), uint8_t{0});
    }
    return is_same;
  }

  bool PrefersItsNumber(int32_t i, int32_t nearest) const {
    const float gap = Gap(i, i);
    if (gap >= reach_) return false;
    if (!a_.has_velocities && !b_.has_velocities) return true;
    return nearest < 0 || gap <= Gap(i, nearest) + kNumberBonusEdges * edge_;
  }

  std::vector<int32_t> ChooseLinks() const {
    const std::vector<uint8_t> is_same = SameNumbers();
    const auto gap = [&](int32_t i, int32_t j) { return Gap(i, j); };
    const auto gap_back = [&](int32_t j, int32_t i) { return Gap(i, j); };
    std::vector<int32_t> link(a_.frame.num_vertices(), -1);
    std::vector<int32_t> back(b_.frame.num_vertices(), -1);
    for (int32_t i = 0; i < a_.frame.num_vertices(); ++i) {
      if (is_same[i] && Gap(i, i) < kSameEdges * edge_) link[i] = back[i] = i;
    }
    link = Nearest(a_, 1.0f, b_, link, gap);
    back = Nearest(b_, -1.0f, a_, back, gap_back);
    std::vector<int32_t> owner(b_.frame.num_vertices(), -1);
    for (int32_t i = 0; i < a_.frame.num_vertices(); ++i) {
      const bool is_number = is_same[i] && PrefersItsNumber(i, link[i]);
      if (is_number) link[i] = i;
      if (link[i] >= 0 && !IsSameSheet(i, back[link[i]])) link[i] = -1;
      if (is_number && link[i] == i) owner[i] = i;
    }
    ChooseOwners(link, back, owner);
    KeepCollapsesOnly(owner, link);
    return link;
  }

  bool IsSameSheet(int32_t i, int32_t origin) const {
    return origin >= 0 && (origin == i || a_.topology.IsNear(i, origin, reach_));
  }

  // Among several vertices with one link: that of the same number, else the one that it came from,
  // else the closest.
  void ChooseOwners(const std::vector<int32_t>& link, const std::vector<int32_t>& back,
                    std::vector<int32_t>& owner) const {
    for (size_t j = 0; j < back.size(); ++j) {
      if (owner[j] < 0 && back[j] >= 0 && link[back[j]] == static_cast<int32_t>(j)) {
        owner[j] = back[j];
      }
    }
    const std::vector<int32_t> sure = owner;
    for (int32_t i = 0; i < a_.frame.num_vertices(); ++i) {
      const int32_t j = link[i];
      if (j < 0 || sure[j] >= 0) continue;
      if (owner[j] < 0 || Gap(i, j) < Gap(owner[j], j)) owner[j] = i;
    }
  }

  void KeepCollapsesOnly(const std::vector<int32_t>& owner, std::vector<int32_t>& link) const {
    for (int32_t i = 0; i < a_.frame.num_vertices(); ++i) {
      if (link[i] < 0 || owner[link[i]] == i) continue;
      const int32_t o = owner[link[i]];
      if (a_.topology.Opposite(i, o) < 0 && a_.topology.Opposite(o, i) < 0) link[i] = -1;
    }
  }

  // Each triangle (i, v, w) asks for the third corner of the later triangle on the links of v and
  // w; i takes what more of them ask for than have a partner now.
  void Vote(std::vector<int32_t>& link) const {
    std::vector<int32_t> votes;
    for (int32_t i = 0; i < a_.frame.num_vertices(); ++i) {
      votes.clear();
      for (const int32_t t : a_.topology.TrianglesAt(i)) {
        const Corners c = CornersOf(a_.frame, t);
        const int k = c[0] == i ? 0 : c[1] == i ? 1 : 2;
        const int32_t v = link[c[(k + 1) % 3]];
        const int32_t w = link[c[(k + 2) % 3]];
        if (v < 0 || w < 0 || v == w) continue;
        const int32_t third = b_.topology.Opposite(v, w);
        if (third >= 0) votes.push_back(third);
      }
      std::sort(votes.begin(), votes.end());
      auto most = std::count(votes.begin(), votes.end(), link[i]);
      for (auto begin = votes.begin(), end = begin; begin != votes.end(); begin = end) {
        end = std::upper_bound(begin, votes.end(), *begin);
        if (end - begin <= most || Gap(i, *begin) >= reach_) continue;
        most = end - begin;
        link[i] = *begin;
      }
    }
  }

  TrackedFrame a_;
  TrackedFrame b_;
  float edge_;
  float reach_;
  float share_a_;  // of the earlier frame's velocities in the mean
};

bool HaveSameTriangles(const mesh::TriangleMesh& a, const mesh::TriangleMesh& b) {
  return a.num_vertices() == b.num_vertices() && a.num_triangles() == b.num_triangles() &&
         a.triangles == b.triangles;
}

void MatchTriangles(const mesh::TriangleMesh& earlier, const mesh::TriangleMesh& later,
                    FrameLinks& links) {
  const FrameTopology topology(later);
  std::vector<uint8_t> is_met(later.num_triangles(), 0);
  for (int64_t t = 0; t < earlier.num_triangles(); ++t) {
    const Corners c = CornersOf(earlier, t);
    const Corners linked = {links.vertex[c[0]], links.vertex[c[1]], links.vertex[c[2]]};
    if (IsDegenerate(c) || IsDegenerate(linked)) continue;
    const int32_t met = topology.Find(linked);
    if (met < 0 || is_met[met]) continue;
    is_met[met] = 1;
    links.triangle[t] = met;
    ++links.num_matched;
  }
}

// Unlinked vertices move as their velocities say, or else at any rate.
void CountMoving(const mesh::TriangleMesh& earlier, const mesh::TriangleMesh& later,
                 const LinkOptions& options, FrameLinks& links) {
  const Eigen::Matrix3Xf steps = StepsOf(earlier, options.step_s);
  const auto least = static_cast<float>(kMovingEdges * options.edge_length_m);
  const auto is_moving = [&](int32_t v) {
    const int32_t to = links.vertex[v];
    if (to >= 0) return (later.vertices.col(to) - earlier.vertices.col(v)).norm() >= least;
    return earlier.velocities.cols() == 0 || steps.col(v).norm() >= least;
  };
  for (int64_t t = 0; t < earlier.num_triangles(); ++t) {
    const Corners c = CornersOf(earlier, t);
    if (std::none_of(c.begin(), c.end(), is_moving)) continue;
    ++links.num_moving;
    if (links.triangle[t] >= 0) ++links.num_moving_matched;
  }
}

}  // namespace

FrameLinks LinkFrames(const mesh::TriangleMesh& earlier, const mesh::TriangleMesh& later,
                      const LinkOptions& options) {
  FrameLinks links;
  links.triangle.assign(earlier.num_triangles(), -1);
  if (HaveSameTriangles(earlier, later)) {
    links.vertex.resize(earlier.num_vertices());
    std::iota(links.vertex.begin(), links.vertex.end(), 0);
  } else {
    links.vertex = Linker(earlier, later, options).Link();
  }
  MatchTriangles(earlier, later, links);
  CountMoving(earlier, later, options, links);
  return links;
}

}  // namespace liquidblend::spacetime
