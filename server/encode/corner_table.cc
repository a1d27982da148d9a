#include "server/encode/corner_table.h"

#ifdef __SSE2__
#include <emmintrin.h>
#endif

#include <algorithm>
#include <bit>

namespace liquidblend::encode {
namespace {

constexpr int64_t kMaxTriangles = int64_t{1} << 28;  // 4 of each fit an int32_t
// Fewest vertices in a part: some 80 us of work, which pays for waking a thread.
constexpr int32_t kMinVerticesPerPart = 4096;

// The set of the k with values[k] == value, as bits. No branches, since they could not be
// predicted.
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

bool CornerTable::Build(const mesh::TriangleMesh& mesh, parallel::Helpers* helpers) {
  if (mesh.num_triangles() >= kMaxTriangles) return false;
  Reset(mesh);
  if (!ListCorners()) {
    CopyTriangles(/*leave_out_degenerate=*/true);
    ListCorners();
  }
  if (!LinkAll(helpers)) return false;
  for (const Linker& linker : linkers_) {
    for (const int32_t vertex : linker.unsplit) SplitFans(vertex);
  }
  return true;
}

void CornerTable::Reset(const mesh::TriangleMesh& mesh) {
  vertices_ = mesh.triangles.data();
  num_triangles_ = static_cast<int32_t>(mesh.num_triangles());
  const auto num_vertices = static_cast<size_t>(mesh.num_vertices());
  right_.resize(3 * static_cast<size_t>(num_triangles_));
  if (blocks_.size() < num_vertices) blocks_.resize(num_vertices);
  if (block_links_.size() < num_vertices) block_links_.resize(num_vertices);
  valences_.resize(num_vertices);
  split_parents_.clear();
  num_used_vertices_ = 0;
}

// Puts each triangle into the blocks of its vertices; false at one that names a vertex twice.
bool CornerTable::ListCorners() {
  num_blocks_ = num_vertices();
  std::fill(valences_.begin(), valences_.end(), 0);
  const auto add = [this](int32_t vertex, int32_t before, int32_t corner) {
    const int32_t number = valences_[vertex]++;
    Block& block = blocks_[number < kPerBlock ? vertex : BlockFor(vertex, number)];
    const int32_t place = number & (kPerBlock - 1);
    block.vertices[place] = static_cast<uint32_t>(before);
    block.corners[place] = corner;
  };
  for (int32_t t = 0; t < num_triangles_; ++t) {
    const int32_t a = vertices_[3 * t], b = vertices_[3 * t + 1], c = vertices_[3 * t + 2];
    if (a == b || b == c || c == a) return false;
    add(a, c, 4 * t + 1);
    add(b, a, 4 * t + 2);
    add(c, b, 4 * t);
  }
  return true;
}

void CornerTable::CopyTriangles(bool leave_out_degenerate) {
  copy_.resize(3 * static_cast<size_t>(num_triangles_));
  int32_t* out = copy_.data();
  for (int32_t t = 0; t < num_triangles_; ++t) {
    const int32_t a = vertices_[3 * t], b = vertices_[3 * t + 1], c = vertices_[3 * t + 2];
    if (leave_out_degenerate && (a == b || b == c || c == a)) continue;
    for (const int32_t vertex : {a, b, c}) *out++ = vertex;
  }
  vertices_ = copy_.data();
  num_triangles_ = static_cast<int32_t>(out - copy_.data()) / 3;
}

// The block for a vertex's triangle with this number, which is not in the first block: the last
// block, which may be new.
int32_t CornerTable::BlockFor(int32_t vertex, int32_t number) {
  if (number % kPerBlock != 0) return block_links_[vertex];
  const int32_t added = num_blocks_++;
  if (blocks_.size() <= static_cast<size_t>(added)) {
    blocks_.resize(2 * blocks_.size());
    block_links_.resize(blocks_.size());
  }
  block_links_[added] = block_links_[vertex];
  block_links_[vertex] = added;
  return added;
}

bool CornerTable::LinkAll(parallel::Helpers* helpers) {
  const int32_t num_mesh_vertices = num_vertices();
  const int num_idle = helpers == nullptr ? 0 : helpers->num_idle();
  const int num_parts =
      num_idle == 0 ? 1
                    : std::clamp(num_mesh_vertices / kMinVerticesPerPart, 1, 2 * (num_idle + 1));
  linkers_.resize(num_parts);
  const auto link = [&](int p) {
    const auto begin_of = [&](int part) {
      return static_cast<int32_t>(int64_t{num_mesh_vertices} * part / num_parts);
    };
    LinkSome(begin_of(p), begin_of(p + 1), linkers_[p]);
  };
  num_parts == 1 ? link(0) : helpers->Run(num_parts, link);
  bool is_closed = true;
  for (const Linker& linker : linkers_) {
    num_used_vertices_ += linker.num_used_vertices;
    is_closed &= linker.is_closed;
  }
  return is_closed;
}

// Links the triangles around some vertices. No other call reads or writes the same numbers.
void CornerTable::LinkSome(int32_t begin, int32_t end, Linker& linker) {
  linker.num_used_vertices = 0;
  linker.is_closed = true;
  linker.unsplit.clear();
  for (int32_t v = begin; v < end && linker.is_closed; ++v) {
    if (valences_[v] == 0) continue;
    linker.is_closed = LinkAround(v, linker);
    ++linker.num_used_vertices;
  }
}

// Links the triangles across all edges out of the vertex; false if they do not pair up.
bool CornerTable::LinkAround(int32_t vertex, Linker& linker) {
  const int32_t valence = valences_[vertex];
  const Block& first = blocks_[vertex];
  if (valence <= kPerBlock) {
    if (LinkFan<kPerBlock>(first.vertices.data(), first.corners.data(), valence)) return true;
  }
  Collect(vertex, linker);
  if (valence > kPerBlock && valence <= 2 * kPerBlock &&
      LinkFan<2 * kPerBlock>(linker.around_vertices.data(), linker.around_corners.data(),
                             valence)) {
    return true;
  }
  return LinkMany(vertex, linker);
}

// Links the triangles around a vertex of few triangles. The triangle across the edge to the next
// vertex is the one that has this vertex before the corner. Returns false, too, if the triangles do
// not form one ring.
template <int kMaxValence>
bool CornerTable::LinkFan(const uint32_t* vertices, const int32_t* corners, int valence) {
  const uint32_t all = (1U << valence) - 1;
  uint32_t missing = 0;  // its highest bit
  uint64_t ring = 0;     // four bits for each triangle: the one across
  for (int i = 0; i < valence; ++i) {
    const auto next = static_cast<uint32_t>(VertexOf(corners[i]));
    const uint32_t found = MatchMask<kMaxValence>(vertices, next) & all;
    missing |= found - 1;
    const int across = std::countr_zero(found | 1U << (kMaxValence - 1));
    ring |= static_cast<uint64_t>(across) << (4 * i);
    right_[Place(corners[i])] = corners[across];
  }
  int num_rounds = 0;
  uint32_t at = 0;
  for (int i = 0; i < valence; ++i) {
    at = (ring >> (4 * at)) & 15;
    num_rounds += at == 0 ? 1 : 0;
  }
  return missing >> 31 == 0 && at == 0 && num_rounds == 1;
}

// Links any triangles around a vertex. Of several edges between two vertices the n-th one out is
// paired with the n-th one in, in the triangles' order. That gives the same pairs from either
// vertex.
bool CornerTable::LinkMany(int32_t vertex, Linker& linker) {
  linker.edges_out.clear();
  linker.edges_in.clear();
  for (size_t i = 0; i < linker.around_corners.size(); ++i) {
    const auto corner = static_cast<uint64_t>(linker.around_corners[i]);
    const auto next = static_cast<uint64_t>(VertexOf(linker.around_corners[i]));
    linker.edges_out.push_back(next << 32 | corner);
    linker.edges_in.push_back(uint64_t{linker.around_vertices[i]} << 32 | corner);
  }
  std::sort(linker.edges_out.begin(), linker.edges_out.end());
  std::sort(linker.edges_in.begin(), linker.edges_in.end());
  for (size_t i = 0; i < linker.edges_out.size(); ++i) {
    if (linker.edges_out[i] >> 32 != linker.edges_in[i] >> 32) return false;
    right_[Place(static_cast<int32_t>(linker.edges_out[i]))] =
        static_cast<int32_t>(linker.edges_in[i]);
  }
  linker.unsplit.push_back(vertex);
  return true;
}

void CornerTable::Collect(int32_t vertex, Linker& linker) const {
  const int32_t valence = valences_[vertex];
  const int32_t num_of_vertex = (valence + kPerBlock - 1) / kPerBlock;
  linker.around_vertices.resize(static_cast<size_t>(num_of_vertex) * kPerBlock);
  linker.around_corners.resize(linker.around_vertices.size());
  int32_t block = vertex;
  for (int32_t n = 0; n < num_of_vertex; ++n) {
    // The links go from the first block to the last one, which is the only one that may not be
    // full.
    const int32_t at = n == 0 ? 0 : (num_of_vertex - n) * kPerBlock;
    std::copy_n(blocks_[block].vertices.begin(), kPerBlock, linker.around_vertices.begin() + at);
    std::copy_n(blocks_[block].corners.begin(), kPerBlock, linker.around_corners.begin() + at);
    block = block_links_[block];
  }
  linker.around_corners.resize(valence);
}

int32_t CornerTable::FanSize(int32_t corner) const {
  int32_t size = 0;
  int32_t c = corner;
  do {
    ++size;
    c = Next(RightOf(c));
  } while (c != corner);
  return size;
}

// Splits a vertex of several fans: each fan gets a new vertex, and the old one has no triangles any
// more.
void CornerTable::SplitFans(int32_t vertex) {
  Linker& linker = linkers_[0];
  Collect(vertex, linker);
  if (FanSize(Previous(linker.around_corners[0])) == valences_[vertex]) return;
  if (vertices_ != copy_.data()) CopyTriangles(/*leave_out_degenerate=*/false);
  for (const int32_t next : linker.around_corners) {
    const int32_t corner = Previous(next);
    if (VertexOf(corner) != vertex) continue;
    const int32_t added = num_vertices();
    valences_.push_back(FanSize(corner));
    split_parents_.push_back(vertex);
    ++num_used_vertices_;
    int32_t c = corner;
    do {
      copy_[Place(c)] = added;
      c = Next(RightOf(c));
    } while (c != corner);
  }
  valences_[vertex] = 0;
  --num_used_vertices_;
}

}  // namespace liquidblend::encode
