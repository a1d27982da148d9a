#include "worker/ingest/meta.h"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <optional>
#include <span>
#include <string>

#include "absl/strings/ascii.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "core/base/status_macros.h"
#include "core/mesh/option_ranges.h"
#include "worker/ingest/formats/text.h"
#include "worker/ingest/frame_times.h"

namespace liquidblend::ingest {
namespace {

using nlohmann::json;

constexpr size_t kMaxMetaSize = 1 << 16;  // bytes; parsed JSON takes up to 80 times as much

// Keys that are read, and those for the record: programs that simulate leave them.
constexpr const char* kKeys[] = {"fps",          "frame_times",   "up",     "units",
                                 "voxel_size_m", "domain_size_m", "gravity"};
constexpr const char* kRecordKeys[] = {"about",
                                       "blender",
                                       "cpu_seconds_bake_total",
                                       "cpu_seconds_per_frame",
                                       "domain_centre_m",
                                       "frame_range",
                                       "grid",
                                       "measured",
                                       "mesh_upres",
                                       "mesh_voxel_size_m",
                                       "name",
                                       "params",
                                       "resolution_max",
                                       "scene",
                                       "seconds_bake_total",
                                       "seconds_between_first_and_last_frame",
                                       "seconds_per_frame",
                                       "settings",
                                       "size",
                                       "wall_inset_voxels",
                                       "wall_planes_m"};
constexpr const char* kUnitKeys[] = {"vertex_scale", "velocity_scale_to_m_per_s", "vertices"};
constexpr const char* kUnitRecordKeys[] = {"frame_1", "velocities", "velocity_scale_to_m_per_frame",
                                           "world"};
constexpr const char* kMetres[] = {"m", "metre", "metres", "meter", "meters"};
constexpr double kAlongAxis = 1e-3;  // largest share of gravity that points elsewhere

bool Contains(std::span<const char* const> keys, const std::string& key) {
  return std::any_of(keys.begin(), keys.end(), [&](const char* known) { return key == known; });
}

absl::Status CheckKeys(const json& object, const std::string& place,
                       std::span<const char* const> keys,
                       std::span<const char* const> record_keys) {
  for (const auto& [key, value] : object.items()) {
    if (Contains(keys, key) || Contains(record_keys, key)) continue;
    return absl::InvalidArgumentError(absl::StrCat(
        "key ", Quoted(place + key), " is not known; known are ", absl::StrJoin(keys, ", "),
        place.empty() ? "; notes of your own belong into \"about\"" : ""));
  }
  return absl::OkStatus();
}

// Text for messages, with invalid UTF-8 replaced. Nested values are only named, since dump()
// recurses and would use up the stack.
std::string FormatJson(const json& value) {
  if (value.is_string()) return Quoted(value.get_ref<const std::string&>());
  const bool is_nested = std::any_of(value.begin(), value.end(),
                                     [](const json& inner) { return inner.is_structured(); });
  if (is_nested) return absl::StrCat("a nested ", value.type_name());
  return Quoted(value.dump(-1, ' ', true, json::error_handler_t::replace));
}

absl::Status ReadPositive(const json& value, const std::string& name, double& number) {
  if (value.is_number()) number = value.get<double>();
  if (value.is_number() && number > 0 && std::isfinite(number)) return absl::OkStatus();
  return absl::InvalidArgumentError(
      absl::StrCat(name, " is ", FormatJson(value), ", not a number above 0"));
}

absl::Status ReadField(const json& object, const char* name, double& number) {
  const auto found = object.find(name);
  return found == object.end() ? absl::OkStatus() : ReadPositive(*found, name, number);
}

absl::Status ReadDomainSize(const json& object, double& longest_side_m) {
  const auto found = object.find("domain_size_m");
  if (found == object.end()) return absl::OkStatus();
  if (!found->is_array() || found->size() != 3) {
    return absl::InvalidArgumentError(
        absl::StrCat("domain_size_m is ", FormatJson(*found), ", not three numbers"));
  }
  for (const json& side : *found) {
    double side_m = 0.0;
    LB_RETURN_IF_ERROR(ReadPositive(side, "domain_size_m", side_m));
    longest_side_m = std::max(longest_side_m, side_m);
  }
  return absl::OkStatus();
}

absl::Status ReadFrameTimes(const json& object, std::vector<double>& times) {
  const auto found = object.find("frame_times");
  if (found == object.end()) return absl::OkStatus();
  if (!found->is_array()) {
    return absl::InvalidArgumentError(
        absl::StrCat("frame_times is ", FormatJson(*found), ", not an array of numbers"));
  }
  for (const json& time : *found) {
    if (!time.is_number()) {
      return absl::InvalidArgumentError(
          absl::StrCat("frame_times[", times.size(), "] is ", FormatJson(time), ", not a number"));
    }
    times.push_back(time.get<double>());
  }
  return CheckFrameTimes(times, "frame_times");
}

absl::Status ReadUp(const json& object, mesh::Up& up) {
  const auto found = object.find("up");
  if (found == object.end()) return absl::OkStatus();
  const std::optional<mesh::Up> read =
      found->is_string() ? mesh::UpOfName(found->get_ref<const std::string&>()) : std::nullopt;
  if (!read) {
    return absl::InvalidArgumentError(
        absl::StrCat("up is ", FormatJson(*found), ", not x, y, z, -x, -y or -z"));
  }
  up = *read;
  return absl::OkStatus();
}

// The axis that gravity points away from; kUnknown if it is none, or no three numbers.
mesh::Up UpAgainstGravity(const json& object) {
  const auto found = object.find("gravity");
  if (found == object.end() || !found->is_array() || found->size() != 3) return mesh::Up::kUnknown;
  double gravity[3] = {};
  int longest = 0;
  for (int axis = 0; axis < 3; ++axis) {
    if (!(*found)[axis].is_number()) return mesh::Up::kUnknown;
    gravity[axis] = (*found)[axis].get<double>();
    if (std::abs(gravity[axis]) > std::abs(gravity[longest])) longest = axis;
  }
  for (int axis = 0; axis < 3; ++axis) {
    const double share = gravity[longest] == 0.0 ? 1.0 : std::abs(gravity[axis] / gravity[longest]);
    if (axis != longest && share > kAlongAxis) return mesh::Up::kUnknown;
  }
  const mesh::Up first = gravity[longest] < 0.0 ? mesh::Up::kX : mesh::Up::kMinusX;
  return static_cast<mesh::Up>(static_cast<int>(first) + longest);
}

absl::Status ReadUnits(const json& object, Meta& meta) {
  const auto units = object.find("units");
  if (units == object.end()) return absl::OkStatus();
  if (!units->is_object()) {
    return absl::InvalidArgumentError(absl::StrCat(
        "units is ", FormatJson(*units),
        ", not an object such as {\"vertex_scale\": 0.01} (metres per unit of the positions)"));
  }
  LB_RETURN_IF_ERROR(CheckKeys(*units, "units.", kUnitKeys, kUnitRecordKeys));
  LB_RETURN_IF_ERROR(ReadField(*units, "vertex_scale", meta.vertex_scale));
  const auto words = units->find("vertices");
  if (words != units->end()) {
    const bool is_metres =
        words->is_string() && Contains(kMetres, absl::AsciiStrToLower(words->get<std::string>()));
    if (!is_metres) meta.unit_of_vertices = FormatJson(*words);
    if (is_metres && meta.vertex_scale == 0.0) meta.vertex_scale = 1.0;
  }
  return ReadField(*units, "velocity_scale_to_m_per_s", meta.velocity_scale);
}

}  // namespace

absl::StatusOr<Meta> ReadMeta(std::span<const std::byte> bytes) {
  if (bytes.size() > kMaxMetaSize) {
    return absl::InvalidArgumentError(
        absl::StrCat("the file has ", bytes.size(), " bytes, more than ", kMaxMetaSize));
  }
  const auto* text = reinterpret_cast<const char*>(bytes.data());
  const json object = json::parse(text, text + bytes.size(), nullptr, /*allow_exceptions=*/false);
  if (!object.is_object()) return absl::InvalidArgumentError("the file is not a JSON object");
  LB_RETURN_IF_ERROR(CheckKeys(object, "", kKeys, kRecordKeys));
  Meta meta;
  LB_RETURN_IF_ERROR(ReadField(object, "fps", meta.frames_per_second));
  if (object.contains("fps")) {
    LB_RETURN_IF_ERROR(mesh::CheckRange("fps", meta.frames_per_second, mesh::kFramesPerSecond));
  }
  LB_RETURN_IF_ERROR(ReadField(object, "voxel_size_m", meta.voxel_size_m));
  LB_RETURN_IF_ERROR(ReadDomainSize(object, meta.longest_side_m));
  LB_RETURN_IF_ERROR(ReadFrameTimes(object, meta.frame_times));
  LB_RETURN_IF_ERROR(ReadUp(object, meta.up));
  meta.up_against_gravity = UpAgainstGravity(object);
  LB_RETURN_IF_ERROR(ReadUnits(object, meta));
  return meta;
}

}  // namespace liquidblend::ingest
