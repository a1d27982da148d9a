#include "server/frames/encoding.h"

#include <cmath>

#include "absl/strings/str_cat.h"

namespace liquidblend::server {
namespace {

using encode::kMaxPositionBits;
using encode::kMinPositionBits;

constexpr char kStepField[] = "encoding.position_step_m";

void CheckBits(int bits, FieldViolations& violations) {
  violations.AddIf(
      bits != 0 && (bits < kMinPositionBits || bits > kMaxPositionBits), "encoding.position_bits",
      absl::StrCat("must be 0 or in [", kMinPositionBits, ", ", kMaxPositionBits, "], got ", bits));
}

// The finest step for messages, rounded up, so that a request with it is accepted.
std::string FinestStep(const encode::Grid& grid) {
  return absl::StrCat(encode::StepOf(grid, kMaxPositionBits) * (1 + 1e-5));
}

void CheckStep(const encode::Grid& grid, const std::string& owner, const v1::Encoding& encoding,
               FieldViolations& violations) {
  const double step_m = encoding.position_step_m();
  if (step_m == 0) return;
  violations.AddIf(encoding.position_bits() != 0, kStepField,
                   absl::StrCat("excludes position_bits, got ", step_m, " m and ",
                                encoding.position_bits(), " bits"));
  const bool is_length = std::isfinite(step_m) && step_m > 0;
  if (is_length && encode::BitsForStep(grid, step_m).has_value()) return;
  violations.Add(kStepField, absl::StrCat("must be 0 or a length from ", FinestStep(grid),
                                          " m on, the finest step of ", owner, " (",
                                          kMaxPositionBits, " bits), got ", step_m));
}

int PositionBits(const encode::Grid& grid, const v1::Encoding& encoding) {
  if (encoding.position_bits() != 0) return encoding.position_bits();
  if (encoding.position_step_m() == 0) return kDefaultPositionBits;
  return encode::BitsForStep(grid, encoding.position_step_m()).value_or(kMaxPositionBits);
}

void CheckHasNoDracoFields(const v1::Encoding& encoding, FieldViolations& violations) {
  constexpr char kReason[] = "is for Draco; PLY and OBJ hold positions as they are";
  violations.AddIf(encoding.position_bits() != 0, "encoding.position_bits", kReason);
  violations.AddIf(encoding.position_step_m() != 0, kStepField, kReason);
  violations.AddIf(encoding.preset() != v1::Encoding::PRESET_UNSPECIFIED, "encoding.preset",
                   kReason);
}

}  // namespace

void CheckEncoding(const encode::Grid& grid, const std::string& owner, const v1::Encoding& encoding,
                   FieldViolations& violations) {
  violations.AddIf(!v1::Encoding::Format_IsValid(encoding.format()), "encoding.format",
                   absl::StrCat("unknown format ", encoding.format()));
  if (encoding.format() == v1::Encoding::PLY || encoding.format() == v1::Encoding::OBJ) {
    return CheckHasNoDracoFields(encoding, violations);
  }
  CheckBits(encoding.position_bits(), violations);
  CheckStep(grid, owner, encoding, violations);
  violations.AddIf(!v1::Encoding::Preset_IsValid(encoding.preset()), "encoding.preset",
                   absl::StrCat("unknown preset ", encoding.preset()));
}

encode::DracoOptions DracoOptionsOf(const encode::Grid& grid, const v1::Encoding& encoding) {
  encode::DracoOptions options;
  if (encoding.preset() == v1::Encoding::BALANCED) options.preset = encode::Preset::kBalanced;
  if (encoding.preset() == v1::Encoding::SMALLEST) options.preset = encode::Preset::kSmallest;
  options.position_bits = PositionBits(grid, encoding);
  options.grid = grid;
  return options;
}

const char* EncodingLabel(const v1::Encoding& encoding) {
  if (encoding.format() == v1::Encoding::PLY) return "ply";
  if (encoding.format() == v1::Encoding::OBJ) return "obj";
  const v1::Encoding::Preset preset = encoding.preset();
  if (preset == v1::Encoding::BALANCED) return "balanced";
  return preset == v1::Encoding::SMALLEST ? "smallest" : "fastest";
}

}  // namespace liquidblend::server
