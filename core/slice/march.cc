#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <limits>
#include <utility>

#include "core/slice/cut_cluster.h"
#include "core/slice/join_parts.h"
#include "core/slice/polygon.h"
#include "core/slice/slice.h"

namespace liquidblend::slice {
namespace {

using Point = std::array<float, 3>;

// Bound of the triangles of a cell: a loop of k corners becomes k - 2 triangles, and a cell's loops
// have kMaxEdges corners at most.
constexpr int kMaxCellTriangles = mesh::kMaxEdges;
// How many clusters ahead their data, and their records, are prefetched.
constexpr size_t kLookahead = 5;
constexpr size_t kRecordLookahead = 13;
// Fewest clusters in a part: some 50 us of work, which pays for waking a thread.
constexpr size_t kMinClustersPerPart = 64;

float DistanceSq(const Point& a, const Point& b) {
  const float x = a[0] - b[0];
  const float y = a[1] - b[1];
  const float z = a[2] - b[2];
  return x * x + y * y + z * z;
}

// The smallest float at or after the time. Comparing a float with it gives the same as comparing
// with the time.
float FirstFloatFrom(double time) {
  const auto rounded = static_cast<float>(time);
  if (static_cast<double>(rounded) >= time) return rounded;
  return std::nextafter(rounded, std::numeric_limits<float>::infinity());
}

// Builder of one part of the surface, from cut clusters.
class Marcher {
 public:
  Marcher(const mesh::VertexPlacer& placer, const mesh::TimeAxis& axis, double time_ticks,
          std::span<ClusterVertices> cluster_vertices, SurfacePart& part)
      : placer_(placer),
        axis_(axis),
        time_(axis.Frames(time_ticks)),
        cluster_vertices_(cluster_vertices),
        part_(part) {}

  // Prefetches what Add() needs. To be called some time before it.
  void Prefetch(const CutCluster& cut) const {
    placer_.Prefetch(cut.near_vertices().first(cut.num_own()));
    placer_.Prefetch(cut.far_vertices().first(cut.num_own()));
    const Cluster& cluster = cut.cluster();
    for (const uint8_t edge : cut.crossed_edges().subspan(cut.num_own())) {
      const int32_t owner = cluster.owner_clusters[edge - cluster.num_own_edges];
      __builtin_prefetch(&cluster_vertices_[owner]);
    }
  }

  // Adds the surface in a cluster. Clusters must come in ascending order.
  void Add(int32_t number, const CutCluster& cut) {
    MakeRoom();
    FindShared(cut);
    cluster_vertices_[number] = {cut.crossed(), static_cast<int32_t>(part_.num_vertices)};
    AddVertices(cut, 0, cut.num_own());
    TakeShared(cut);
    if (cut.cluster().has_repeated_corners) {
      AddLoops<true>(cut);
    } else {
      AddLoops<false>(cut);
    }
  }

 private:
  // Makes room for the most that one cluster can add, so that cells need no check.
  void MakeRoom() {
    const auto grow = [](size_t size, size_t most, auto& buffer) {
      if (size + most > buffer.size()) buffer.resize(2 * (size + most));
    };
    grow(part_.num_vertices, kMaxClusterEdges, part_.vertices);
    grow(part_.num_triangles, size_t{kMaxClusterCells} * kMaxCellTriangles, part_.triangles);
  }

  // Finds the expected vertices on the edges of earlier clusters of this part.
  void FindShared(const CutCluster& cut) {
    const Cluster& cluster = cut.cluster();
    const std::span<const uint8_t> edges = cut.crossed_edges();
    for (size_t k = cut.num_own(); k < edges.size(); ++k) {
      const int shared = edges[k] - cluster.num_own_edges;
      const int32_t owner = cluster.owner_clusters[shared];
      output_[k] = owner < part_.first_cluster
                       ? -1
                       : cluster_vertices_[owner].VertexOn(cluster.owner_edges[shared]);
      const auto vertex = static_cast<size_t>(std::max(output_[k], 0));
      __builtin_prefetch(&part_.vertices[std::min(vertex, part_.num_vertices)]);
    }
  }

