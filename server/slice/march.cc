#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>

#include "server/slice/cut_cluster.h"
#include "server/slice/join_parts.h"
#include "server/slice/slice.h"

namespace liquidblend::slice {
namespace {

using Point = std::array<float, 3>;

// A loop of k corners becomes k - 2 triangles, and a cell's loops have kMaxEdges corners at most.
constexpr int kMaxCellTriangles = mesh::kMaxEdges;
// How many clusters ahead memory is fetched.
constexpr size_t kLookahead = 3;
// Some 50 us of work, which pays for waking a thread.
constexpr size_t kMinClustersPerPart = 64;

float DistanceSq(const Point& a, const Point& b) {
  const float x = a[0] - b[0];
  const float y = a[1] - b[1];
  const float z = a[2] - b[2];
  return x * x + y * y + z * z;
}

// The smallest float that is not before the time: comparing with it is comparing with the time.
float FirstFloatFrom(double time) {
  const auto rounded = static_cast<float>(time);
  if (static_cast<double>(rounded) >= time) return rounded;
  return std::nextafter(rounded, std::numeric_limits<float>::infinity());
}

// A loop that is being cut into triangles.
struct Polygon {
  int size = 0;
  std::array<uint8_t, mesh::kMaxEdges> crossings;  // its corners
  std::array<int8_t, mesh::kMaxEdges> cell_edges;  // that they lie on
  int Previous(int k) const { return k == 0 ? size - 1 : k - 1; }
  int Next(int k) const { return k + 1 == size ? 0 : k + 1; }

  void Remove(int k) {
    for (int i = k; i + 1 < size; ++i) {
      crossings[i] = crossings[i + 1];
      cell_edges[i] = cell_edges[i + 1];
    }
    --size;
  }
};

// Makes the surface of cut clusters, in one part of it.
class Marcher {
 public:
  Marcher(const mesh::VertexPlacer& placer, double time_frames,
          std::vector<int32_t>& first_crossing, SurfacePart& part)
      : placer_(placer), time_(time_frames), first_crossing_(first_crossing), part_(part) {}

  // To be called some time before Add().
  void Prefetch(const CutCluster& cut) const {
    placer_.Prefetch(cut.near_vertices());
    placer_.Prefetch(cut.far_vertices());
  }

  // Clusters come in ascending order.
  void Add(int32_t number, const CutCluster& cut) {
    MakeRoom();
    first_crossing_[number] = static_cast<int32_t>(part_.num_crossings);
    part_.num_crossings += cut.cluster().num_own_edges;
    FindVertices(cut, &part_.crossings[first_crossing_[number]]);
    for (const int16_t quad : cut.quads()) AddQuad(cut.corners() + quad);
    for (const int16_t triangle : cut.triangles()) {
      const uint8_t* corner = cut.corners() + triangle;
      AddTriangle(corner[0], corner[1], corner[2]);
    }
    for (const Loop& loop : cut.polygons()) AddPolygon(cut, loop);
  }

 private:
  // One cluster cannot add more than this, so that cells need not ask for room one by one.
  void MakeRoom() {
    const auto grow = [](size_t size, size_t most, auto& buffer) {
      if (size + most > buffer.size()) buffer.resize(2 * (size + most));
    };
    grow(part_.num_vertices, kMaxClusterEdges, part_.vertices);
    grow(part_.num_triangles, kMaxClusterCells * kMaxCellTriangles, part_.triangles);
    grow(part_.num_crossings, kMaxClusterEdges, part_.crossings);
  }

  // Gives each crossing its output vertex: that of the cluster before this one which the edge
  // belongs to, or a new one.
  //   own  vertices of the cluster's own edges
  void FindVertices(const CutCluster& cut, int32_t* own) {
    AddVertices(cut, cut.own(), cut.near_vertices(), cut.far_vertices(), own);
    for (const uint8_t k : cut.shared()) {
      const auto [low, high] = cut.EndsOf(cut.crossings()[k]);
      const int32_t near = cut.cluster().vertices[low];
      const int32_t far = cut.cluster().vertices[high];
      if (!TakeShared(cut, k, near, far)) AddVertices(cut, {&k, 1}, {&near, 1}, {&far, 1}, own);
    }
  }

