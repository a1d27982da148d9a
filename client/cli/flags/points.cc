#include "client/cli/flags/points.h"

#include <map>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "absl/strings/str_split.h"
#include "client/cli/flags/parse.h"
#include "client/src/status_macros.h"

namespace liquidblend::cli {
namespace {

std::string Id(const std::string& name) { return name.substr(name.find('/') + 1); }

// The values in the order of the names.
absl::StatusOr<std::vector<double>> PointOf(const std::string& animation, const Parameters& values,
                                            const std::vector<std::string>& names) {
  std::vector<double> point;
  for (const std::string& name : names) {
    const auto value = values.find(name);
    if (value == values.end()) break;
    point.push_back(value->second);
  }
  if (point.size() == names.size() && values.size() == names.size()) return point;
  return absl::InvalidArgumentError(absl::StrCat("--at ", animation, ": must set exactly ",
                                                 absl::StrJoin(names, ", "),
                                                 ", as for the other animations"));
}

}  // namespace

absl::StatusOr<ParameterSpace> ParsePoints(const std::vector<std::string>& texts,
                                           const RegisterRequest& request) {
  ParameterSpace space;
  if (texts.empty()) return space;
  std::map<std::string, Parameters> points;  // by animation
  for (const std::string& text : texts) {
    const std::pair<std::string, std::string> parts = absl::StrSplit(text, absl::MaxSplits(':', 1));
    LBC_ASSIGN_OR_RETURN(const auto values, ParseAssignments("--at", parts.second));
    if (!points.try_emplace(Id(parts.first), values.begin(), values.end()).second) {
      return absl::InvalidArgumentError(absl::StrCat("--at ", parts.first, " is given twice"));
    }
    if (!space.names.empty()) continue;
    for (const auto& [name, value] : values) space.names.push_back(name);
  }
  std::vector<std::string> animations = {request.source};
  animations.insert(animations.end(), request.targets.begin(), request.targets.end());
  for (const std::string& animation : animations) {
    const auto found = points.find(Id(animation));
    if (found == points.end()) {
      return absl::InvalidArgumentError(absl::StrCat("--at is missing for '", animation,
                                                     "': give it for the source and every ",
                                                     "target, or for none"));
    }
    LBC_ASSIGN_OR_RETURN(std::vector<double> point, PointOf(animation, found->second, space.names));
    space.points.push_back(std::move(point));
    points.erase(found);
  }
  if (points.empty()) return space;
  return absl::InvalidArgumentError(absl::StrCat(
      "--at ", points.begin()->first, ": is neither --source nor a --target of this command"));
}

}  // namespace liquidblend::cli
