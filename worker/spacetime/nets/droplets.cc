#include "worker/spacetime/nets/droplets.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <map>
#include <tuple>
#include <utility>

namespace liquidblend::spacetime {
namespace {

constexpr double kMaxVolumeRatio = 3.0;  // from frame to frame; beyond it it is another droplet
// If a droplet belongs to the rest of the liquid in the next frame: share of the time until then in
// which it is shown.
constexpr double kShownBeyond = 0.9;

// Per vertex that names a component: the area of its surface.
std::vector<double> ComponentAreas(const mesh::TriangleMesh& mesh,
                                   const std::vector<int>& component) {
  std::vector<double> area(component.size(), 0.0);
  for (int64_t t = 0; t < mesh.num_triangles(); ++t) {
    const Eigen::Vector3f a = mesh.vertices.col(mesh.triangles(0, t));
    const Eigen::Vector3f ab = mesh.vertices.col(mesh.triangles(1, t)) - a;
    const Eigen::Vector3f ac = mesh.vertices.col(mesh.triangles(2, t)) - a;
    area[component[mesh.triangles(0, t)]] += 0.5 * ab.cross(ac).norm();
  }
  return area;
}

// The vertices with the given `part`, and their triangles.
mesh::TriangleMesh Extract(const mesh::TriangleMesh& mesh, const std::vector<int>& part_of,
                           int part) {
  std::vector<int> index(mesh.num_vertices(), -1), vertices;
  for (int v = 0; v < static_cast<int>(part_of.size()); ++v) {
    if (part_of[v] != part) continue;
    index[v] = static_cast<int>(vertices.size());
    vertices.push_back(v);
  }
  std::vector<int> triangles;
  for (int t = 0; t < static_cast<int>(mesh.num_triangles()); ++t) {
    if (part_of[mesh.triangles(0, t)] == part) triangles.push_back(t);
  }
  mesh::TriangleMesh result;
  result.vertices = mesh.vertices(Eigen::all, vertices);
  if (mesh.velocities.cols() > 0) result.velocities = mesh.velocities(Eigen::all, vertices);
  result.triangles = mesh.triangles(Eigen::all, triangles);
  for (int& v : result.triangles.reshaped()) v = index[v];
  return result;
}

Droplet MakeDroplet(mesh::TriangleMesh shape, int frame) {
  Droplet droplet;
  droplet.frame = frame;
  droplet.centroid_m = shape.vertices.cast<double>().rowwise().mean();
  shape.vertices.colwise() -= droplet.centroid_m.cast<float>();
  if (shape.velocities.cols() > 0) {
    droplet.velocity_m_per_s = shape.velocities.cast<double>().rowwise().mean();
  }
  droplet.volume_m3 = mesh::Volume(shape);
  droplet.radius_m = shape.vertices.colwise().norm().maxCoeff();
  droplet.shape = std::move(shape);
  return droplet;
}

// Takes the small components out of a frame.
std::vector<Droplet> TakeDroplets(double max_area_m2, int frame, mesh::TriangleMesh& mesh) {
  std::vector<Droplet> droplets;
  if (mesh.num_triangles() == 0) return droplets;
  std::vector<int> component = mesh::ComponentRoots(mesh);
  const std::vector<double> area = ComponentAreas(mesh, component);
  std::vector<int> small;
  for (int v = 0; v < static_cast<int>(component.size()); ++v) {
    if (component[v] == v && area[v] > 0 && area[v] < max_area_m2) small.push_back(v);
  }
  if (small.empty()) return droplets;
  for (const int part : small) {
    droplets.push_back(MakeDroplet(Extract(mesh, component, part), frame));
  }
  constexpr int kRest = -1;
  for (int& part : component) {
    if (!std::binary_search(small.begin(), small.end(), part)) part = kRest;
  }
  mesh = Extract(mesh, component, kRest);
  return droplets;
}

// Distance in metres of droplet a of one frame and droplet b of the next, both moved to the middle
// of the time between.
double DistanceHalfway(const Droplet& a, const Droplet& b, double seconds) {
  return (a.centroid_m + 0.5 * seconds * a.velocity_m_per_s -
          (b.centroid_m - 0.5 * seconds * b.velocity_m_per_s))
      .norm();
}

bool Touch(const Droplet& a, const Droplet& b, double seconds) {
  return DistanceHalfway(a, b, seconds) < a.radius_m + b.radius_m;
}

bool CanBeSame(const Droplet& a, const Droplet& b, double seconds) {
  const double ratio = a.volume_m3 / b.volume_m3;  // negative for a drop and a bubble
  return Touch(a, b, seconds) && ratio < kMaxVolumeRatio && ratio > 1 / kMaxVolumeRatio;
}

// For each of `next` the droplet of `now` that it is, or -1: the nearest pairs first.
std::vector<int> MatchDroplets(const std::vector<Droplet>& now, const std::vector<Droplet>& next,
                               double seconds) {
  std::vector<std::tuple<double, int, int>> pairs;
  for (int a = 0; a < static_cast<int>(now.size()); ++a) {
    for (int b = 0; b < static_cast<int>(next.size()); ++b) {
      if (!CanBeSame(now[a], next[b], seconds)) continue;
      pairs.emplace_back(DistanceHalfway(now[a], next[b], seconds), a, b);
    }
  }
  std::sort(pairs.begin(), pairs.end());
  std::vector<int> match(next.size(), -1);
  std::vector<char> taken(now.size(), 0);
  for (const auto& [distance, a, b] : pairs) {
    if (taken[a] || match[b] >= 0) continue;
    taken[a] = 1;
    match[b] = a;
  }
  return match;
}

bool TouchesAny(const Droplet& droplet, const std::vector<Droplet>& others, double seconds) {
  return std::any_of(others.begin(), others.end(),
                     [&](const Droplet& other) { return Touch(droplet, other, seconds); });
}

// Frame by frame, the droplets of all frames joined to tracks.
std::vector<DropletTrack> JoinTracks(const mesh::Animation& animation,
                                     std::vector<std::vector<Droplet>> of_frame) {
  std::vector<DropletTrack> tracks;
  std::vector<int> track_of;  // per droplet of the frame before
  const int num_frames = animation.num_frames();
  for (int k = 0; k < num_frames; ++k) {
    const double before = k > 0 ? animation.time(k) - animation.time(k - 1) : 1.0;
    const double after = k + 1 < num_frames ? animation.time(k + 1) - animation.time(k) : 1.0;
    static const std::vector<Droplet> kNone;
    const auto& previous = k > 0 ? of_frame[k - 1] : kNone;
    const auto& next = k + 1 < num_frames ? of_frame[k + 1] : kNone;
    const double fps = animation.frames_per_second;
    const std::vector<int> match = MatchDroplets(previous, of_frame[k], before / fps);
    std::vector<int> track_here;
    for (size_t n = 0; n < of_frame[k].size(); ++n) {
      const Droplet& droplet = of_frame[k][n];
      if (match[n] < 0) {
        const bool was_droplet = TouchesAny(droplet, previous, -before / fps);
        const double share = k == 0 ? 1.0 : was_droplet ? 0.5 : kShownBeyond;
        tracks.push_back({{}, animation.time(k) - share * before, 0.0});
      }
      const int track = match[n] < 0 ? static_cast<int>(tracks.size()) - 1 : track_of[match[n]];
      const bool is_droplet = TouchesAny(droplet, next, after / fps);
      const double share = k + 1 == num_frames ? 1.0 : is_droplet ? 0.5 : kShownBeyond;
      tracks[track].death = animation.time(k) + share * after;  // unless it goes on
      track_here.push_back(track);
    }
    track_of = std::move(track_here);
    for (size_t n = 0; n < of_frame[k].size(); ++n) {
      tracks[track_of[n]].droplets.push_back(of_frame[k][n]);
    }
  }
  return tracks;
}

}  // namespace

DropletSplit SplitDroplets(const mesh::Animation& animation, double max_area_m2) {
  DropletSplit split;
  mesh::Animation rest = animation;
  std::vector<std::vector<Droplet>> of_frame;
  bool any = false;
  for (int k = 0; k < animation.num_frames(); ++k) {
    of_frame.push_back(TakeDroplets(max_area_m2, k, rest.frames[k]));
    any |= !of_frame.back().empty();
  }
  if (!any) return split;
  split.rest = std::move(rest);
  split.tracks = JoinTracks(animation, std::move(of_frame));
  return split;
}

}  // namespace liquidblend::spacetime