  // False if the edge's cluster has not crossed it, which its bounds rule out.
  bool TakeShared(const CutCluster& cut, uint8_t k, int32_t near, int32_t far) {
    const Cluster& cluster = cut.cluster();
    const int shared = cut.crossings()[k].edge - cluster.num_own_edges;
    const int32_t owner = cluster.owner_clusters[shared];
    const int32_t edge = cluster.owner_edges[shared];
    if (owner < part_.first_cluster) {
      AddOuter({{{}, near, far}, owner, edge}, k);
      return true;
    }
    const int32_t v = part_.Find(int64_t{first_crossing_[owner]} + edge, near, far);
    if (v < 0) return false;
    output_[k] = v;
    points_[k] = part_.vertices[v].point;
    return true;
  }

  void AddOuter(OuterVertex outer, uint8_t k) {
    placer_.Place({&outer.itself.near_vertex, 1}, near_positions_.data());
    placer_.Place({&outer.itself.far_vertex, 1}, far_positions_.data());
    outer.itself.point = points_[k] = Interpolate(near_positions_[0], far_positions_[0]);
    output_[k] = -1 - static_cast<int32_t>(part_.outer.size());
    part_.outer.push_back(outer);
  }

  void AddVertices(const CutCluster& cut, std::span<const uint8_t> crossings,
                   std::span<const int32_t> near, std::span<const int32_t> far, int32_t* own) {
    const size_t first = part_.num_vertices;
    placer_.Place(near, near_positions_.data());
    placer_.Place(far, far_positions_.data());
    PartVertex* vertices = &part_.vertices[first];
    for (size_t i = 0; i < crossings.size(); ++i) {
      const uint8_t k = crossings[i];
      output_[k] = own[cut.crossings()[k].edge] = static_cast<int32_t>(first + i);
      points_[k] = Interpolate(near_positions_[i], far_positions_[i]);
      vertices[i] = {points_[k], near[i], far[i]};
    }
    part_.num_vertices += crossings.size();
  }

  // Exactly one end where its time is the slice's.
  Point Interpolate(const mesh::Float4& a, const mesh::Float4& b) const {
    const double s = (time_ - a[3]) / (static_cast<double>(b[3]) - a[3]);
    const double r = 1.0 - s;
    return {static_cast<float>(r * a[0] + s * b[0]), static_cast<float>(r * a[1] + s * b[1]),
            static_cast<float>(r * a[2] + s * b[2])};
  }

  // Along the shorter diagonal.
  void AddQuad(const uint8_t* v) {
    const int first = static_cast<int>(DistanceSq(points_[v[1]], points_[v[3]]) <
                                       DistanceSq(points_[v[0]], points_[v[2]]));
    const uint8_t a = v[first];
    const uint8_t c = v[first + 2];
    AddTriangle(a, v[first + 1], c);
    AddTriangle(a, c, v[(first + 3) % 4]);
  }

  void AddPolygon(const CutCluster& cut, const Loop& loop) {
    Polygon polygon;
    polygon.size = loop.size;
    std::copy_n(cut.corners() + loop.begin, loop.size, polygon.crossings.begin());
    std::copy_n(loop.cell_edges, loop.size, polygon.cell_edges.begin());
    while (polygon.size > 3) {
      const int ear = BestEar(polygon, cut.facet_mates());
      AddTriangle(polygon.crossings[polygon.Previous(ear)], polygon.crossings[ear],
                  polygon.crossings[polygon.Next(ear)]);
      polygon.Remove(ear);
    }
    AddTriangle(polygon.crossings[0], polygon.crossings[1], polygon.crossings[2]);
  }

