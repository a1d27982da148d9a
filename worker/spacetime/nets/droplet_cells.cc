#include "worker/spacetime/nets/droplet_cells.h"

namespace liquidblend::spacetime {
namespace {

using Corner = DropletCells::Corner;

// A copy of a droplet's shape in a piece: its vertices from `first` on, the centroid after them if
// it ends a prism.
struct Copy {
  int32_t piece, first;
  Corner At(int32_t v) const { return {piece, first + v}; }
};

class Builder {
 public:
  Builder(const DropletTrack& track, const mesh::Animation& animation)
      : track_(track), animation_(animation) {}

  DropletCells Build() && {
    const size_t count = track_.droplets.size();
    AddPiece(track_.birth, CentroidAt(0, track_.birth), 0);
    for (size_t n = 0; n < count; ++n) {
      const Droplet& droplet = track_.droplets[n];
      const Copy begin = AddCopy(droplet.shape, /*with_centroid=*/true);
      AddPiece(animation_.time(droplet.frame), droplet.centroid_m, n);
      const Copy middle = AddCopy(droplet.shape, /*with_centroid=*/false);
      if (n + 1 < count) {
        const double time =
            0.5 * (animation_.time(droplet.frame) + animation_.time(track_.droplets[n + 1].frame));
        AddPiece(time, 0.5 * (CentroidAt(n, time) + CentroidAt(n + 1, time)), n);
      } else {
        AddPiece(track_.death, CentroidAt(n, track_.death), n);
      }
      const Copy end = AddCopy(droplet.shape, /*with_centroid=*/true);
      AddPrism(droplet.shape, begin, middle);
      AddPrism(droplet.shape, middle, end);
      Fill(droplet.shape, begin, /*is_end=*/false);
      Fill(droplet.shape, end, /*is_end=*/true);
    }
    return std::move(cells_);
  }

 private:
  Eigen::Vector3d CentroidAt(size_t n, double time) const {
    const Droplet& droplet = track_.droplets[n];
    return droplet.centroid_m + (time - animation_.time(droplet.frame)) /
                                    animation_.frames_per_second * droplet.velocity_m_per_s;
  }

  void AddPiece(double time, const Eigen::Vector3d& centroid, size_t n) {
    centroid_ = centroid.cast<float>();
    cells_.pieces.push_back({time, {}, track_.droplets[n].velocity_m_per_s.cast<float>()});
  }

  // Into the last piece.
  Copy AddCopy(const mesh::TriangleMesh& shape, bool with_centroid) {
    Eigen::Matrix3Xf& vertices = cells_.pieces.back().vertices;
    const int64_t first = vertices.cols(), count = shape.num_vertices();
    vertices.conservativeResize(3, first + count + (with_centroid ? 1 : 0));
    vertices.middleCols(first, count) = shape.vertices.colwise() + centroid_;
    if (with_centroid) vertices.col(first + count) = centroid_;
    return {static_cast<int32_t>(cells_.pieces.size()) - 1, static_cast<int32_t>(first)};
  }

  void AddPrism(const mesh::TriangleMesh& shape, const Copy& earlier, const Copy& later) {
    for (int64_t t = 0; t < shape.num_triangles(); ++t) {
      const int a = shape.triangles(0, t), b = shape.triangles(1, t), c = shape.triangles(2, t);
      cells_.wedges.push_back(
          {earlier.At(a), earlier.At(c), earlier.At(b), later.At(a), later.At(c), later.At(b)});
    }
  }

  // The liquid inside, flat in time: outside of it is the time before a begin, after an end.
  void Fill(const mesh::TriangleMesh& shape, const Copy& copy, bool is_end) {
    const Corner centroid = copy.At(static_cast<int32_t>(shape.num_vertices()));
    for (int64_t t = 0; t < shape.num_triangles(); ++t) {
      const Corner a = copy.At(shape.triangles(0, t));
      const Corner b = copy.At(shape.triangles(1, t));
      const Corner c = copy.At(shape.triangles(2, t));
      cells_.tetrahedra.push_back({centroid, a, is_end ? b : c, is_end ? c : b});
    }
  }

  const DropletTrack& track_;
  const mesh::Animation& animation_;
  Eigen::Vector3f centroid_;
  DropletCells cells_;
};

}  // namespace

DropletCells MakeCells(const DropletTrack& track, const mesh::Animation& animation) {
  return Builder(track, animation).Build();
}

}  // namespace liquidblend::spacetime
