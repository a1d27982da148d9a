// The meta.json beside exported frames, by which `import` reads them with the same times and units
// (docs/formats.md).
#pragma once

#include <cstdint>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <vector>

#include "liquidblend/up.h"

namespace liquidblend::cli {

inline constexpr char kMetaName[] = "meta.json";

// Files PREFIX0001EXTENSION, PREFIX0002EXTENSION and so on, `count` of them; or a few with names of
// their own.
struct ExportedFiles {
  std::string prefix;
  std::string extension;  // with its dot
  int64_t count = 0;
  std::vector<std::string> names = {};  // if not empty, these and no others

  std::string NameOf(int64_t number) const;  // from 1 on; four digits or more
  std::vector<std::string> Names() const;
  // Whether `name` is the name of one of them.
  bool Contain(const std::string& name) const;
};

struct ExportMeta {
  double frames_per_second = 0.0;  // > 0
  std::vector<double> times_s;     // of the frames, rising; seconds since the animation's start
  std::string family;
  int64_t version = 0;
  // Weights: one list of all frames; along a curve, a list for each frame.
  std::vector<std::vector<double>> weights;
  Up up = Up::kUnknown;  // the family's
  ExportedFiles files = {};
};

// JSON of a list of weights, or of a list for each frame.
nlohmann::ordered_json WeightsJson(const std::vector<std::vector<double>>& weights);

// JSON: fps; frame_times if the frames are not one frame apart; units: metres and metres per
// second; up if it is known; and the origin of the frames and their files, under "about". Numbers
// are read back to the same bits.
std::string ToMetaJson(const ExportMeta& meta);

// The upward direction in a meta.json; kUnknown: not given.
Up UpIn(const std::string& meta_json);

// The files of the export that has written this meta.json; none if no export has.
std::optional<ExportedFiles> ExportedFilesIn(const std::string& meta_json);

}  // namespace liquidblend::cli
