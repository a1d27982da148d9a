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
                          std::string& out, parallel::Helpers* helpers) {
  bool is_closed = false;
  const auto prepare = [&](int part) {
    if (part == 0) {
      is_closed = table_.Build(mesh, helpers);
    } else {
      position_coder_.Round(mesh, options.positions);
    }
  };
  if (helpers != nullptr && helpers->num_idle() > 0) {
    helpers->Run(2, prepare);
  } else {
    for (const int part : {0, 1}) prepare(part);
  }
  if (!is_closed || table_.num_triangles() == 0) return false;
  out.clear();
  PutHeader(out);
  return edgebreaker_.Put(table_, options.method, symbol_coder_, out) &&
         position_coder_.Put(table_, edgebreaker_.last_corners(), options.positions, symbol_coder_,
                             out);
}

}  // namespace liquidblend::encode
