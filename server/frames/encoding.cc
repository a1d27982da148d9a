#include "server/frames/encoding.h"

#include <cmath>

#include "absl/strings/str_cat.h"

namespace liquidblend::server {
namespace {

using frames::kMaxPositionBits;
using frames::kMinPositionBits;

constexpr char kStepField[] = "encoding.position_step_m";

// The most bits of a coordinate in the encoding's format.
int MaxBitsOf(const v1::Encoding& encoding) {
  return encoding.format() == v1::Encoding::MESHOPT ? frames::kMaxRoundedBits : kMaxPositionBits;
}

void CheckBits(const v1::Encoding& encoding, FieldViolations& violations) {
  const int bits = encoding.position_bits(), most = MaxBitsOf(encoding);
  violations.AddIf(
      bits != 0 && (bits < kMinPositionBits || bits > most), "encoding.position_bits",
      absl::StrCat("must be 0 or in [", kMinPositionBits, ", ", most, "], got ", bits));
}

// The finest step for messages, rounded up, so that a request with it is accepted.
std::string FinestStep(const frames::Grid& grid, int max_bits) {
  return absl::StrCat(frames::StepOf(grid, max_bits) * (1 + 1e-5));
}

void CheckStep(const frames::Grid& grid, const std::string& owner, const v1::Encoding& encoding,
               FieldViolations& violations) {
  const double step_m = encoding.position_step_m();
  if (step_m == 0) return;
  violations.AddIf(encoding.position_bits() != 0, kStepField,
                   absl::StrCat("excludes position_bits, got ", step_m, " m and ",
                                encoding.position_bits(), " bits"));
  const bool is_length = std::isfinite(step_m) && step_m > 0;
  const int most = MaxBitsOf(encoding);
  if (is_length && frames::BitsForStep(grid, step_m).value_or(most + 1) <= most) return;
  violations.Add(kStepField, absl::StrCat("must be 0 or a length from ", FinestStep(grid, most),
                                          " m on, the finest step of ", owner, " (", most,
                                          " bits), got ", step_m));
}

int PositionBits(const frames::Grid& grid, const v1::Encoding& encoding) {
  if (encoding.position_bits() != 0) return encoding.position_bits();
  if (encoding.position_step_m() == 0) return kDefaultPositionBits;
  return frames::BitsForStep(grid, encoding.position_step_m()).value_or(kMaxPositionBits);
}

void CheckHasNoDracoFields(const v1::Encoding& encoding, FieldViolations& violations) {
  constexpr char kReason[] = "is for Draco; PLY and OBJ hold positions as they are";
  violations.AddIf(encoding.position_bits() != 0, "encoding.position_bits", kReason);
  violations.AddIf(encoding.position_step_m() != 0, kStepField, kReason);
  violations.AddIf(encoding.preset() != v1::Encoding::PRESET_UNSPECIFIED, "encoding.preset",
                   kReason);
}

}  // namespace

void CheckEncoding(const frames::Grid& grid, const std::string& owner, const v1::Encoding& encoding,
                   FieldViolations& violations) {
  violations.AddIf(!v1::Encoding::Format_IsValid(encoding.format()), "encoding.format",
                   absl::StrCat("unknown format ", encoding.format()));
  if (encoding.format() == v1::Encoding::PLY || encoding.format() == v1::Encoding::OBJ) {
    return CheckHasNoDracoFields(encoding, violations);
  }
  CheckBits(encoding, violations);
  CheckStep(grid, owner, encoding, violations);
  violations.AddIf(!v1::Encoding::Preset_IsValid(encoding.preset()), "encoding.preset",
                   absl::StrCat("unknown preset ", encoding.preset()));
  violations.AddIf(encoding.format() == v1::Encoding::MESHOPT &&
                       encoding.preset() != v1::Encoding::PRESET_UNSPECIFIED,
                   "encoding.preset", "is for Draco");
}

encode::DracoOptions DracoOptionsOf(const frames::Grid& grid, const v1::Encoding& encoding) {
  encode::DracoOptions options;
  if (encoding.preset() == v1::Encoding::BALANCED) options.preset = encode::Preset::kBalanced;
  if (encoding.preset() == v1::Encoding::SMALLEST) options.preset = encode::Preset::kSmallest;
  options.position_bits = PositionBits(grid, encoding);
  options.grid = grid;
  return options;
}

frames::RoundingOptions RoundingOptionsOf(const frames::Grid& grid, double duration_s,
                                          const v1::Encoding& encoding) {
  frames::RoundingOptions options;
  options.grid = grid;
  options.position_bits = PositionBits(grid, encoding);
  options.duration_s = duration_s;
  return options;
}

const char* EncodingLabel(const v1::Encoding& encoding) {
  if (encoding.format() == v1::Encoding::PLY) return "ply";
  if (encoding.format() == v1::Encoding::OBJ) return "obj";
  if (encoding.format() == v1::Encoding::MESHOPT) return "meshopt";
  const v1::Encoding::Preset preset = encoding.preset();
  if (preset == v1::Encoding::BALANCED) return "balanced";
  return preset == v1::Encoding::SMALLEST ? "smallest" : "fastest";
}

}  // namespace liquidblend::server