  void TakeShared(const CutCluster& cut) {
    const auto num_crossings = static_cast<int>(cut.crossed_edges().size());
    for (int k = cut.num_own(); k < num_crossings; ++k) {
      const int32_t near = cut.near_vertices()[k];
      const int32_t far = cut.far_vertices()[k];
      if (part_.Has(output_[k], near, far)) {
        points_[k] = part_.vertices[output_[k]].point;
      } else {
        TakeOuter(cut, k);
      }
    }
  }

  // Takes the crossing of an edge that belongs to a cluster of an earlier part, or to one that has
  // not crossed it. Bounds of times exclude the latter.
  void TakeOuter(const CutCluster& cut, int k) {
    const Cluster& cluster = cut.cluster();
    const int shared = cut.crossed_edges()[k] - cluster.num_own_edges;
    const int32_t owner = cluster.owner_clusters[shared];
    if (owner >= part_.first_cluster) return AddVertices(cut, k, k + 1);
    AddOuter(
        {{{}, cut.near_vertices()[k], cut.far_vertices()[k]}, owner, cluster.owner_edges[shared]},
        k);
  }

  void AddOuter(OuterVertex outer, int k) {
    placer_.Place({&outer.itself.near_vertex, 1}, near_positions_.data());
    placer_.Place({&outer.itself.far_vertex, 1}, far_positions_.data());
    const double s = axis_.counts_frames() ? Share<true>(near_positions_[0], far_positions_[0])
                                           : Share<false>(near_positions_[0], far_positions_[0]);
    outer.itself.point = points_[k] = Interpolate(near_positions_[0], far_positions_[0], s);
    output_[k] = -1 - static_cast<int32_t>(part_.outer.size());
    part_.outer.push_back(outer);
  }

  // Adds the vertices of the crossings [begin, end). There are two loops: one loop with the choice
  // inside gave wrong vertices with GCC 12.2 at -O3, but not at -O2 or with -fno-split-loops
  // (time_blending_test.cc showed it).
  void AddVertices(const CutCluster& cut, int begin, int end) {
    axis_.counts_frames() ? AddVerticesBy<true>(cut, begin, end)
                          : AddVerticesBy<false>(cut, begin, end);
  }

  template <bool kCountsFrames>
  void AddVerticesBy(const CutCluster& cut, int begin, int end) {
    const auto near = cut.near_vertices().subspan(begin, end - begin);
    const auto far = cut.far_vertices().subspan(begin, end - begin);
    placer_.Place(near, near_positions_.data());
    placer_.Place(far, far_positions_.data());
    auto number = static_cast<int32_t>(part_.num_vertices);
    PartVertex* vertex = &part_.vertices[number];
    for (int i = 0; i < end - begin; ++i) {
      output_[begin + i] = number++;
      const double s = Share<kCountsFrames>(near_positions_[i], far_positions_[i]);
      points_[begin + i] = Interpolate(near_positions_[i], far_positions_[i], s);
      *vertex++ = {points_[begin + i], near[i], far[i]};
    }
    part_.num_vertices += end - begin;
  }

  // The place of the slice on an edge, 0 to 1. It is linear in frames, whatever ticks are, so that
  // weight 0 is the source, also where the source is not cut at a vertex.
  template <bool kCountsFrames>
  double Share(const mesh::Float4& a, const mesh::Float4& b) const {
    if constexpr (kCountsFrames) return (time_ - a[3]) / (static_cast<double>(b[3]) - a[3]);
    const double from = axis_.Frames(a[3]);
    return (time_ - from) / (axis_.Frames(b[3]) - from);
  }

