#include "core/slice/cell_index.h"

#include <algorithm>
#include <limits>

#include "core/base/prefetch.h"
#include "core/mesh/target_motion.h"
#include "core/slice/cluster_builder.h"

namespace liquidblend::slice {
namespace {

constexpr float kInfinity = std::numeric_limits<float>::infinity();

constexpr int kNumCorners[] = {4, 5, 6, 8};  // by kind
constexpr int kNumEdges[] = {6, 8, 9, 12};

// The family's fields of times, in the order in which the index keeps them.
std::vector<std::span<const mesh::Float4>> FieldsOf(const mesh::RegisteredFamily& family) {
  std::vector<std::span<const mesh::Float4>> fields = {family.vertices};
  for (const mesh::FamilyTarget& target : family.targets) {
    fields.push_back(target.displacement);
    if (!target.extrapolation.empty()) fields.push_back(target.extrapolation);
  }
  return fields;
}

TimeRanges GroupRanges(const TimeRanges& clusters) {
  TimeRanges groups;
  for (size_t begin = 0; begin < clusters.min.size(); begin += kClustersPerGroup) {
    const size_t end = std::min(begin + kClustersPerGroup, clusters.min.size());
    groups.min.push_back(*std::min_element(&clusters.min[begin], clusters.min.data() + end));
    groups.max.push_back(*std::max_element(&clusters.max[begin], clusters.max.data() + end));
  }
  return groups;
}

template <typename T>
int64_t SizeBytes(const std::vector<T>& values) {
  return static_cast<int64_t>(values.capacity() * sizeof(T));
}

int64_t SizeBytes(const std::vector<TimeRanges>& fields) {
  int64_t bytes = 0;
  for (const TimeRanges& ranges : fields) bytes += SizeBytes(ranges.min) + SizeBytes(ranges.max);
  return bytes;
}

}  // namespace

CellIndex::CellIndex(const mesh::RegisteredFamily& family) : family_(&family) {
  ClusterBuilder builder(family, *this);
  builder.Add(family.tetrahedra, CellKind::kTetrahedron);
  builder.Add(family.pyramids, CellKind::kPyramid);
  builder.Add(family.wedges, CellKind::kWedge);
  builder.Add(family.hexahedra, CellKind::kHexahedron);
  bytes_.insert(bytes_.end(), kKernelOverrun, 0);
  for (auto* numbers : {&vertices_, &owner_clusters_}) numbers->shrink_to_fit();
  for (auto* numbers : {&bytes_, &owner_edges_}) numbers->shrink_to_fit();
  CopyTimes();
}

Cluster CellIndex::cluster(int32_t number) const {
  const Record& record = records_[number];
  Cluster cluster;
  cluster.kind = record.kind;
  cluster.num_cells = record.num_cells;
  cluster.num_edges = record.num_edges;
  cluster.num_own_edges = record.num_own_edges;
  cluster.vertices = std::span(vertices_).subspan(record.first_vertex, record.num_vertices);
  cluster.times = times_.data() + record.first_vertex * static_cast<int64_t>(cluster_times_.size());
  cluster.num_first_vertices = record.num_first_vertices;
  cluster.num_last_vertices = record.num_last_vertices;
  cluster.corners = bytes_.data() + record.first_byte;
  cluster.edges =
      cluster.corners + kNumCorners[static_cast<int>(record.kind)] * ptrdiff_t{record.num_cells};
  cluster.low_ends =
      cluster.edges + kNumEdges[static_cast<int>(record.kind)] * ptrdiff_t{record.num_cells};
  cluster.high_ends = cluster.low_ends + record.num_edges;
  cluster.has_repeated_corners = record.has_repeated_corners;
  cluster.owner_clusters = owner_clusters_.data() + record.first_owner;
  cluster.owner_edges = owner_edges_.data() + record.first_owner;
  return cluster;
}

void CellIndex::Prefetch(int32_t number) const {
  const Record& record = records_[number];
  const Cluster of = cluster(number);
  const auto fetch = [](const void* begin, int64_t bytes) {
    for (int64_t b = 0; b < bytes; b += 64) {
      base::PrefetchIntoL2(static_cast<const char*>(begin) + b);
    }
  };
  const auto kind = static_cast<int>(record.kind);
  fetch(of.times, record.num_vertices * std::ssize(cluster_times_) * int64_t{sizeof(float)});
  fetch(of.corners,
        (kNumCorners[kind] + kNumEdges[kind]) * record.num_cells + 2 * record.num_edges);
  fetch(of.vertices.data(), static_cast<int64_t>(of.vertices.size_bytes()));
  const int num_shared = record.num_edges - record.num_own_edges;
  fetch(of.owner_clusters, num_shared * int64_t{sizeof(int32_t)});
  fetch(of.owner_edges, num_shared);
}

void CellIndex::CopyTimes() {
  const std::vector<std::span<const mesh::Float4>> fields = FieldsOf(*family_);
  const auto last_begin =
      static_cast<int64_t>(family_->vertices.size()) - family_->num_last_vertices;
  cluster_times_.resize(fields.size());
  times_.reserve(vertices_.size() * fields.size() + kKernelOverrun / sizeof(float));
  for (Record& record : records_) {
    const auto vertices = std::span(vertices_).subspan(record.first_vertex, record.num_vertices);
    for (size_t f = 0; f < fields.size(); ++f) {
      const auto begin = times_.end();
      for (const int32_t v : vertices) times_.push_back(fields[f][v][3]);
      const auto [min, max] = std::minmax_element(begin, times_.end());
      cluster_times_[f].min.push_back(*min);
      cluster_times_[f].max.push_back(*max);
    }
    for (const int32_t v : vertices) {
      if (v < family_->num_first_vertices) ++record.num_first_vertices;
      if (v >= last_begin) ++record.num_last_vertices;
    }
    if (record.num_first_vertices > 0) cluster_times_[0].min.back() = -kInfinity;
    if (record.num_last_vertices > 0) cluster_times_[0].max.back() = kInfinity;
  }
  times_.resize(times_.capacity(), 0.0F);
  for (const TimeRanges& field : cluster_times_) group_times_.push_back(GroupRanges(field));
}

void CellIndex::AppendTerms(std::span<const double> weights, std::vector<TimeTerm>& terms) const {
  int field = 1;
  for (size_t k = 0; k < weights.size(); ++k) {
    const mesh::FamilyTarget& target = family_->targets[k];
    const mesh::TargetMotion motion = mesh::MotionAt(target, weights[k]);
    if (motion.displacement_factor != 0.0F) terms.push_back({motion.displacement_factor, field});
    ++field;
    if (motion.extrapolation_factor != 0.0F) terms.push_back({motion.extrapolation_factor, field});
    if (!target.extrapolation.empty()) ++field;
  }
}

int64_t CellIndex::size_bytes() const {
  return SizeBytes(records_) + SizeBytes(bytes_) + SizeBytes(vertices_) + SizeBytes(times_) +
         SizeBytes(owner_clusters_) + SizeBytes(owner_edges_) + SizeBytes(cluster_times_) +
         SizeBytes(group_times_);
}

}  // namespace liquidblend::slice
