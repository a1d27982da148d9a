#include "client/cli/files/export_meta.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <nlohmann/json.hpp>

#include "absl/strings/numbers.h"
#include "absl/strings/str_format.h"
#include "absl/strings/string_view.h"
#include "absl/strings/strip.h"

namespace liquidblend::cli {
namespace {

// The server's clock multiplies and divides by the rate; a time this close to a whole number of
// frames is one.
constexpr double kTolerance = 1e-6;  // frames

// Frames since the first; empty: 0, 1, 2, ...
std::vector<double> FrameTimes(const ExportMeta& meta) {
  std::vector<double> times;
  bool is_regular = true;
  for (const double time_s : meta.times_s) {
    const double time = (time_s - meta.times_s.front()) * meta.frames_per_second;
    const bool is_whole = std::abs(time - std::round(time)) <= kTolerance;
    times.push_back(is_whole ? std::round(time) : time);
    is_regular = is_regular && times.back() == static_cast<double>(times.size() - 1);
  }
  return is_regular ? std::vector<double>() : times;
}

nlohmann::ordered_json FilesJson(const ExportedFiles& files) {
  if (!files.names.empty()) return {{"names", files.names}};
  return {{"prefix", files.prefix}, {"extension", files.extension}, {"count", files.count}};
}

// Strings of a JSON array; others are left out.
std::vector<std::string> StringsOf(const nlohmann::json& array) {
  std::vector<std::string> strings;
  for (const nlohmann::json& item : array) {
    if (item.is_string()) strings.push_back(item);
  }
  return strings;
}

}  // namespace

std::string ExportedFiles::NameOf(int64_t number) const {
  return absl::StrFormat("%s%04d%s", prefix, number, extension);
}

std::vector<std::string> ExportedFiles::Names() const {
  std::vector<std::string> all = names;
  for (int64_t number = 1; names.empty() && number <= count; ++number) {
    all.push_back(NameOf(number));
  }
  return all;
}

bool ExportedFiles::Contain(const std::string& name) const {
  if (!names.empty()) return std::count(names.begin(), names.end(), name) > 0;
  absl::string_view digits = name;
  int64_t number = 0;
  return absl::ConsumePrefix(&digits, prefix) && absl::ConsumeSuffix(&digits, extension) &&
         absl::SimpleAtoi(digits, &number) && number >= 1 && number <= count &&
         NameOf(number) == name;
}

nlohmann::ordered_json WeightsJson(const std::vector<std::vector<double>>& weights) {
  if (weights.size() == 1) return weights[0];
  return weights;
}

std::string ToMetaJson(const ExportMeta& meta) {
  nlohmann::ordered_json json;
  json["fps"] = meta.frames_per_second;
  const std::vector<double> times = FrameTimes(meta);
  if (!times.empty()) json["frame_times"] = times;
  json["units"] = {{"vertex_scale", 1.0}, {"velocity_scale_to_m_per_s", 1.0}};
  if (meta.up != Up::kUnknown) json["up"] = NameOf(meta.up);
  json["about"] = {{"family", meta.family},
                   {"version", meta.version},
                   {"weights", WeightsJson(meta.weights)},
                   {"files", FilesJson(meta.files)}};
  return json.dump(1, ' ', false, nlohmann::ordered_json::error_handler_t::replace) + "\n";
}

Up UpIn(const std::string& meta_json) {
  const auto json = nlohmann::json::parse(meta_json, nullptr, /*allow_exceptions=*/false);
  if (!json.is_object() || !json.contains("up") || !json["up"].is_string()) return Up::kUnknown;
  return UpOfName(json["up"].get<std::string>()).value_or(Up::kUnknown);
}

std::optional<ExportedFiles> ExportedFilesIn(const std::string& meta_json) {
  const auto json = nlohmann::json::parse(meta_json, nullptr, /*allow_exceptions=*/false);
  const nlohmann::json::json_pointer place("/about/files");
  if (!json.is_object() || !json.contains(place) || !json[place].is_object()) return std::nullopt;
  const nlohmann::json& files = json[place];
  if (files.contains("names") && files["names"].is_array()) {
    return ExportedFiles{"", "", 0, StringsOf(files["names"])};
  }
  const auto is_string = [&](const char* key) {
    return files.contains(key) && files[key].is_string();
  };
  if (!is_string("prefix") || !is_string("extension") || !files.contains("count") ||
      !files["count"].is_number_integer()) {
    return std::nullopt;
  }
  return ExportedFiles{files["prefix"], files["extension"], files["count"], {}};
}

}  // namespace liquidblend::cli
