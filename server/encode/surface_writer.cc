#include "server/encode/surface_writer.h"

#include "server/encode/bytes.h"

namespace liquidblend::encode {
namespace {

// Numbers of the bitstream (Draco bitstream specification 2.2, "Header").
constexpr uint8_t kMajorVersion = 2;
constexpr uint8_t kMinorVersion = 2;
constexpr uint8_t kMesh = 1;
constexpr uint8_t kEdgebreaker = 1;
constexpr uint16_t kNoFlags = 0;

void PutHeader(std::string& out) {
  out.append("DRACO");
  PutByte(kMajorVersion, out);
  PutByte(kMinorVersion, out);
  PutByte(kMesh, out);
  PutByte(kEdgebreaker, out);
  PutValue(kNoFlags, out);
}

}  // namespace

bool SurfaceWriter::Write(const mesh::TriangleMesh& mesh, const SurfaceWriterOptions& options,
                          std::string& out) {
  if (!table_.Build(mesh) || table_.num_triangles() == 0) return false;
  out.clear();
  PutHeader(out);
  return edgebreaker_.Put(table_, options.method, symbol_coder_, out) &&
         position_coder_.Put(mesh, table_, edgebreaker_.last_corners(), options.positions,
                             symbol_coder_, out);
}

}  // namespace liquidblend::encode
