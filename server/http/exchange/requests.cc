#include "server/http/exchange/requests.h"

#include <cmath>
#include <cstdint>
#include <string_view>

#include "absl/strings/ascii.h"
#include "absl/strings/escaping.h"
#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_split.h"
#include "core/base/status_macros.h"
#include "server/base/errors.h"

namespace liquidblend::http {
namespace {

using server::FieldViolations;
using transcode::QueryField;

constexpr size_t kMaxShownField = 40;

std::string QuotedPart(const std::string& text) {
  return absl::StrCat("'", text.substr(0, kMaxShownField), "'");
}

// Reads the values of fields; each takes note of what it cannot read.
class Reader {
 public:
  explicit Reader(const QueryField& field, FieldViolations& violations)
      : field_(field), violations_(violations) {}

  double Number() { return Number(field_.value); }

  int32_t Integer() {
    int32_t value = 0;
    Check(absl::SimpleAtoi(field_.value, &value), "must be a whole number");
    return value;
  }

  int64_t Version() {
    int64_t value = 0;
    Check(absl::SimpleAtoi(field_.value, &value) && value > 0,
          "must be the number of a version, 1 or more");
    return value;
  }

  bool YesNo() {
    const bool is_yes = field_.value == "true" || field_.value == "1";
    Check(is_yes || field_.value == "false" || field_.value == "0", "must be true or false");
    return is_yes;
  }

  template <typename Add>
  void Numbers(Add add) {
    for (const auto part : absl::StrSplit(field_.value, ',')) add(Number(std::string(part)));
  }

  // NAME=VALUE[,NAME=VALUE..]
  template <typename Add>
  void NamedNumbers(Add add) {
    for (const auto part : absl::StrSplit(field_.value, ',')) {
      const std::vector<std::string> sides = absl::StrSplit(part, absl::MaxSplits('=', 1));
      if (sides.size() != 2) return Check(false, "must be NAME=VALUE[,NAME=VALUE..]");
      add(sides[0], Number(sides[1]));
    }
  }

  // One of an enum's names, in any case; `parse` is protobuf's.
  template <typename Enum>
  Enum OneOf(bool (*parse)(const std::string&, Enum*), const std::string& name, const char* names) {
    Enum value = Enum(0);
    Check(parse(absl::AsciiStrToUpper(name), &value) && value != Enum(0),
          absl::StrCat("must be ", names));
    return value;
  }
  template <typename Enum>
  Enum OneOf(bool (*parse)(const std::string&, Enum*), const char* names) {
    return OneOf(parse, field_.value, names);
  }

  void Check(bool is_good, const std::string& rule) {
    violations_.AddIf(!is_good, field_.name,
                      absl::StrCat(rule, ", got ", QuotedPart(field_.value)));
  }

 private:
  double Number(const std::string& text) {
    double value = 0;
    Check(absl::SimpleAtod(text, &value) && std::isfinite(value), "must be a finite number");
    return std::isfinite(value) ? value : 0.0;
  }

  const QueryField& field_;
  FieldViolations& violations_;
};

// Whether the name is one of the surface options'.
bool SetSurface(const std::string& name, Reader& read, v1::SurfaceOptions& surface) {
  using Surface = v1::SurfaceOptions;
  if (name == "level_of_detail") {
    surface.set_level_of_detail(read.Integer());
  } else if (name == "smoothing_passes") {
    surface.set_smoothing_passes(read.Integer());
  } else if (name == "smoothing") {
    surface.set_smoothing(
        read.OneOf<Surface::Smoothing>(Surface::Smoothing_Parse, "laplacian or taubin"));
  } else if (name == "smoothing_strength") {
    surface.set_smoothing_strength(read.Number());
  } else if (name == "temporal_smoothing") {
    surface.set_temporal_smoothing(read.Number());
  } else {
    return false;
  }
  return true;
}

bool SetEncoding(const std::string& name, Reader& read, v1::Encoding& encoding) {
  using Encoding = v1::Encoding;
  if (name == "preset") {
    encoding.set_preset(
        read.OneOf<Encoding::Preset>(Encoding::Preset_Parse, "fastest, balanced or smallest"));
  } else if (name == "position_bits") {
    encoding.set_position_bits(read.Integer());
  } else if (name == "position_step") {
    encoding.set_position_step_m(read.Number());
  } else {
    return false;
  }
  return true;
}

void SetAttributes(const QueryField& field, Reader& read, v1::SurfaceOptions& surface) {
  for (const auto part : absl::StrSplit(field.value, ',')) {
    surface.add_attributes(read.OneOf<v1::SurfaceOptions::Attribute>(
        v1::SurfaceOptions::Attribute_Parse, std::string(part),
        "normals, velocities and rest_positions, separated by commas"));
  }
}

void SetField(const QueryField& field, FieldViolations& violations, v1::GetFrameRequest& request) {
  Reader read(field, violations);
  if (field.name == "weights") {
    read.Numbers([&](double weight) { request.add_weights(weight); });
  } else if (field.name == "parameters") {
    read.NamedNumbers([&](const std::string& name, double value) {
      v1::Parameter& parameter = *request.add_parameters();
      parameter.set_name(name);
      parameter.set_value(value);
    });
  } else if (field.name == "extrapolate") {
    request.set_extrapolate(read.YesNo());
  } else if (field.name == "time") {
    request.set_time_s(read.Number());
  } else if (field.name == "version") {
    request.set_version(read.Version());
  } else if (field.name == "min_version") {
    request.set_min_version(read.Version());
  } else if (field.name == "attributes") {
    SetAttributes(field, read, *request.mutable_surface());
  } else if (!SetSurface(field.name, read, *request.mutable_surface()) &&
             !SetEncoding(field.name, read, *request.mutable_encoding())) {
    violations.Add(field.name.substr(0, kMaxShownField), "is not a field of this query");
  }
}

}  // namespace

absl::StatusOr<v1::GetFrameRequest> ToGetFrame(const std::string& family_id,
                                               const std::vector<QueryField>& fields,
                                               v1::Encoding::Format format) {
  v1::GetFrameRequest request;
  request.set_family(absl::StrCat("families/", family_id));
  // Draco is the default: without it requests are those of frame.drc.
  if (format != v1::Encoding::DRACO) request.mutable_encoding()->set_format(format);
  FieldViolations violations;
  for (const QueryField& field : fields) SetField(field, violations, request);
  const absl::Status status = violations.ToStatus();
  if (!status.ok()) return status;
  return request;
}

}  // namespace liquidblend::http
