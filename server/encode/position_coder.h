// The POSITION attribute of a closed surface: rounded to the grid, predicted as the fourth corner
// of a parallelogram (C. Touma, C. Gotsman 1998; Draco bitstream specification 2.2, "Prediction
// parallelogram").
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "core/frames/grid.h"
#include "core/mesh/triangle_mesh.h"
#include "server/encode/corner_table.h"
#include "server/encode/symbol_coder.h"

namespace liquidblend::encode {

// Options of coding positions.
struct PositionCoderOptions {
  frames::Grid grid;        // finite
  int bits = 14;            // [8, 20]
  int extra_precision = 0;  // see SymbolCoderOptions
};

// Coder of positions. Keeps its memory from one surface to the next.
class PositionCoder {
 public:
  // Rounds the positions to the grid. To be called before Put(), with the same options.
  void Round(const mesh::TriangleMesh& mesh, const PositionCoderOptions& options);

  // Appends the only attribute of the table's vertices, as libdraco does, byte for byte. Returns
  // false, with `out` undefined, if the symbol coder does.
  //   last_corners  as Edgebreaker::last_corners() of the table
  // Requires: the table is that of the mesh that was rounded, of at least one triangle.
  bool Put(const CornerTable& table, std::span<const int32_t> last_corners,
           const PositionCoderOptions& options, SymbolCoder& coder, std::string& out);

 private:
  using Node = int32_t __attribute__((vector_size(16)));  // x, y, z, 0

  void FindBounds(const CornerTable& table);
  void PredictAll(const CornerTable& table, std::span<const int32_t> last_corners);
  void Walk(const CornerTable& table, int32_t corner);
  void Predict(const CornerTable& table, int32_t corner);
  void PutResidual(Node node, Node predicted);

  std::vector<Node> nodes_;        // per vertex
  int32_t min_ = 0, max_ = 0;      // of all coordinates of vertices that are used
  Node last_;                      // that was put
  std::vector<uint32_t> symbols_;  // and room for one more
  uint32_t* end_ = nullptr;        // of the symbols so far
  std::vector<uint8_t> is_triangle_done_;
  std::vector<uint8_t> is_vertex_done_;
  std::vector<int32_t> stack_;
};

}  // namespace liquidblend::encode
