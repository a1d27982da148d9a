#include "worker/spacetime/sheets/inverted_rays.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>
#include <utility>

#include "worker/spacetime/field/line_crossings.h"

namespace liquidblend::spacetime {
namespace {

constexpr int kRaysPerSpacing = 3;
constexpr float kRayMargin =
    0.03f;  // of ray spacings; more than rounding and NthLineShift move anything

// Grid units and frames.
Eigen::Vector4f At(const Layers& layers, const BoxCorner& corner) {
  if (corner.vertex < 0) return corner.place;
  Eigen::Vector4f p = layers.slabs[corner.slab].vertices[corner.vertex];
  const double begin = layers.begin(corner.slab), end = layers.end(corner.slab);
  p.w() = static_cast<float>(begin + p.w() * (end - begin));
  return p;
}

// From half of the longest step before the layer to half of the longest one after it.
std::vector<double> TimesAround(const Layers& layers, int layer) {
  const double time = layers.plan.layers[layer].time;
  std::vector<double> times = {time};
  for (const int sign : {-1, 1}) {
    const int s = layers.SlabOf(sign < 0 ? layer - 1 : layer);
    const int num_steps = layers.plan.num_steps(s), l = layer - layers.plan.first_layer[s];
    const double step = (layers.end(s) - layers.begin(s)) / num_steps;
    times.push_back(time + sign * 0.25 * step);
    for (int span = 1; span <= num_steps && l % span == 0; span *= 2) {
      times.push_back(time + sign * 0.5 * span * step);
    }
  }
  return times;
}

// Some faces of the boxes in ray spacings, as a surface for each time.
class FacesInTime {
 public:
  FacesInTime(const Layers& layers, const BoxFaces& boxes, const std::vector<size_t>& faces) {
    std::vector<int> number(boxes.before.size(), -1);
    for (const size_t f : faces) {
      for (const int corner : boxes.faces[f]) number[corner] = 0;
    }
    // In the same order, on which crossings depend: line_crossings.cc.
    for (size_t c = 0; c < number.size(); ++c) {
      if (number[c] < 0) continue;
      number[c] = static_cast<int>(before_.size());
      before_.push_back(At(layers, boxes.before[c]));
      after_.push_back(At(layers, boxes.after[c]));
    }
    surface_.vertices.resize(3, static_cast<int64_t>(before_.size()));
    surface_.triangles.resize(3, 2 * static_cast<int64_t>(faces.size()));
    for (size_t n = 0; n < faces.size(); ++n) {
      std::array<int, 4> face = boxes.faces[faces[n]];
      for (int& corner : face) corner = number[corner];
      surface_.triangles.col(2 * n) << face[0], face[1], face[2];
      surface_.triangles.col(2 * n + 1) << face[0], face[2], face[3];
    }
  }

  const GridSurface& AtTime(double time) {
    for (size_t v = 0; v < before_.size(); ++v) {
      const double length = after_[v].w() - before_[v].w();
      const double share = length > 0 ? std::clamp((time - before_[v].w()) / length, 0.0, 1.0) : 0;
      const Eigen::Vector4f p = before_[v] + static_cast<float>(share) * (after_[v] - before_[v]);
      surface_.vertices.col(v) = kRaysPerSpacing * p.head<3>();
    }
    return surface_;
  }

