// JSON of a glTF file: a mesh for each frame, and an animation that shows one at a time.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "liquidblend/up.h"

namespace liquidblend::cli {

// Bytes of the binary chunk.
struct GltfSpan {
  int64_t offset = 0;  // a multiple of 4
  int64_t size = 0;
};

// Where a frame's data is: its arrays, or one Draco mesh.
struct GltfMesh {
  size_t num_vertices = 0;
  size_t num_indices = 0;
  bool has_short_indices = false;           // uint16, else uint32
  std::array<float, 3> min = {}, max = {};  // of positions
  struct Attribute {
    std::string name;                // "POSITION"
    std::optional<GltfSpan> values;  // floats
    int draco_id = -1;
    const char* type = "VEC3";  // how many a vertex
  };
  std::vector<Attribute> attributes;
  std::optional<GltfSpan> indices;
  std::optional<GltfSpan> draco;
};

// Used in this order: AddFrame() for each frame, AnimationBytes(), ToJson().
class GltfDocument {
 public:
  // A frame without a mesh has no liquid.
  void AddFrame(const std::optional<GltfMesh>& mesh);

  // Keys of the animation, for the binary chunk.
  //   times_s  of the frames, and the end of the last one
  std::string AnimationBytes(const std::vector<double>& times_s) const;

  struct Facts {
    std::string name;
    Up up = Up::kUnknown;
    GltfSpan animation;     // where AnimationBytes() are
    int64_t num_bytes = 0;  // of the binary chunk
  };
  std::string ToJson(const Facts& facts, const std::vector<double>& times_s);

 private:
  using Json = nlohmann::ordered_json;

  size_t AddView(const GltfSpan& span, int target);
  size_t AddAccessor(Json accessor);
  size_t AddMesh(const GltfMesh& mesh);
  void AddNodes(const Facts& facts);
  Json Animation(const GltfSpan& span, const std::vector<double>& times_s);

  Json views_ = Json::array();
  Json accessors_ = Json::array();
  Json meshes_ = Json::array();
  Json nodes_ = Json::array();
  std::vector<std::optional<size_t>> meshes_of_frames_;
  bool uses_draco_ = false;
};

}  // namespace liquidblend::cli