  // The point at s between a and b; exactly an end if s is 0 or 1.
  static Point Interpolate(const mesh::Float4& a, const mesh::Float4& b, double s) {
    const double r = 1.0 - s;
    return {static_cast<float>(r * a[0] + s * b[0]), static_cast<float>(r * a[1] + s * b[1]),
            static_cast<float>(r * a[2] + s * b[2])};
  }

  template <bool kMayRepeat>
  void AddLoops(const CutCluster& cut) {
    const uint8_t* corners = cut.corners();
    for (const Loop& quad : cut.quads()) AddQuad<kMayRepeat>(corners + quad.begin);
    for (const Loop& triangle : cut.triangles()) {
      const uint8_t* v = corners + triangle.begin;
      AddTriangle<kMayRepeat>(v[0], v[1], v[2]);
    }
    for (const Loop& loop : cut.polygons()) AddPolygon<kMayRepeat>(cut, loop);
  }

  // Cuts a quad along its shorter diagonal.
  template <bool kMayRepeat>
  void AddQuad(const uint8_t* v) {
    const int first = static_cast<int>(DistanceSq(points_[v[1]], points_[v[3]]) <
                                       DistanceSq(points_[v[0]], points_[v[2]]));
    const uint8_t a = v[first];
    const uint8_t c = v[first + 2];
    AddTriangle<kMayRepeat>(a, v[first + 1], c);
    AddTriangle<kMayRepeat>(a, c, v[(first + 3) % 4]);
  }

  template <bool kMayRepeat>
  void AddPolygon(const CutCluster& cut, const Loop& loop) {
    Polygon polygon;
    for (int k = 0; k < loop.size; ++k) {
      const int8_t edge = loop.cell_edges[k];
      const Polygon::Corner corner = {cut.corners()[loop.begin + k],
                                      static_cast<uint16_t>(1U << edge), cut.facet_mates()[edge]};
      kMayRepeat ? polygon.Merge(corner) : polygon.Add(corner);
    }
    if (kMayRepeat) polygon.MergeEnds();
    const auto& v = polygon.corners;
    while (polygon.size > 3) {
      polygon.Close();
      const int base = BestBase(polygon);
      AddTriangle<kMayRepeat>(v[base].crossing, v[base + 1].crossing, v[base + 2].crossing);
      polygon.Remove(base + 1 < polygon.size ? base + 1 : 0);
    }
    if (kMayRepeat && polygon.size < 3) return;
    AddTriangle<kMayRepeat>(v[0].crossing, v[1].crossing, v[2].crossing);
  }

  // Finds the first corner of the ear with the shortest base. A base inside of a facet is taken
  // only if there is no other, since the neighbour cell might choose it as well (four triangles on
  // one edge).
  int BestBase(const Polygon& polygon) const {
    const int num_bases = polygon.size == 4 ? 2 : polygon.size;  // a quad's are its diagonals
    uint64_t best = ~uint64_t{0};
    for (int k = 0; k < num_bases; ++k) {
      const Polygon::Corner& a = polygon.corners[k];
      const Polygon::Corner& b = polygon.corners[k + 2];
      const auto is_in_facet = static_cast<uint64_t>((a.mates & b.edge) != 0);
      // The bits of floats that are not negative have the order of the numbers.
      const auto base_sq =
          std::bit_cast<uint32_t>(DistanceSq(points_[a.crossing], points_[b.crossing]));
      best = std::min(best, is_in_facet << 40 | uint64_t{base_sq} << 8 | static_cast<uint64_t>(k));
    }
    return static_cast<int>(best & 255);
  }

  // Adds a triangle. A cell with a corner twice can name a vertex twice; such a triangle is left
  // out, which leaves no gap.
  template <bool kMayRepeat>
  void AddTriangle(uint8_t a, uint8_t b, uint8_t c) {
    part_.triangles[part_.num_triangles] = {output_[a], output_[b], output_[c]};
    const bool is_kept = !kMayRepeat || (a != b && b != c && c != a);
    part_.num_triangles += static_cast<size_t>(is_kept);
  }

