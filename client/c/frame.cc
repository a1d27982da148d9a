// Frames: asked for one by one, described, copied.
#include <algorithm>
#include <cstdint>
#include <cstring>
#include <limits>
#include <utility>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "client/c/error.h"
#include "client/c/handles.h"
#include "client/c/structs.h"
#include "client/src/status_macros.h"

namespace liquidblend::c_api {
namespace {

using player::FrameMesh;

absl::StatusOr<FrameRequest> RequestOf(const lb_frame_request& from) {
  FrameRequest request;
  request.family = TextOf(from.family);
  request.version = from.version;
  LBC_ASSIGN_OR_RETURN(request.weights, WeightsOf(from.weights, from.num_weights));
  LBC_ASSIGN_OR_RETURN(request.parameters, ParametersOf(from.parameters, from.num_parameters));
  request.extrapolate = from.extrapolate != 0;
  request.time_s = from.time_s;
  lb_surface surface;
  LBC_RETURN_IF_ERROR(ReadOrDefault(from.surface, "surface", surface));
  LBC_ASSIGN_OR_RETURN(request.surface, SurfaceOptionsOf(surface));
  request.position_bits = surface.position_bits;
  request.format = FormatOf(surface.position_bits);
  return request;
}

// An attribute's way into a layout.
struct Part {
  const float* from;
  int32_t offset;  // in the layout; negative: not wanted
  size_t count;    // floats a vertex
  float scale;
  const char* name;
};

absl::Status CheckOverlap(const Part (&parts)[4]) {
  const auto end_of = [](const Part& part) {
    return part.offset + static_cast<int64_t>(part.count * sizeof(float));
  };
  for (const Part& a : parts) {
    for (const Part& b : parts) {
      if (&a == &b || a.offset < 0 || b.offset < a.offset || b.offset >= end_of(a)) continue;
      return absl::InvalidArgumentError(
          absl::StrCat(a.name, " and ", b.name, " overlap; what is not wanted is at -1"));
    }
  }
  return absl::OkStatus();
}

absl::Status CheckVertices(const lb_layout& layout, size_t num_vertices, const Part (&parts)[4]) {
  size_t end = 0;  // of a vertex
  for (const Part& part : parts) {
    if (part.offset < 0) continue;
    if (part.from == nullptr && num_vertices > 0) {
      return absl::InvalidArgumentError(absl::StrCat("the frame has no ", part.name));
    }
    const size_t part_end = static_cast<size_t>(part.offset) + part.count * sizeof(float);
    if (part_end > layout.stride) {
      return absl::InvalidArgumentError(
          absl::StrCat(part.name, " end at byte ", part_end, " of a vertex of ", layout.stride));
    }
    end = std::max(end, part_end);
  }
  if (end == 0 || num_vertices == 0) return absl::OkStatus();
  if (layout.vertices == nullptr) return InvalidArgument("layout.vertices", "is NULL");
  const size_t num_strides = num_vertices - 1;
  const bool is_room =
      end <= layout.vertices_size &&
      (num_strides == 0 || layout.stride <= (layout.vertices_size - end) / num_strides);
  if (is_room) return absl::OkStatus();
  const double needed = static_cast<double>(num_strides) * static_cast<double>(layout.stride) +
                        static_cast<double>(end);
  return absl::OutOfRangeError(
      absl::StrFormat("the vertices need %.0f bytes, there are %d", needed, layout.vertices_size));
}

void CopyVertices(const lb_layout& layout, size_t num_vertices, const Part& part) {
  if (part.offset < 0) return;
  const float* from = part.from;
  char* to = static_cast<char*>(layout.vertices) + part.offset;
  for (size_t v = 0; v < num_vertices; ++v, from += part.count, to += layout.stride) {
    if (part.scale == 1.0F) {
      std::memcpy(to, from, part.count * sizeof(float));
      continue;
    }
    for (size_t k = 0; k < part.count; ++k) {
      const float scaled = part.scale * from[k];
      std::memcpy(to + k * sizeof(float), &scaled, sizeof(float));
    }
  }
}

absl::Status CopyIndices(const lb_layout& layout, const FrameMesh& mesh) {
  if (layout.indices == nullptr) return absl::OkStatus();
  const size_t size = layout.index_bytes == 0 ? 4 : static_cast<size_t>(layout.index_bytes);
  if (size != 2 && size != 4) return InvalidArgument("layout.index_bytes", "is neither 2 nor 4");
  if (size == 2 && mesh.num_vertices() > std::numeric_limits<uint16_t>::max() + size_t{1}) {
    return absl::OutOfRangeError(
        absl::StrCat(mesh.num_vertices(), " vertices are too many for indices of 2 bytes"));
  }
  const size_t count = 3 * mesh.num_triangles();
  if (count * size > layout.indices_size) {
    return absl::OutOfRangeError(
        absl::StrCat("the indices need ", count * size, " bytes, there are ", layout.indices_size));
  }
  const uint32_t* const from = mesh.memory().triangles;
  if (size == 4) {
    std::memcpy(layout.indices, from, count * size);
    return absl::OkStatus();
  }
  auto* to = static_cast<char*>(layout.indices);
  for (size_t i = 0; i < count; ++i) {
    const auto index = static_cast<uint16_t>(from[i]);
    std::memcpy(to + i * size, &index, size);
  }
  return absl::OkStatus();
}

absl::Status CopyFrame(const lb_frame& frame, const lb_layout& layout) {
  const FrameMesh& mesh = *frame.mesh;
  const client::MeshMemory& memory = mesh.memory();
  const Part parts[4] = {{memory.positions, layout.position_offset, 3, 1.0F, "positions"},
                         {memory.normals, layout.normal_offset, 3, 1.0F, "normals"},
                         {memory.velocities, layout.velocity_offset, 3,
                          static_cast<float>(frame.velocity_scale), "velocities"},
                         {memory.rest, layout.rest_offset, 4, 1.0F, "rest positions"}};
  LBC_RETURN_IF_ERROR(CheckOverlap(parts));
  LBC_RETURN_IF_ERROR(CheckVertices(layout, mesh.num_vertices(), parts));
  LBC_RETURN_IF_ERROR(CopyIndices(layout, mesh));
  for (const Part& part : parts) CopyVertices(layout, mesh.num_vertices(), part);
  return absl::OkStatus();
}

}  // namespace
}  // namespace liquidblend::c_api

