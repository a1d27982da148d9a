#include "server/encode/corner_table.h"

#include <algorithm>
#include <bit>

namespace liquidblend::encode {
namespace {

constexpr int32_t kNone = -1;
constexpr int64_t kMaxTriangles = int64_t{1} << 27;  // 16 of each fit an int32_t

using Uint32x4 = uint32_t __attribute__((vector_size(16)));

// Bit k: far_vertex[k] is `far`. No branches: which edge of a vertex it is cannot be foretold.
uint32_t MatchMask(const std::array<uint32_t, 8>& far_vertex, uint32_t far) {
  const auto* const halves = reinterpret_cast<const Uint32x4*>(far_vertex.data());
  const Uint32x4 low = reinterpret_cast<Uint32x4>(halves[0] == far) & Uint32x4{1, 2, 4, 8};
  const Uint32x4 high = reinterpret_cast<Uint32x4>(halves[1] == far) & Uint32x4{16, 32, 64, 128};
  const Uint32x4 all = low | high;
  return all[0] | all[1] | all[2] | all[3];
}

}  // namespace

bool CornerTable::Build(const mesh::TriangleMesh& mesh) {
  if (mesh.num_triangles() >= kMaxTriangles) return false;
  Reset(mesh);
  for (Eigen::Index t = 0; t < mesh.num_triangles(); ++t) {
    AddTriangle({mesh.triangles(0, t), mesh.triangles(1, t), mesh.triangles(2, t)});
  }
  if (!LinkCrowded()) return false;
  SplitFans();
  return true;
}

void CornerTable::Reset(const mesh::TriangleMesh& mesh) {
  const auto num_vertices = static_cast<size_t>(mesh.num_vertices());
  const size_t num_corners = 8 * static_cast<size_t>(mesh.num_triangles());
  if (table_.size() < num_corners) table_.resize(num_corners);
  if (blocks_.size() < num_vertices) blocks_.resize(num_vertices);
  num_edges_.assign(num_vertices, 0);
  next_block_.assign(num_vertices, kNone);
  vertex_corner_.resize(num_vertices);
  valences_.assign(num_vertices, 0);
  split_parents_.clear();
  crowded_.clear();
  num_triangles_ = 0;
  num_waiting_ = 0;
}

void CornerTable::AddTriangle(const std::array<int32_t, 3>& vertices) {
  const auto [a, b, c] = vertices;
  if (a == b || b == c || c == a) return;
  const int32_t corner = 8 * num_triangles_++;
  for (int k = 0; k < 3; ++k) {
    table_[corner + k] = vertices[k];
    ++valences_[vertices[k]];
    vertex_corner_[vertices[k]] = corner + k;
  }
  LinkCorner(corner, b, c);
  LinkCorner(corner + 1, c, a);
  LinkCorner(corner + 2, a, b);
}

// The block and the place of the edge in it; the place may be one beyond the last.
std::pair<int32_t, uint32_t> CornerTable::FindEdge(int32_t near, uint32_t far) const {
  int32_t block = near;
  while (true) {
    const uint32_t end = 1U << num_edges_[block];
    const uint32_t found = MatchMask(blocks_[block].far_vertex, far) & (end - 1);
    const auto place = static_cast<uint32_t>(std::countr_zero(found | end));
    if (place < kEdgesPerBlock || next_block_[block] == kNone) return {block, place};
    block = next_block_[block];
  }
}

void CornerTable::LinkCorner(int32_t corner, int32_t from, int32_t to) {
  const auto far = static_cast<uint32_t>(std::max(from, to));
  auto [block, place] = FindEdge(std::min(from, to), far);
  if (place == kEdgesPerBlock) {
    const auto added = static_cast<int32_t>(num_edges_.size());
    next_block_[block] = added;
    num_edges_.push_back(0);
    next_block_.push_back(kNone);
    if (blocks_.size() < num_edges_.size()) blocks_.resize(2 * blocks_.size());
    block = added;
    place = 0;
  }
  EdgeBlock& edges = blocks_[block];
  const bool is_new = place == num_edges_[block];
  const int32_t waiting = is_new ? kNone : edges.waiting[place];
  const int32_t here = 2 * corner + (from > to ? 1 : 0);
  if (waiting != kNone && ((waiting ^ here) & 1) == 0) {
    crowded_.push_back(corner);
    return;
  }
  // Whether the edge waits or is the first of the two is a coin's toss, so both are one path: the
  // first one faces itself until the second comes.
  const bool is_first = waiting == kNone;
  const int32_t partner = is_first ? corner : waiting >> 1;
  table_[corner + 4] = partner;
  table_[partner + 4] = corner;
  edges.far_vertex[place] = far;
  edges.waiting[place] = is_first ? here : kNone;
  num_edges_[block] = static_cast<uint8_t>(num_edges_[block] + (is_new ? 1 : 0));
  num_waiting_ += is_first ? 1 : -1;
}

// Offers the corners again that came when another of their direction waited; each round that links
// any leaves fewer.
bool CornerTable::LinkCrowded() {
  std::vector<int32_t> crowded;
  while (!crowded_.empty()) {
    crowded.swap(crowded_);
    crowded_.clear();
    for (const int32_t corner : crowded) {
      LinkCorner(corner, VertexOf(Next(corner)), VertexOf(Previous(corner)));
    }
    if (crowded_.size() == crowded.size()) return false;
  }
  return num_waiting_ == 0;
}

int32_t CornerTable::FanSize(int32_t corner) const {
  int32_t size = 0;
  int32_t c = corner;
  do {
    ++size;
    c = Next(Opposite(Next(c)));
  } while (c != corner);
  return size;
}

// All fans of a vertex that has several become vertices of their own; it is left without any.
void CornerTable::SplitFans() {
  const auto num_mesh_vertices = static_cast<int32_t>(valences_.size());
  bool is_any_pinched = false;
  num_used_vertices_ = 0;
  for (int32_t v = 0; v < num_mesh_vertices; ++v) {
    if (valences_[v] == 0) continue;
    if (FanSize(vertex_corner_[v]) == valences_[v]) {
      ++num_used_vertices_;
    } else {
      valences_[v] = 0;
      is_any_pinched = true;
    }
  }
  if (!is_any_pinched) return;
  for (int32_t corner = 0; corner < 8 * num_triangles_; corner += 8) {
    for (int k = 0; k < 3; ++k) {
      if (valences_[VertexOf(corner + k)] == 0) SplitOffFan(corner + k);
    }
  }
}

void CornerTable::SplitOffFan(int32_t corner) {
  const auto vertex = static_cast<int32_t>(valences_.size());
  split_parents_.push_back(VertexOf(corner));
  valences_.push_back(FanSize(corner));
  ++num_used_vertices_;
  int32_t c = corner;
  do {
    table_[c] = vertex;
    c = Next(Opposite(Next(c)));
  } while (c != corner);
}

}  // namespace liquidblend::encode
