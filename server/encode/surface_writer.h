// A closed triangle surface of positions alone as a Draco mesh, without libdraco: several times
// faster than it, byte for byte the same stream.
#pragma once

#include <string>

#include "core/mesh/triangle_mesh.h"
#include "core/parallel/helpers.h"
#include "server/encode/corner_table.h"
#include "server/encode/edgebreaker.h"
#include "server/encode/position_coder.h"
#include "server/encode/symbol_coder.h"

namespace liquidblend::encode {

// Options of a surface's Draco mesh.
struct SurfaceWriterOptions {
  EdgebreakerMethod method = EdgebreakerMethod::kStandard;
  PositionCoderOptions positions;
};

// Writer of surfaces. Keeps its memory from one surface to the next: one per thread.
class SurfaceWriter {
 public:
  // Sets `out` to the Draco mesh. libdraco 1.5.5 makes the same of the same triangles with the same
  // method, grid and precision, unless an edge has four triangles or more: these are paired here,
  // while libdraco cuts the surface open along such edges.
  // Returns false, with `out` undefined, for surfaces that libdraco has to write: those that are
  // not closed and oriented, have no triangles, or have two triangles for a component. Normals and
  // velocities are not written.
  //   helpers  threads that may help while they are idle, or null
  // Requires: mesh passed Validate(); options are in range. Threads: safe with a writer per caller;
  // the same bytes always, however many helpers there are. Cost: 30 to 50 ns per triangle.
  bool Write(const mesh::TriangleMesh& mesh, const SurfaceWriterOptions& options, std::string& out,
             parallel::Helpers* helpers = nullptr);

 private:
  CornerTable table_;
  Edgebreaker edgebreaker_;
  PositionCoder position_coder_;
  SymbolCoder symbol_coder_;
};

}  // namespace liquidblend::encode