  const mesh::VertexPlacer& placer_;
  const mesh::TimeAxis axis_;
  const double time_;                            // frames
  std::span<ClusterVertices> cluster_vertices_;  // each part sets those of its own clusters
  SurfacePart& part_;
  // State of the cluster that is being added.
  std::array<int32_t, kMaxClusterEdges> output_;               // per crossing: the output vertex
  std::array<Point, kMaxClusterEdges> points_;                 // per crossing
  std::array<mesh::Float4, kMaxClusterEdges> near_positions_;  // of new output vertices
  std::array<mesh::Float4, kMaxClusterEdges> far_positions_;
};

// Makes one part. While a cluster is cut, positions for the one before it are being prefetched.
void MarchPart(const CellIndex& index, const mesh::VertexPlacer& placer,
               std::span<const int32_t> clusters, Workspace& workspace, SurfacePart& part) {
  part.Clear(clusters.empty() ? 0 : clusters.front());
  Marcher marcher(placer, index.family().time_axis(), workspace.time_ticks,
                  workspace.cluster_vertices, part);
  const float first_later = FirstFloatFrom(workspace.time_ticks);
  std::array<CutCluster, 2> cuts;
  CutCluster* cut = &cuts[0];
  CutCluster* waiting = &cuts[1];
  int32_t waiting_number = -1;
  for (size_t i = 0; i < clusters.size(); ++i) {
    if (workspace.stop != nullptr && workspace.stop->load(std::memory_order_relaxed)) break;
    if (i + kRecordLookahead < clusters.size()) {
      index.PrefetchRecord(clusters[i + kRecordLookahead]);
    }
    if (i + kLookahead < clusters.size()) index.Prefetch(clusters[i + kLookahead]);
    if (!cut->Cut(index.cluster(clusters[i]), workspace.terms, first_later)) continue;
    marcher.Prefetch(*cut);
    if (waiting_number >= 0) marcher.Add(waiting_number, *waiting);
    waiting_number = clusters[i];
    std::swap(cut, waiting);
  }
  if (waiting_number >= 0) marcher.Add(waiting_number, *waiting);
}

// The number of parts: two for each thread, so that a slow thread delays the others less.
size_t NumParts(const Workspace& workspace) {
  const int num_idle = workspace.helpers == nullptr ? 0 : workspace.helpers->num_idle();
  if (num_idle == 0) return 1;
  return std::clamp<size_t>(workspace.clusters.size() / kMinClustersPerPart, 1,
                            2 * (static_cast<size_t>(num_idle) + 1));
}

}  // namespace

mesh::TriangleMesh March(const CellIndex& index, const mesh::VertexPlacer& placer,
                         Workspace& workspace) {
  if (workspace.cluster_vertices.size() < static_cast<size_t>(index.num_clusters())) {
    workspace.cluster_vertices.resize(index.num_clusters());
  }
  const std::span<const int32_t> clusters = workspace.clusters;
  const size_t num_parts = NumParts(workspace);
  if (workspace.parts.size() < num_parts) workspace.parts.resize(num_parts);
  const auto for_each = [&](absl::FunctionRef<void(int)> make) {
    if (num_parts == 1) return make(0);
    workspace.helpers->Run(static_cast<int>(num_parts), make);
  };
  for_each([&](int p) {
    const size_t begin = clusters.size() * p / num_parts;
    const size_t end = clusters.size() * (p + 1) / num_parts;
    MarchPart(index, placer, clusters.subspan(begin, end - begin), workspace, workspace.parts[p]);
  });
  return JoinParts(std::span(workspace.parts).first(num_parts), workspace.cluster_vertices,
                   for_each, workspace.near_vertex, workspace.far_vertex);
}

}  // namespace liquidblend::slice
