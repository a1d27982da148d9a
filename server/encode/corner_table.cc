#include "server/encode/corner_table.h"

#ifdef __SSE2__
#include <emmintrin.h>
#endif

#include <algorithm>
#include <bit>

namespace liquidblend::encode {
namespace {

constexpr int64_t kMaxTriangles = int64_t{1} << 27;  // 8 of each fit an int32_t
constexpr int kMaxFew = 16;                          // corners, for which one mask is enough

// Bit k: values[k] is `value`. No branches, as these could not be foretold.
template <int kNumValues>
uint32_t MatchMask(const uint32_t* values, uint32_t value) {
  static_assert(kNumValues % 8 == 0);
  uint32_t mask = 0;
#ifdef __SSE2__
  const __m128i wanted = _mm_set1_epi32(static_cast<int>(value));
  for (int k = 0; k < kNumValues; k += 8) {
    const auto* const eight = reinterpret_cast<const __m128i*>(values + k);
    const __m128i low = _mm_cmpeq_epi32(_mm_loadu_si128(eight), wanted);
    const __m128i high = _mm_cmpeq_epi32(_mm_loadu_si128(eight + 1), wanted);
    const __m128i bytes = _mm_packs_epi16(_mm_packs_epi32(low, high), _mm_setzero_si128());
    mask |= static_cast<uint32_t>(_mm_movemask_epi8(bytes)) << k;
  }
#else
  for (int k = 0; k < kNumValues; ++k) mask |= (values[k] == value ? 1U : 0U) << k;
#endif
  return mask;
}

}  // namespace

bool CornerTable::Build(const mesh::TriangleMesh& mesh) {
  if (mesh.num_triangles() >= kMaxTriangles) return false;
  TakeTriangles(mesh);
  ListCorners();
  pinched_.clear();
  unchecked_.clear();
  split_parents_.clear();
  num_used_vertices_ = 0;
  for (int32_t v = 0; v < num_vertices(); ++v) {
    if (valences_[v] == 0) continue;
    if (!LinkAround(v)) return false;
    ++num_used_vertices_;
  }
  SplitPinched();
  return true;
}

void CornerTable::TakeTriangles(const mesh::TriangleMesh& mesh) {
  const size_t num_numbers = 8 * static_cast<size_t>(mesh.num_triangles());
  if (table_.size() < num_numbers) table_.resize(num_numbers);
  valences_.assign(mesh.num_vertices(), 0);
  num_triangles_ = 0;
  for (Eigen::Index t = 0; t < mesh.num_triangles(); ++t) {
    const int32_t* const vertices = mesh.triangles.col(t).data();
    const int32_t a = vertices[0], b = vertices[1], c = vertices[2];
    if (a == b || b == c || c == a) continue;
    int32_t* const out = &table_[8 * num_triangles_++];
    out[0] = a;
    out[1] = b;
    out[2] = c;
    ++valences_[a];
    ++valences_[b];
    ++valences_[c];
  }
}

void CornerTable::ListCorners() {
  corners_end_.resize(valences_.size());
  int32_t num_corners = 0;
  for (size_t v = 0; v < valences_.size(); ++v) {
    corners_end_[v] = num_corners;
    num_corners += valences_[v];
  }
  if (corners_.size() < static_cast<size_t>(num_corners)) corners_.resize(num_corners);
  // What is beyond the end is compared, too, but does not count.
  previous_.resize(std::max(previous_.size(), static_cast<size_t>(num_corners) + kMaxFew));
  const auto add = [&](int32_t corner, int32_t vertex, int32_t previous) {
    const int32_t at = corners_end_[vertex]++;
    corners_[at] = corner;
    previous_[at] = static_cast<uint32_t>(previous);
  };
  for (int32_t corner = 0; corner < 8 * num_triangles_; corner += 8) {
    const int32_t a = table_[corner], b = table_[corner + 1], c = table_[corner + 2];
    add(corner, a, c);
    add(corner + 1, b, a);
    add(corner + 2, c, b);
  }
}

// Sets the opposites over all edges from the vertex; false if they do not pair up.
bool CornerTable::LinkAround(int32_t vertex) {
  const int32_t valence = valences_[vertex];
  if (valence <= kMaxFew / 2 && LinkFew<kMaxFew / 2>(vertex)) return true;
  if (valence <= kMaxFew && LinkFew<kMaxFew>(vertex)) return true;
  return LinkMany(vertex);
}

// The edge out of a corner's triangle to the next vertex comes in from where that is the previous
// one. False also if several edges lead to one vertex.
template <int kMaxValence>
bool CornerTable::LinkFew(int32_t vertex) {
  const int32_t valence = valences_[vertex];
  const int32_t* const corners = &corners_[corners_end_[vertex] - valence];
  const uint32_t* const previous = &previous_[corners_end_[vertex] - valence];
  const uint32_t all = (1U << valence) - 1;
  uint32_t linked = 0;
  uint32_t surplus = 0;
  uint64_t order = 0;  // four bits for each corner: the next one around the vertex
  for (int32_t i = 0; i < valence; ++i) {
    const auto next = static_cast<uint32_t>(VertexOf(Next(corners[i])));
    const uint32_t found = MatchMask<kMaxValence>(previous, next) & all;
    linked |= found;
    surplus |= found & (found - 1);
    const auto across = static_cast<uint32_t>(std::countr_zero(found | 1U << (kMaxValence - 1)));
    order |= uint64_t{across} << (4 * i);
    table_[Previous(corners[i]) + 4] = Next(corners[across]);
  }
  if (linked != all || surplus != 0) return false;
  int num_first = 0;
  uint32_t at = 0;
  for (int32_t i = 0; i < valence; ++i) {
    at = (order >> (4 * at)) & 15;
    num_first += at == 0 ? 1 : 0;
  }
  if (num_first > 1) pinched_.push_back(vertex);
  return true;
}

// For any number, and for edges of four triangles and more: the n-th edge out to a vertex belongs
// to the n-th one in from it, which is the same pair seen from that vertex.
bool CornerTable::LinkMany(int32_t vertex) {
  const int32_t first = corners_end_[vertex] - valences_[vertex];
  edges_out_.clear();
  edges_in_.clear();
  for (int32_t i = first; i < corners_end_[vertex]; ++i) {
    const auto corner = static_cast<uint64_t>(corners_[i]);
    const auto next = static_cast<uint64_t>(VertexOf(Next(corners_[i])));
    edges_out_.push_back(next << 32 | corner);
    edges_in_.push_back(uint64_t{previous_[i]} << 32 | corner);
  }
  std::sort(edges_out_.begin(), edges_out_.end());
  std::sort(edges_in_.begin(), edges_in_.end());
  for (int32_t i = 0; i < valences_[vertex]; ++i) {
    if (edges_out_[i] >> 32 != edges_in_[i] >> 32) return false;
    const auto corner = static_cast<int32_t>(edges_out_[i]);
    table_[Previous(corner) + 4] = Next(static_cast<int32_t>(edges_in_[i]));
  }
  unchecked_.push_back(vertex);
  return true;
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
void CornerTable::SplitPinched() {
  for (const int32_t vertex : unchecked_) {
    const int32_t corner = corners_[corners_end_[vertex] - 1];
    if (FanSize(corner) < valences_[vertex]) pinched_.push_back(vertex);
  }
  for (const int32_t vertex : pinched_) {
    for (int32_t i = 1; i <= valences_[vertex]; ++i) {
      const int32_t corner = corners_[corners_end_[vertex] - i];
      if (VertexOf(corner) == vertex) SplitOffFan(corner);
    }
    valences_[vertex] = 0;
    --num_used_vertices_;
  }
}

void CornerTable::SplitOffFan(int32_t corner) {
  const int32_t vertex = num_vertices();
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
