// Inverted places of a layer's boxes, found by rays. Internal to worker/spacetime.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <vector>

#include "worker/spacetime/field/line_crossings.h"
#include "worker/spacetime/sheets/liquid_boxes.h"

namespace liquidblend::spacetime {

// Rays along x, y and z, three to a spacing, cross the surface of the boxes at a few times around
// the layer. After vertices have moved, only rays through boxes at these vertices are traced again.
// Threads: a const object may be shared; each Update needs one of its own.
class InvertedRays {
 public:
  // Vertices of Slab::beyond may move from where they are now towards their cells, no others.
  InvertedRays(const Layers& layers, BoxFaces boxes);

  // Traces the rays through faces at corners whose vertices, before or after, have moved since.
  //   has_moved  one per corner of boxes(); the first time all are set
  void Update(const Layers& layers, const std::vector<char>& has_moved);

  // The places where rays have a winding number below 0, in grid units.
  Eigen::Matrix3Xf Places() const;

  const BoxFaces& boxes() const { return boxes_; }

 private:
  // A range of ray indices along an axis.
  struct Range {
    int begin, end;
  };
  using Ranges = std::array<Range, 3>;  // along x, y and z
  // A set of rays along an axis.
  class Marks {
   public:
    explicit Marks(const GridLines& lines);
    void Add(const Ranges& ranges);
    bool HasAny(const Ranges& ranges) const;
    bool Has(int64_t line) const { return HasAt(static_cast<int>(line % num_u_), line / num_u_); }
    bool HasAt(int at_u, int64_t at_v) const {
      return (bits_[at_v * words_per_row_ + (at_u >> 6)] >> (at_u & 63) & 1) != 0;
    }

   private:
    int u_, v_, num_u_, words_per_row_;
    std::vector<uint64_t> bits_;  // rows along u
  };

  std::array<Marks, 3> MarkAround(const std::vector<char>& has_moved) const;
  void AddPlaces(const GridSurface& surface, const std::vector<int64_t>& faces,
                 const GridLines& lines, const Marks& marks);

  BoxFaces boxes_;
  Grid rays_;
  std::vector<Ranges> ranges_;                          // of each face, wherever its vertices move
  std::array<std::vector<Eigen::Vector3f>, 3> places_;  // per axis, in ray spacings
};

}  // namespace liquidblend::spacetime