namespace c_api = liquidblend::c_api;

extern "C" {

lb_status lb_client_get_frame(lb_client* client, const lb_frame_request* request, lb_frame** out) {
  return c_api::Give(out, [&]() -> absl::StatusOr<std::unique_ptr<lb_frame>> {
    LBC_RETURN_IF_ERROR(c_api::CheckIsThere(client, "client"));
    lb_frame_request given;
    LBC_RETURN_IF_ERROR(c_api::Read(request, "request", given));
    LBC_ASSIGN_OR_RETURN(const auto frame_request, c_api::RequestOf(given));
    const auto mesh = client->pool->Take();
    liquidblend::player::FrameCost cost;
    LBC_RETURN_IF_ERROR(client->fetcher.Get(frame_request, *client->pool, *mesh, cost));
    auto frame = std::make_unique<lb_frame>();
    frame->mesh = mesh;
    return frame;
  });
}

void lb_frame_describe(const lb_frame* frame, lb_frame_info* info) {
  if (frame == nullptr) return;
  const liquidblend::player::FrameMesh& mesh = *frame->mesh;
  lb_frame_info out = {};
  out.num_vertices = static_cast<uint32_t>(mesh.num_vertices());
  out.num_triangles = static_cast<uint32_t>(mesh.num_triangles());
  out.positions = mesh.memory().positions;
  out.normals = mesh.memory().normals;
  out.velocities = mesh.memory().velocities;
  out.rest_positions = mesh.memory().rest;
  out.triangles = mesh.memory().triangles;
  std::copy(mesh.bounds_min().begin(), mesh.bounds_min().end(), out.bounds_min);
  std::copy(mesh.bounds_max().begin(), mesh.bounds_max().end(), out.bounds_max);
  out.time_s = mesh.facts.time_s;
  out.num_weights = mesh.facts.weights.size();
  out.weights = mesh.facts.weights.data();
  out.version = mesh.facts.version;
  out.level_of_detail = mesh.facts.level_of_detail;
  out.extrapolated = mesh.facts.is_extrapolated ? 1 : 0;
  out.clamped = mesh.facts.is_clamped ? 1 : 0;
  out.velocity_scale = frame->velocity_scale;
  c_api::Write(out, info);
}

void lb_frame_retain(lb_frame* frame) {
  if (frame != nullptr) ++frame->num_owners;
}

void lb_frame_free(lb_frame* frame) {
  if (frame != nullptr && --frame->num_owners == 0) delete frame;
}

lb_status lb_frame_copy(const lb_frame* frame, const lb_layout* layout) {
  return c_api::Guarded([&]() -> absl::Status {
    LBC_RETURN_IF_ERROR(c_api::CheckIsThere(frame, "frame"));
    lb_layout given;
    LBC_RETURN_IF_ERROR(c_api::Read(layout, "layout", given));
    return c_api::CopyFrame(*frame, given);
  });
}

}  // extern "C"
