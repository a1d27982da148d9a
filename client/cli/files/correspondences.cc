#include "client/cli/files/correspondences.h"

#include <initializer_list>
#include <nlohmann/json.hpp>

#include "absl/strings/str_cat.h"
#include "client/cli/files/files.h"
#include "client/src/status_macros.h"

namespace liquidblend::cli {
namespace {

nlohmann::ordered_json EventJson(const Event& event) {
  const Vector3& at = event.position;
  return {{"position", {at.x, at.y, at.z}}, {"time_s", event.time_s}};
}

nlohmann::ordered_json CorrespondenceJson(const Correspondence& c) {
  return {{"kind", KindName(c.kind)},
          {"hard", c.hard},
          {"source", EventJson(c.source)},
          {"target", EventJson(c.target)},
          {"length_s", c.length_s}};
}

absl::Status Refuse(const std::string& where, const std::string& what) {
  return absl::InvalidArgumentError(absl::StrCat(where, ": ", what));
}

absl::Status CheckObject(const nlohmann::json& value, const std::string& where,
                         std::initializer_list<const char*> keys) {
  if (!value.is_object()) return Refuse(where, "is not an object {...}");
  for (const auto& item : value.items()) {
    bool known = false;
    for (const char* key : keys) known |= item.key() == key;
    if (!known) return Refuse(where, absl::StrCat("unknown key \"", item.key(), "\""));
  }
  return absl::OkStatus();
}

absl::StatusOr<double> Number(const nlohmann::json& value, const std::string& where) {
  if (!value.is_number()) return Refuse(where, "is not a number");
  return value.get<double>();
}

absl::StatusOr<Event> ReadEvent(const nlohmann::json& entry, const char* key,
                                const std::string& entry_name) {
  const std::string where = absl::StrCat(entry_name, ".", key);
  if (!entry.contains(key)) return Refuse(where, "is missing");
  const nlohmann::json& value = entry.at(key);
  LBC_RETURN_IF_ERROR(CheckObject(value, where, {"position", "time_s"}));
  if (!value.contains("time_s")) return Refuse(where + ".time_s", "is missing");
  const nlohmann::json position = value.value("position", nlohmann::json());
  if (!position.is_array() || position.size() != 3) {
    return Refuse(where + ".position", "is not a list [x, y, z]");
  }
  Event event;
  LBC_ASSIGN_OR_RETURN(event.position.x, Number(position[0], where + ".position[0]"));
  LBC_ASSIGN_OR_RETURN(event.position.y, Number(position[1], where + ".position[1]"));
  LBC_ASSIGN_OR_RETURN(event.position.z, Number(position[2], where + ".position[2]"));
  LBC_ASSIGN_OR_RETURN(event.time_s, Number(value.at("time_s"), where + ".time_s"));
  return event;
}

absl::StatusOr<CorrespondenceKind> ReadKind(const nlohmann::json& entry, const std::string& where) {
  const nlohmann::json kind = entry.value("kind", nlohmann::json("point"));
  if (kind == "point") return CorrespondenceKind::kPoint;
  if (kind == "trajectory") return CorrespondenceKind::kTrajectory;
  if (kind == "space") return CorrespondenceKind::kSpace;
  return Refuse(where + ".kind", absl::StrCat(kind.dump(), " is not point, trajectory or space"));
}

absl::StatusOr<Correspondence> ReadCorrespondence(const nlohmann::json& entry,
                                                  const std::string& where) {
  LBC_RETURN_IF_ERROR(CheckObject(entry, where, {"kind", "hard", "source", "target", "length_s"}));
  Correspondence result;
  LBC_ASSIGN_OR_RETURN(result.kind, ReadKind(entry, where));
  const nlohmann::json hard = entry.value("hard", nlohmann::json(false));
  if (!hard.is_boolean()) return Refuse(where + ".hard", "is not true or false");
  result.hard = hard.get<bool>();
  LBC_ASSIGN_OR_RETURN(result.source, ReadEvent(entry, "source", where));
  LBC_ASSIGN_OR_RETURN(result.target, ReadEvent(entry, "target", where));
  LBC_ASSIGN_OR_RETURN(result.length_s,
                       Number(entry.value("length_s", nlohmann::json(0.0)), where + ".length_s"));
  return result;
}

}  // namespace

const char* KindName(CorrespondenceKind kind) {
  switch (kind) {
    case CorrespondenceKind::kPoint:
      return "point";
    case CorrespondenceKind::kTrajectory:
      return "trajectory";
    case CorrespondenceKind::kSpace:
      return "space";
  }
  return "unknown";
}

absl::StatusOr<std::vector<std::vector<Correspondence>>> ReadCorrespondences(
    const std::string& path) {
  LBC_ASSIGN_OR_RETURN(const std::string text, ReadFile(path));
  const nlohmann::json file =
      nlohmann::json::parse(text, nullptr, /*allow_exceptions=*/false, /*ignore_comments=*/true);
  if (file.is_discarded()) return Refuse(path, "is not JSON");
  LBC_RETURN_IF_ERROR(CheckObject(file, path, {"correspondences"}));
  const nlohmann::json targets = file.value("correspondences", nlohmann::json());
  if (!targets.is_array()) return Refuse(path, "\"correspondences\" is not a list");
  std::vector<std::vector<Correspondence>> result;
  for (const nlohmann::json& entries : targets) {
    const std::string where = absl::StrCat(path, ": correspondences[", result.size(), "]");
    if (!entries.is_array()) return Refuse(where, "is not a list; there is one list per target");
    std::vector<Correspondence>& of_target = result.emplace_back();
    for (const nlohmann::json& entry : entries) {
      LBC_ASSIGN_OR_RETURN(
          const Correspondence correspondence,
          ReadCorrespondence(entry, absl::StrCat(where, "[", of_target.size(), "]")));
      of_target.push_back(correspondence);
    }
  }
  return result;
}

std::string FormatCorrespondences(const Family& family) {
  std::string text = "{\"correspondences\": [";
  const char* before_list = "\n";
  for (const RegistrationReport& report : family.reports) {
    absl::StrAppend(&text, before_list, "  [");
    before_list = ",\n";
    const char* before_entry = "\n";
    for (const CorrespondenceReport& entry : report.correspondences) {
      absl::StrAppend(&text, before_entry, "    ", CorrespondenceJson(entry.correspondence).dump());
      before_entry = ",\n";
    }
    absl::StrAppend(&text, "]");
  }
  return absl::StrCat(text, "]}\n");
}

}  // namespace liquidblend::cli
