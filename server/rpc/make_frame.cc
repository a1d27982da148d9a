#include "server/rpc/make_frame.h"

#include <string>
#include <utility>

#include "absl/strings/str_cat.h"
#include "core/base/status_macros.h"
#include "server/blend/blend.h"
#include "server/encode/draco.h"
#include "server/rpc/errors.h"
#include "server/rpc/names.h"

namespace liquidblend::rpc {
namespace {

constexpr int kMinPositionBits = 8;
constexpr int kMaxPositionBits = 20;

encode::DracoOptions DracoOptionsOf(const catalog::LoadedFamily& loaded,
                                    const v1::Encoding& encoding) {
  encode::DracoOptions options;
  if (encoding.position_bits() != 0) options.position_bits = encoding.position_bits();
  options.grid = loaded.grid;
  return options;
}

void SetVector(const Eigen::Vector3f& from, v1::Vector3* to) {
  to->set_x(from.x());
  to->set_y(from.y());
  to->set_z(from.z());
}

v1::Frame Reply(const mesh::RegisteredFamily& family, const FrameQuery& query,
                const mesh::TriangleMesh& surface, std::string data) {
  v1::Frame frame;
  frame.set_data(std::move(data));
  frame.set_family(FamilyName(family.name));
  frame.set_version(family.version);
  frame.mutable_weights()->Add(query.weights.begin(), query.weights.end());
  frame.set_time_s(query.time_s);
  frame.set_num_vertices(surface.num_vertices());
  frame.set_num_triangles(surface.num_triangles());
  if (surface.num_vertices() > 0) {
    SetVector(surface.vertices.rowwise().minCoeff(), frame.mutable_bounds()->mutable_min());
    SetVector(surface.vertices.rowwise().maxCoeff(), frame.mutable_bounds()->mutable_max());
  }
  return frame;
}

}  // namespace

absl::Status CheckQuery(const mesh::RegisteredFamily& family, const FrameQuery& query) {
  LB_RETURN_IF_ERROR(AtField("weights", blend::CheckWeights(family, query.weights)));
  const v1::Encoding& encoding = query.encoding;
  FieldViolations violations;
  violations.AddIf(encoding.format() != v1::Encoding::FORMAT_UNSPECIFIED &&
                       encoding.format() != v1::Encoding::DRACO,
                   "encoding.format", absl::StrCat("unknown format ", encoding.format()));
  violations.AddIf(encoding.position_bits() != 0 && (encoding.position_bits() < kMinPositionBits ||
                                                     encoding.position_bits() > kMaxPositionBits),
                   "encoding.position_bits",
                   absl::StrCat("must be 0 or in [", kMinPositionBits, ", ", kMaxPositionBits,
                                "], got ", encoding.position_bits()));
  return violations.ToStatus();
}

absl::StatusOr<v1::Frame> MakeFrame(const catalog::LoadedFamily& loaded, const FrameQuery& query,
                                    FrameBuffers& buffers) {
  const mesh::RegisteredFamily& family = loaded.family;
  slice::Workspace& workspace = buffers.workspace;
  LB_RETURN_IF_ERROR(CheckQuery(family, query));
  LB_RETURN_IF_ERROR(AtField(
      "time_s", slice::FindCandidates(loaded.index, query.weights, query.time_s, workspace)));
  blend::BlendVertices(family, query.weights, workspace.vertex_ranges, buffers.positions);
  const mesh::TriangleMesh surface = slice::March(loaded.index, buffers.positions, workspace);
  LB_ASSIGN_OR_RETURN(std::string data,
                      encode::EncodeDraco(surface, DracoOptionsOf(loaded, query.encoding)));
  return Reply(family, query, surface, std::move(data));
}

}  // namespace liquidblend::rpc
