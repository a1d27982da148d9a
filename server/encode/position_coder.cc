#include "server/encode/position_coder.h"

#include <algorithm>
#include <cstring>
#include <limits>

#include "server/encode/bytes.h"

namespace liquidblend::encode {
namespace {

// Numbers of the bitstream.
constexpr uint8_t kMeshConnectivity = 0xFF;  // no connectivity of its own
constexpr uint8_t kPerVertex = 0;
constexpr uint8_t kDepthFirst = 0;
constexpr uint8_t kPosition = 0;
constexpr uint8_t kFloat = 9;
constexpr uint8_t kQuantized = 2;
constexpr uint8_t kParallelogram = 1;
constexpr uint8_t kWrap = 1;
constexpr uint8_t kEntropyCoded = 1;
constexpr int kDimensions = 3;

void PutDescription(std::string& out) {
  PutByte(1, out);  // attribute coders
  PutByte(kMeshConnectivity, out);
  PutByte(kPerVertex, out);
  PutByte(kDepthFirst, out);
  PutVarint(1, out);  // attributes
  PutByte(kPosition, out);
  PutByte(kFloat, out);
  PutByte(kDimensions, out);
  PutByte(0, out);    // not normalized
  PutVarint(0, out);  // its number
  PutByte(kQuantized, out);
}

}  // namespace

bool PositionCoder::Put(const CornerTable& table, std::span<const int32_t> last_corners,
                        const PositionCoderOptions& options, SymbolCoder& coder, std::string& out) {
  for (const int32_t v : table.split_parents()) nodes_.push_back(Node(nodes_[v]));
  FindBounds(table);
  PredictAll(table, last_corners);
  PutDescription(out);
  PutByte(kParallelogram, out);
  PutByte(kWrap, out);
  PutByte(kEntropyCoded, out);
  const std::span<const uint32_t> symbols(symbols_.data(), end_);
  if (!coder.Put(symbols, {kDimensions, options.extra_precision}, out)) return false;
  PutValue(min_, out);
  PutValue(max_, out);
  PutValue(options.grid.origin, out);
  PutValue(options.grid.extent_m, out);
  PutByte(static_cast<uint8_t>(options.bits), out);
  return true;
}

// Rounds by libdraco's arithmetic, in float. Positions outside of the grid are moved onto its
// border.
void PositionCoder::Round(const mesh::TriangleMesh& mesh, const PositionCoderOptions& options) {
  const auto max_node = static_cast<float>((1 << options.bits) - 1);
  const float nodes_per_m = max_node / options.grid.extent_m;
  const std::array<float, 3>& low = options.grid.origin;
  const float extent = options.grid.extent_m;
  const auto round = [&](float x, int axis) {
    const float clamped = std::clamp(x, low[axis], low[axis] + extent);
    return static_cast<int32_t>((clamped - low[axis]) * nodes_per_m + 0.5F);
  };
  nodes_.resize(mesh.num_vertices());
  for (Eigen::Index v = 0; v < mesh.num_vertices(); ++v) {
    const float* const p = mesh.vertices.col(v).data();
    nodes_[v] = Node{round(p[0], 0), round(p[1], 1), round(p[2], 2), 0};
  }
}

void PositionCoder::FindBounds(const CornerTable& table) {
  Node lowest = Node{} + std::numeric_limits<int32_t>::max();
  Node highest = Node{} + std::numeric_limits<int32_t>::min();
  for (int32_t v = 0; v < table.num_vertices(); ++v) {
    if (table.valences()[v] == 0) continue;
    lowest = nodes_[v] < lowest ? nodes_[v] : lowest;
    highest = nodes_[v] > highest ? nodes_[v] : highest;
  }
  min_ = std::min({lowest[0], lowest[1], lowest[2]});
  max_ = std::max({highest[0], highest[1], highest[2]});
}

// Predicts all positions in the decoder's order: components from the last one to the first.
void PositionCoder::PredictAll(const CornerTable& table, std::span<const int32_t> last_corners) {
  const size_t num_symbols = kDimensions * static_cast<size_t>(table.num_used_vertices());
  symbols_.resize(num_symbols + 1);
  end_ = symbols_.data();
  is_triangle_done_.assign(table.num_triangles(), 0);
  is_vertex_done_.assign(table.num_vertices(), 0);
  last_ = Node{0, 0, 0, 0};
  for (size_t i = last_corners.size(); i > 0; --i) {
    const int32_t corner = last_corners[i - 1];
    // The first triangle's vertices have no parallelogram: each is predicted as the one before.
    for (const int32_t c : {CornerTable::Next(corner), CornerTable::Previous(corner), corner}) {
      is_vertex_done_[table.VertexOf(c)] = 1;
      PutResidual(nodes_[table.VertexOf(c)], last_);
    }
    is_triangle_done_[CornerTable::TriangleOf(corner)] = 1;
    Walk(table, table.RightOf(corner));
  }
}

// Walks over a component as Edgebreaker does, but only to the last vertex.
void PositionCoder::Walk(const CornerTable& table, int32_t corner) {
  const uint32_t* const all = symbols_.data() + symbols_.size() - 1;
  stack_.assign(1, corner);
  while (!stack_.empty() && end_ != all) {
    corner = stack_.back();
    if (is_triangle_done_[CornerTable::TriangleOf(corner)] != 0) {
      stack_.pop_back();
      continue;
    }
    while (true) {
      is_triangle_done_[CornerTable::TriangleOf(corner)] = 1;
      const int32_t right = table.RightOf(corner);
      const int32_t left = table.LeftOf(corner);
      table.Prefetch(right);
      table.Prefetch(left);
      uint8_t& is_tip_done = is_vertex_done_[table.VertexOf(corner)];
      if (is_tip_done == 0) {
        is_tip_done = 1;
        Predict(table, corner);
        corner = right;
        continue;
      }
      const bool is_right_done = is_triangle_done_[CornerTable::TriangleOf(right)] != 0;
      const bool is_left_done = is_triangle_done_[CornerTable::TriangleOf(left)] != 0;
      if (is_right_done && is_left_done) {
        stack_.pop_back();
        break;
      }
      if (is_right_done || is_left_done) {
        corner = is_right_done ? left : right;
        continue;
      }
      stack_.back() = left;
      stack_.push_back(right);
      break;
    }
  }
}

// Predicts a corner's vertex from the triangle beyond the edge that faces it. The walk came across
// that edge, so the three vertices are known.
void PositionCoder::Predict(const CornerTable& table, int32_t corner) {
  const Node next = nodes_[table.VertexOf(CornerTable::Next(corner))];
  const Node before = nodes_[table.VertexOf(CornerTable::Previous(corner))];
  const Node beyond = nodes_[table.VertexOf(table.Opposite(corner))];
  PutResidual(nodes_[table.VertexOf(corner)], next + before - beyond);
}

// Appends a residual. It is taken modulo the range of all coordinates; then the sign becomes the
// lowest bit.
void PositionCoder::PutResidual(Node node, Node predicted) {
  const int32_t range = max_ - min_ + 1;
  predicted = predicted < min_ ? Node{} + min_ : predicted;
  predicted = predicted > max_ ? Node{} + max_ : predicted;
  Node residual = node - predicted;
  residual += (residual < -(range / 2)) & range;
  residual -= (residual > (range - 1) / 2) & range;
  const Node symbols = (residual << 1) ^ (residual >> 31);
  std::memcpy(end_, &symbols, sizeof(symbols));
  end_ += kDimensions;
  last_ = node;
}

}  // namespace liquidblend::encode