 private:
  std::vector<Eigen::Vector4f> before_, after_;
  GridSurface surface_;
};

}  // namespace

InvertedRays::InvertedRays(const Layers& layers, BoxFaces boxes)
    : boxes_(std::move(boxes)), rays_(layers.grid) {
  for (int& dim : rays_.dims) dim *= kRaysPerSpacing;
  for (const std::array<int, 4>& face : boxes_.faces) {
    Eigen::Array3f lowest = Eigen::Array3f::Constant(std::numeric_limits<float>::max());
    Eigen::Array3f highest = -lowest;
    const auto extend = [&](const Eigen::Vector3f& place) {
      lowest = lowest.min(place.array());
      highest = highest.max(place.array());
    };
    for (const int c : face) {
      for (const BoxCorner* corner : {&boxes_.before[c], &boxes_.after[c]}) {
        extend(At(layers, *corner).head<3>());
        if (corner->vertex < 0) continue;
        const Slab::VertexBeyond* beyond = FindBeyond(layers.slabs[corner->slab], corner->vertex);
        if (beyond != nullptr) extend(beyond->in_cell);
      }
    }
    Ranges& ranges = ranges_.emplace_back();
    for (int k = 0; k < 3; ++k) {
      const auto begin = static_cast<int>(std::ceil(kRaysPerSpacing * lowest[k] - kRayMargin));
      const auto last = static_cast<int>(std::floor(kRaysPerSpacing * highest[k] + kRayMargin));
      ranges[k] = {std::max(begin, 0), std::min(last + 1, rays_.dims[k])};
    }
  }
}

InvertedRays::Marks::Marks(const GridLines& lines)
    : u_(lines.u),
      v_(lines.v),
      num_u_(lines.num_u),
      words_per_row_((lines.num_u + 63) / 64),
      bits_(static_cast<size_t>(words_per_row_) * lines.num_v, 0) {}

void InvertedRays::Marks::Add(const Ranges& ranges) {
  for (int v = ranges[v_].begin; v < ranges[v_].end; ++v) {
    for (int u = ranges[u_].begin; u < ranges[u_].end; ++u) {
      bits_[static_cast<int64_t>(v) * words_per_row_ + (u >> 6)] |= uint64_t{1} << (u & 63);
    }
  }
}

bool InvertedRays::Marks::HasAny(const Ranges& ranges) const {
  for (int v = ranges[v_].begin; v < ranges[v_].end; ++v) {
    for (int u = ranges[u_].begin; u < ranges[u_].end; ++u) {
      if (HasAt(u, v)) return true;
    }
  }
  return false;
}

std::array<InvertedRays::Marks, 3> InvertedRays::MarkAround(
    const std::vector<char>& has_moved) const {
  std::array<Marks, 3> marks = {Marks(GridLines(rays_, 0)), Marks(GridLines(rays_, 1)),
                                Marks(GridLines(rays_, 2))};
  for (size_t f = 0; f < boxes_.faces.size(); ++f) {
    const std::array<int, 4>& face = boxes_.faces[f];
    if (std::none_of(face.begin(), face.end(), [&](int c) { return has_moved[c] != 0; })) continue;
    for (Marks& along : marks) along.Add(ranges_[f]);
  }
  return marks;
}

void InvertedRays::Update(const Layers& layers, const std::vector<char>& has_moved) {
  assert(has_moved.size() == boxes_.before.size());
  const std::array<Marks, 3> marks = MarkAround(has_moved);
  std::vector<size_t> faces;
  std::array<std::vector<int64_t>, 3> crossed;  // of `faces`, per axis
  for (size_t f = 0; f < boxes_.faces.size(); ++f) {
    bool is_any = false;
    for (int axis = 0; axis < 3; ++axis) {
      if (!marks[axis].HasAny(ranges_[f])) continue;
      crossed[axis].push_back(static_cast<int64_t>(faces.size()));
      is_any = true;
    }
    if (is_any) faces.push_back(f);
  }
  for (int axis = 0; axis < 3; ++axis) {
    const GridLines lines(rays_, axis);
    std::erase_if(places_[axis], [&](const Eigen::Vector3f& place) {
      return marks[axis].HasAt(static_cast<int>(place[lines.u]), static_cast<int>(place[lines.v]));
    });
  }
  FacesInTime moving(layers, boxes_, faces);
  for (const double time : TimesAround(layers, boxes_.layer)) {
    const GridSurface& surface = moving.AtTime(time);
    for (int axis = 0; axis < 3; ++axis) {
      AddPlaces(surface, crossed[axis], GridLines(rays_, axis), marks[axis]);
    }
  }
}

void InvertedRays::AddPlaces(const GridSurface& surface, const std::vector<int64_t>& faces,
                             const GridLines& lines, const Marks& marks) {
  std::vector<Crossing> crossings;
  const LineShift shift = NthLineShift(0);
  for (const int64_t f : faces) {
    CrossLines(surface, 2 * f, lines, shift, crossings);
    CrossLines(surface, 2 * f + 1, lines, shift, crossings);
  }
  std::erase_if(crossings, [&](const Crossing& crossing) { return !marks.Has(crossing.line); });
  std::sort(crossings.begin(), crossings.end(), [](const Crossing& a, const Crossing& b) {
    if (a.line != b.line) return a.line < b.line;
    return a.at != b.at ? a.at < b.at : a.winding > b.winding;
  });
  int winding = 0;
  for (size_t n = 0; n < crossings.size(); ++n) {
    const Crossing& crossing = crossings[n];
    if (n > 0 && crossing.line != crossings[n - 1].line) winding = 0;
    const int before = winding;
    winding += crossing.winding;
    if (std::min(before, winding) >= 0) continue;
    Eigen::Vector3f& place = places_[lines.axis].emplace_back();
    place[lines.axis] = static_cast<float>(crossing.at);
    place[lines.u] = static_cast<float>(crossing.line % lines.num_u);
    place[lines.v] = static_cast<float>(crossing.line / lines.num_u);
  }
}

Eigen::Matrix3Xf InvertedRays::Places() const {
  Eigen::Matrix3Xf all(
      3, static_cast<int64_t>(places_[0].size() + places_[1].size() + places_[2].size()));
  int64_t n = 0;
  for (const auto& of_axis : places_) {
    for (const Eigen::Vector3f& place : of_axis) all.col(n++) = place / kRaysPerSpacing;
  }
  return all;
}

}  // namespace liquidblend::spacetime
