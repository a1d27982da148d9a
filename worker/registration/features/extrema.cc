#include "worker/registration/features/extrema.h"

#include <algorithm>
#include <cmath>

#include "core/base/prefetch.h"

namespace liquidblend::registration {
namespace {

constexpr float kFacesUp = 0.3f;         // of a normal that points up: its share upwards
constexpr double kLeast = 1.0;           // edges; less is never asked for
constexpr size_t kPrefetchVertices = 8;  // vertices

// Sweeps the heights from the top (craters: from the bottom) and joins what meets (persistence of
// the components of superlevel sets).
class Sweep {
 public:
  Sweep(const Surface& surface, ExtremumKind kind)
      : surface_(surface),
        kind_(kind),
        axis_(mesh::AxisOf(surface.mesh.up).axis),
        sign_(static_cast<float>(mesh::AxisOf(surface.mesh.up).sign)),
        root_(surface.points.cols(), -1),
        open_(surface.points.cols(), 0) {}

  std::vector<Extremum> Run(const ExtremaOptions& options) {
    std::vector<int32_t> order;
    for (int32_t v = 0; v < surface_.points.cols(); ++v) {
      if (TakesPart(v)) order.push_back(v);
    }
    std::stable_sort(order.begin(), order.end(),
                     [&](int32_t a, int32_t b) { return Height(a) > Height(b); });
    for (size_t n = 0; n < order.size(); ++n) {
      if (n + 2 * kPrefetchVertices < order.size()) {
        base::PrefetchIntoL2(surface_.cells_around.bytes(order[n + 2 * kPrefetchVertices]));
      }
      if (n + kPrefetchVertices < order.size()) Prefetch(order[n + kPrefetchVertices]);
      Add(order[n]);
    }
    const double needed =
        std::max(options.min_persistence, options.min_height_share * SceneHeight());
    const double last = surface_.mesh.num_frames - 1 - options.end_frames;
    std::erase_if(found_, [&](const Extremum& e) {
      return e.persistence < needed || e.point[3] < options.end_frames || e.point[3] > last;
    });
    std::stable_sort(found_.begin(), found_.end(), [](const Extremum& a, const Extremum& b) {
      return a.persistence > b.persistence;
    });
    return std::move(found_);
  }

 private:
  // Vertices of one height are all over the mesh.
  void Prefetch(int32_t v) const {
    for (const int32_t c : surface_.cells_around[v]) {
      base::PrefetchIntoL2(CornersOf(surface_.mesh, c).data());
    }
  }
  bool TakesPart(int32_t v) const {
    return !surface_.rigid[v] &&
           (kind_ == ExtremumKind::kApex || sign_ * surface_.mesh.normals(axis_, v) > kFacesUp);
  }
  float Height(int32_t v) const {
    const float height = sign_ * surface_.points(axis_, v);
    return kind_ == ExtremumKind::kApex ? height : -height;
  }
  double SceneHeight() const {
    const auto heights = surface_.points.row(axis_);
    return heights.maxCoeff() - heights.minCoeff();
  }
  int32_t Root(int32_t v) {
    while (root_[v] != v) v = root_[v] = root_[root_[v]];
    return v;
  }
  // A closed set's root is its highest vertex. Where two sets meet, the lower one ends, or the
  // closed one if the other is open: from there the surface may go on higher.
  void Add(int32_t v) {
    root_[v] = v;
    open_[v] = IsAtBoundary(v) ? 1 : 0;
    for (const int32_t c : surface_.cells_around[v]) {
      for (const int32_t w : CornersOf(surface_.mesh, c)) {
        if (root_[w] < 0) continue;
        int32_t a = Root(v), b = Root(w);
        if (a == b) continue;
        if (open_[a] != open_[b] ? open_[b] != 0 : IsHigher(b, a)) std::swap(a, b);
        if (b != v && open_[b] == 0) Record(b, Height(b) - Height(v));
        root_[b] = a;
      }
    }
  }
  bool IsHigher(int32_t a, int32_t b) const {
    return Height(a) != Height(b) ? Height(a) > Height(b) : a < b;
  }
  // At the ends of time, or next to what is not compared.
  bool IsAtBoundary(int32_t v) const {
    if (surface_.InFirstSlab(v) || surface_.InPreRoll(v) || surface_.InLastSlab(v)) return true;
    if (kind_ == ExtremumKind::kApex) return false;  // droplets have no cells with others
    for (const int32_t c : surface_.cells_around[v]) {
      for (const int32_t w : CornersOf(surface_.mesh, c)) {
        if (!TakesPart(w)) return true;
      }
    }
    return false;
  }
  void Record(int32_t v, double persistence) {
    if (persistence > kLeast) {
      found_.push_back({kind_, surface_.points.col(v).cast<double>(), persistence});
    }
  }

  const Surface& surface_;
  const ExtremumKind kind_;
  const int axis_;             // of heights
  const float sign_;           // likewise
  std::vector<int32_t> root_;  // per vertex; -1: not swept yet
  std::vector<char> open_;     // per root: the set reaches the boundary
  std::vector<Extremum> found_;
};

}  // namespace

std::vector<Extremum> FindExtrema(const Surface& surface, const ExtremaOptions& options) {
  std::vector<Extremum> found = Sweep(surface, ExtremumKind::kApex).Run(options);
  const std::vector<Extremum> craters = Sweep(surface, ExtremumKind::kCrater).Run(options);
  found.insert(found.end(), craters.begin(), craters.end());
  return found;
}

}  // namespace liquidblend::registration
