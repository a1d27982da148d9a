#include "client/cli/export/gltf_document.h"

#include <utility>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"

namespace liquidblend::cli {
namespace {

using Json = nlohmann::ordered_json;

// Constants of glTF.
constexpr int kUnsignedByte = 5121;
constexpr int kUnsignedShort = 5123;
constexpr int kUnsignedInt = 5125;
constexpr int kFloat = 5126;
constexpr int kArrayBuffer = 34962;
constexpr int kElementArrayBuffer = 34963;
constexpr int kNoTarget = 0;

constexpr char kDraco[] = "KHR_draco_mesh_compression";
constexpr char kPointer[] = "KHR_animation_pointer";
constexpr char kVisibility[] = "KHR_node_visibility";

// Every frame's keys are a part of this: hidden, shown, hidden; or less at the ends.
constexpr std::array<uint8_t, 5> kShown = {0, 1, 0, 1, 1};

// Keys of the animation of one frame.
struct Keys {
  std::vector<float> times_s;
  size_t first = 0;  // their values begin here in kShown
};

//   times_s  of the frames, and the end of the last one
Keys KeysOf(size_t frame, const std::vector<double>& times_s) {
  const auto begin = static_cast<float>(times_s[frame]);
  const auto end = static_cast<float>(times_s[frame + 1]);
  const bool is_last = frame + 2 == times_s.size();
  if (frame == 0) return {{0.0f, end}, is_last ? size_t{3} : size_t{1}};
  return {{0.0f, begin, end}, is_last ? size_t{2} : size_t{0}};
}

// The rotation that turns `up` to glTF's, y: a quaternion x, y, z, w.
std::array<double, 4> UprightRotation(Up up) {
  constexpr double kHalf = 0.70710678118654752;  // of a quarter turn
  switch (up) {
    case Up::kX:
      return {0, 0, kHalf, kHalf};
    case Up::kMinusX:
      return {0, 0, -kHalf, kHalf};
    case Up::kY:
      return {0, 0, 0, 1};
    case Up::kMinusY:
      return {1, 0, 0, 0};
    case Up::kMinusZ:
      return {kHalf, 0, 0, kHalf};
    case Up::kUnknown:
    case Up::kZ:
      break;
  }
  return {-kHalf, 0, 0, kHalf};
}

Json FloatAccessor(size_t count, const char* type) {
  return {{"componentType", kFloat}, {"count", count}, {"type", type}};
}

Json Sampler(size_t input, size_t output) {
  return {{"input", input}, {"interpolation", "STEP"}, {"output", output}};
}

Json ScaleTarget(size_t node) { return {{"node", node}, {"path", "scale"}}; }

Json VisibilityTarget(size_t node) {
  const std::string pointer =
      absl::StrCat("/nodes/", node, "/extensions/", kVisibility, "/visible");
  return {{"path", "pointer"}, {"extensions", {{kPointer, {{"pointer", pointer}}}}}};
}

Json Water() {
  return {{"name", "liquid"},
          {"pbrMetallicRoughness",
           {{"baseColorFactor", {0.15, 0.4, 0.7, 1.0}},
            {"metallicFactor", 0.0},
            {"roughnessFactor", 0.2}}}};
}

}  // namespace

size_t GltfDocument::AddView(const GltfSpan& span, int target) {
  views_.push_back({{"buffer", 0}, {"byteOffset", span.offset}, {"byteLength", span.size}});
  if (target != kNoTarget) views_.back()["target"] = target;
  return views_.size() - 1;
}

size_t GltfDocument::AddAccessor(Json accessor) {
  accessors_.push_back(std::move(accessor));
  return accessors_.size() - 1;
}

size_t GltfDocument::AddMesh(const GltfMesh& mesh) {
  Json primitive = {{"attributes", Json::object()}, {"material", 0}};
  Json draco_ids = Json::object();
  for (const GltfMesh::Attribute& attribute : mesh.attributes) {
    Json accessor = FloatAccessor(mesh.num_vertices, attribute.type);
    if (attribute.values) accessor["bufferView"] = AddView(*attribute.values, kArrayBuffer);
    if (attribute.name == "POSITION") {
      accessor["min"] = mesh.min;
      accessor["max"] = mesh.max;
    }
    primitive["attributes"][attribute.name] = AddAccessor(std::move(accessor));
    draco_ids[attribute.name] = attribute.draco_id;
  }
  Json indices = {{"componentType", mesh.has_short_indices ? kUnsignedShort : kUnsignedInt},
                  {"count", mesh.num_indices},
                  {"type", "SCALAR"}};
  if (mesh.indices) indices["bufferView"] = AddView(*mesh.indices, kElementArrayBuffer);
  primitive["indices"] = AddAccessor(std::move(indices));
  if (mesh.draco) {
    uses_draco_ = true;
    primitive["extensions"][kDraco] = {{"bufferView", AddView(*mesh.draco, kNoTarget)},
                                       {"attributes", draco_ids}};
  }
  meshes_.push_back({{"primitives", Json::array({primitive})}});
  return meshes_.size() - 1;
}

void GltfDocument::AddFrame(const std::optional<GltfMesh>& mesh) {
  meshes_of_frames_.push_back(mesh ? std::optional<size_t>(AddMesh(*mesh)) : std::nullopt);
}

std::string GltfDocument::AnimationBytes(const std::vector<double>& times_s) const {
  std::vector<float> floats;
  for (const uint8_t shown : kShown) floats.insert(floats.end(), 3, static_cast<float>(shown));
  for (size_t frame = 0; frame + 1 < times_s.size(); ++frame) {
    const Keys keys = KeysOf(frame, times_s);
    floats.insert(floats.end(), keys.times_s.begin(), keys.times_s.end());
  }
  std::string bytes(reinterpret_cast<const char*>(floats.data()), floats.size() * sizeof(float));
  bytes.append(reinterpret_cast<const char*>(kShown.data()), kShown.size());
  return bytes;
}

Json GltfDocument::Animation(const GltfSpan& span, const std::vector<double>& times_s) {
  constexpr auto kNumShown = static_cast<int64_t>(kShown.size());
  constexpr int64_t kScaleBytes = 3 * sizeof(float) * kNumShown;
  const size_t scales = AddView({span.offset, kScaleBytes}, kNoTarget);
  const size_t times =
      AddView({span.offset + kScaleBytes, span.size - kScaleBytes - kNumShown}, kNoTarget);
  const size_t visible = AddView({span.offset + span.size - kNumShown, kNumShown}, kNoTarget);
  Json samplers = Json::array(), channels = Json::array();
  const auto add = [&](size_t input, size_t output, Json target) {
    samplers.push_back(Sampler(input, output));
    channels.push_back({{"sampler", samplers.size() - 1}, {"target", std::move(target)}});
  };
  size_t time_offset = 0;
  for (size_t frame = 0; frame < meshes_of_frames_.size(); ++frame) {
    const Keys keys = KeysOf(frame, times_s);
    const size_t count = keys.times_s.size();
    Json accessor = FloatAccessor(count, "SCALAR");
    accessor.update({{"bufferView", times},
                     {"byteOffset", time_offset},
                     {"min", {keys.times_s.front()}},
                     {"max", {keys.times_s.back()}}});
    const size_t input = AddAccessor(std::move(accessor));
    time_offset += count * sizeof(float);
    accessor = FloatAccessor(count, "VEC3");
    accessor.update({{"bufferView", scales}, {"byteOffset", keys.first * 3 * sizeof(float)}});
    add(input, AddAccessor(std::move(accessor)), ScaleTarget(frame + 1));
    accessor = {{"componentType", kUnsignedByte}, {"count", count}, {"type", "SCALAR"}};
    accessor.update({{"bufferView", visible}, {"byteOffset", keys.first}});
    add(input, AddAccessor(std::move(accessor)), VisibilityTarget(frame + 1));
  }
  return {{"name", "frames"}, {"channels", channels}, {"samplers", samplers}};
}

// The root, then a node for each frame; the first frame is shown without animation.
void GltfDocument::AddNodes(const Facts& facts) {
  Json children = Json::array();
  for (size_t frame = 1; frame <= meshes_of_frames_.size(); ++frame) children.push_back(frame);
  nodes_.push_back(
      {{"name", facts.name}, {"rotation", UprightRotation(facts.up)}, {"children", children}});
  for (size_t frame = 0; frame < meshes_of_frames_.size(); ++frame) {
    const bool is_shown = frame == 0;
    const double scale = is_shown ? 1.0 : 0.0;
    Json node = {{"name", absl::StrFormat("frame_%04d", frame + 1)},
                 {"scale", {scale, scale, scale}},
                 {"extensions", {{kVisibility, {{"visible", is_shown}}}}}};
    if (meshes_of_frames_[frame]) node["mesh"] = *meshes_of_frames_[frame];
    nodes_.push_back(std::move(node));
  }
}

std::string GltfDocument::ToJson(const Facts& facts, const std::vector<double>& times_s) {
  Json animation = Animation(facts.animation, times_s);
  AddNodes(facts);
  Json json;
  json["asset"] = {{"version", "2.0"}, {"generator", "liquidblend"}};
  json["extensionsUsed"] = {kPointer, kVisibility};
  if (uses_draco_) {
    json["extensionsUsed"].push_back(kDraco);
    json["extensionsRequired"] = {kDraco};
  }
  json["scene"] = 0;
  json["scenes"] = Json::array({{{"nodes", {0}}}});
  json["nodes"] = std::move(nodes_);
  if (!meshes_.empty()) {
    json["meshes"] = std::move(meshes_);
    json["materials"] = Json::array({Water()});
  }
  json["animations"] = Json::array({std::move(animation)});
  json["accessors"] = std::move(accessors_);
  json["bufferViews"] = std::move(views_);
  json["buffers"] = Json::array({{{"byteLength", facts.num_bytes}}});
  return json.dump(-1, ' ', false, Json::error_handler_t::replace);
}

}  // namespace liquidblend::cli
