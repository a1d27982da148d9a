#include "client/player/frame_fetcher.h"

#include <algorithm>
#include <chrono>
#include <utility>

#include "absl/cleanup/cleanup.h"
#include "absl/strings/match.h"
#include "core/base/status_macros.h"
#include "liquidblend/decode.h"

namespace liquidblend::player {
namespace {

using Clock = std::chrono::steady_clock;

double SecondsSince(Clock::time_point start) {
  return std::chrono::duration<double>(Clock::now() - start).count();
}

// Whether an older server refuses the format MESHOPT.
bool IsUnknownFormat(const absl::Status& status) {
  return absl::IsInvalidArgument(status) && absl::StrContains(status.message(), "encoding.format");
}

absl::Status Copy(const Mesh& mesh, FramePool& pool, FrameMesh& out) {
  const Attributes attributes = {!mesh.normals.empty(), !mesh.velocities.empty(),
                                 !mesh.rest.empty()};
  LB_RETURN_IF_ERROR(out.Resize(mesh.num_vertices(), mesh.num_triangles(), attributes, pool));
  const client::MeshMemory& memory = out.memory();
  std::copy(mesh.positions.begin(), mesh.positions.end(), memory.positions);
  std::copy(mesh.normals.begin(), mesh.normals.end(), memory.normals);
  std::copy(mesh.velocities.begin(), mesh.velocities.end(), memory.velocities);
  std::copy(mesh.rest.begin(), mesh.rest.end(), memory.rest);
  std::copy(mesh.triangles.begin(), mesh.triangles.end(), memory.triangles);
  return absl::OkStatus();
}

}  // namespace

absl::Status FrameFetcher::Get(const FrameRequest& request, FramePool& pool, FrameMesh& out,
                               FrameCost& cost) {
  const Clock::time_point start = Clock::now();
  LB_ASSIGN_OR_RETURN(const Frame frame, Fetch(request));
  cost.wait_s = SecondsSince(start);
  cost.num_bytes = static_cast<int64_t>(frame.data.size());
  const Clock::time_point received = Clock::now();
  LB_RETURN_IF_ERROR(Decode(frame, request.surface.level_of_detail, pool, out));
  cost.decode_s = SecondsSince(received);
  return absl::OkStatus();
}

absl::Status FrameFetcher::Decode(const Frame& frame, int level_of_detail, FramePool& pool,
                                  FrameMesh& out) {
  LB_RETURN_IF_ERROR(DecodeMesh(frame, pool, out));
  out.UpdateBounds();
  out.facts = {frame.weights,   frame.time_s,       frame.version,
               level_of_detail, frame.extrapolated, frame.clamped};
  return absl::OkStatus();
}

absl::StatusOr<Frame> FrameFetcher::Fetch(FrameRequest request) {
  if (!has_meshopt_) request.format = FrameFormat::kDraco;
  absl::StatusOr<Frame> frame = client_.GetFrame(request);
  if (request.format == FrameFormat::kDraco || !IsUnknownFormat(frame.status())) return frame;
  has_meshopt_ = false;
  request.format = FrameFormat::kDraco;
  return client_.GetFrame(request);
}

absl::Status FrameFetcher::DecodeMesh(const Frame& frame, FramePool& pool, FrameMesh& out) {
  if (client::IsDraco(frame.data)) {
    LB_ASSIGN_OR_RETURN(const Mesh mesh, liquidblend::DecodeMesh(frame.data));
    return Copy(mesh, pool, out);
  }
  std::unique_ptr<client::MeshoptDecoder> decoder = decoders_.Take();
  const absl::Cleanup give_back = [&] { decoders_.GiveBack(std::move(decoder)); };
  LB_RETURN_IF_ERROR(decoder->Open(frame.data));
  LB_RETURN_IF_ERROR(decoder->Decode());  // before memory is taken for what it claims
  LB_RETURN_IF_ERROR(
      out.Resize(decoder->num_vertices(), decoder->num_triangles(),
                 {decoder->has_normals(), decoder->has_velocities(), decoder->has_rest()}, pool));
  decoder->Write(out.memory());
  return absl::OkStatus();
}

}  // namespace liquidblend::player