  // The ear with the shortest base; a base inside of a facet, which the neighbour might choose as
  // well (four triangles on one edge), only if there is no other.
  int BestEar(const Polygon& polygon,
              const std::array<uint16_t, mesh::kMaxEdges>& facet_mates) const {
    int best = 0;
    auto best_cost = std::pair(true, std::numeric_limits<float>::infinity());
    for (int k = 0; k < polygon.size; ++k) {
      const int before = polygon.Previous(k);
      const int after = polygon.Next(k);
      const bool is_in_facet =
          (facet_mates[polygon.cell_edges[before]] >> polygon.cell_edges[after] & 1) != 0;
      const float base_sq =
          DistanceSq(points_[polygon.crossings[before]], points_[polygon.crossings[after]]);
      const auto cost = std::pair(is_in_facet, base_sq);
      if (cost < best_cost) {
        best = k;
        best_cost = cost;
      }
    }
    return best;
  }

  // A cell with a corner twice can name a vertex twice; left out, such a triangle leaves no gap.
  void AddTriangle(uint8_t a, uint8_t b, uint8_t c) {
    part_.triangles[part_.num_triangles] = {output_[a], output_[b], output_[c]};
    part_.num_triangles += a != b && b != c && c != a ? 1 : 0;
  }

  const mesh::VertexPlacer& placer_;
  const double time_;
  std::vector<int32_t>& first_crossing_;  // of all parts: each has the clusters' from its first on
  SurfacePart& part_;
  // Of the cluster that is being added.
  std::array<int32_t, kMaxClusterEdges> output_;               // per crossing: the output vertex
  std::array<Point, kMaxClusterEdges> points_;                 // per crossing
  std::array<mesh::Float4, kMaxClusterEdges> near_positions_;  // of new output vertices
  std::array<mesh::Float4, kMaxClusterEdges> far_positions_;
};

// While a cluster is cut, the positions for the one before it are on their way.
void MarchPart(const CellIndex& index, const mesh::VertexPlacer& placer,
               std::span<const int32_t> clusters, Workspace& workspace, SurfacePart& part) {
  part.Clear(clusters.empty() ? 0 : clusters.front());
  Marcher marcher(placer, workspace.time_frames, workspace.first_crossing, part);
  const float first_later = FirstFloatFrom(workspace.time_frames);
  std::array<CutCluster, 2> cuts;
  CutCluster* cut = &cuts[0];
  CutCluster* waiting = &cuts[1];
  int32_t waiting_number = -1;
  for (size_t i = 0; i < clusters.size(); ++i) {
    if (workspace.stop != nullptr && workspace.stop->load(std::memory_order_relaxed)) break;
    if (i + kLookahead < clusters.size()) index.Prefetch(clusters[i + kLookahead]);
    if (!cut->Cut(index.cluster(clusters[i]), workspace.terms, first_later)) continue;
    marcher.Prefetch(*cut);
    if (waiting_number >= 0) marcher.Add(waiting_number, *waiting);
    waiting_number = clusters[i];
    std::swap(cut, waiting);
  }
  if (waiting_number >= 0) marcher.Add(waiting_number, *waiting);
}

// Two for each thread, so that one which gets through less of them holds up the others less.
size_t NumParts(const Workspace& workspace) {
  const int num_idle = workspace.helpers == nullptr ? 0 : workspace.helpers->num_idle();
  if (num_idle == 0) return 1;
  return std::clamp<size_t>(workspace.clusters.size() / kMinClustersPerPart, 1,
                            2 * (static_cast<size_t>(num_idle) + 1));
}

}  // namespace

mesh::TriangleMesh March(const CellIndex& index, const mesh::VertexPlacer& placer,
                         Workspace& workspace) {
  if (workspace.first_crossing.size() < static_cast<size_t>(index.num_clusters())) {
    workspace.first_crossing.resize(index.num_clusters(), 0);
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
  return JoinParts(std::span(workspace.parts).first(num_parts), workspace.first_crossing, for_each,
                   workspace.near_vertex, workspace.far_vertex);
}

}  // namespace liquidblend::slice
