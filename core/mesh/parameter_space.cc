#include "core/mesh/parameter_space.h"

#include <algorithm>
#include <cmath>

#include "absl/strings/ascii.h"
#include "absl/strings/str_cat.h"
#include "core/base/status_macros.h"

namespace liquidblend::mesh {
namespace {

constexpr size_t kMaxNameLength = 63;

bool IsGoodName(const std::string& name) {
  return !name.empty() && name.size() <= kMaxNameLength && absl::ascii_islower(name[0]) &&
         std::all_of(name.begin(), name.end(), [](unsigned char c) {
           return absl::ascii_islower(c) || absl::ascii_isdigit(c) || c == '_';
         });
}

absl::Status CheckNames(const std::vector<std::string>& names) {
  if (names.empty() || names.size() > kMaxParameters) {
    return absl::InvalidArgumentError(
        absl::StrCat("there must be 1 to ", kMaxParameters, " names, got ", names.size()));
  }
  for (auto name = names.begin(); name != names.end(); ++name) {
    if (!IsGoodName(*name)) {
      return absl::InvalidArgumentError(absl::StrCat("the name '", name->substr(0, kMaxNameLength),
                                                     "' does not match [a-z][a-z0-9_]{0,62}"));
    }
    if (std::find(names.begin(), name, *name) != name) {
      return absl::InvalidArgumentError(absl::StrCat("the name '", *name, "' is given twice"));
    }
  }
  return absl::OkStatus();
}

absl::Status CheckInterpolation(Interpolation interpolation) {
  if (interpolation == Interpolation::kLinear || interpolation == Interpolation::kSmooth) {
    return absl::OkStatus();
  }
  return absl::InvalidArgumentError(absl::StrCat("interpolation ", static_cast<int>(interpolation),
                                                 " is neither linear nor smooth"));
}

}  // namespace

absl::Status Validate(const ParameterSpace& space, int num_animations) {
  LB_RETURN_IF_ERROR(CheckInterpolation(space.interpolation));
  if (space.empty()) return absl::OkStatus();
  LB_RETURN_IF_ERROR(CheckNames(space.names));
  if (space.points.size() != static_cast<size_t>(num_animations)) {
    return absl::InvalidArgumentError(absl::StrCat(space.points.size(), " points for ",
                                                   num_animations,
                                                   " animations; each of them needs one"));
  }
  for (size_t k = 0; k < space.points.size(); ++k) {
    const std::vector<double>& values = space.points[k];
    if (values.size() != space.names.size()) {
      return absl::InvalidArgumentError(absl::StrCat("points[", k, "] has ", values.size(),
                                                     " values for ", space.names.size(), " names"));
    }
    for (size_t i = 0; i < values.size(); ++i) {
      if (std::isfinite(values[i])) continue;
      return absl::InvalidArgumentError(
          absl::StrCat("points[", k, "]: ", space.names[i], " is ", values[i], ", not finite"));
    }
  }
  return absl::OkStatus();
}

}  // namespace liquidblend::mesh
