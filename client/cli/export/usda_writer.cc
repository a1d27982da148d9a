// USD, as text (usda): one mesh with time samples.
#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "client/cli/export/formats.h"
#include "client/cli/export/spool.h"
#include "client/src/status_macros.h"
#include "liquidblend/decode.h"

namespace liquidblend::cli {
namespace {

constexpr char kUsdaName[] = "animation.usda";

// A time this close to a whole number of frames is one.
constexpr double kWholeFrame = 1e-6;

// An attribute of the mesh that has a value for each frame.
struct Attribute {
  const char* declaration;
  const char* metadata;
};
enum SampleIndex {
  kExtentSamples,
  kCountSamples,
  kIndexSamples,
  kPointSamples,
  kNormalSamples,
  kVelocitySamples,
  kRestSamples,
  kNumSampled
};
constexpr std::array<Attribute, kNumSampled> kAttributes = {{
    {"float3[] extent", ""},
    {"int[] faceVertexCounts", ""},
    {"int[] faceVertexIndices", ""},
    {"point3f[] points", ""},
    {"normal3f[] normals", "interpolation = \"vertex\""},
    {"vector3f[] velocities", ""},
    {"float4[] primvars:rest", "interpolation = \"vertex\""},
}};

template <typename Number>
void AppendNumber(Number value, std::string* text) {
  std::array<char, 32> digits;
  const auto end = std::to_chars(digits.data(), digits.data() + digits.size(), value).ptr;
  text->append(digits.data(), end);
}

// "[(x, y, z), ..]", of `size` numbers each; the shortest digits that give the same floats.
std::string Tuples(const std::vector<float>& values, size_t size = 3) {
  std::string text = "[";
  for (size_t i = 0; i < values.size(); ++i) {
    text += i % size != 0 ? ", " : i == 0 ? "(" : ", (";
    AppendNumber(values[i], &text);
    if (i % size == size - 1) text += ")";
  }
  return text + "]";
}

std::string Integers(const std::vector<uint32_t>& values) {
  std::string text = "[";
  for (size_t i = 0; i < values.size(); ++i) {
    if (i > 0) text += ", ";
    AppendNumber(values[i], &text);
  }
  return text + "]";
}

std::vector<float> ExtentOf(const Mesh& mesh) {
  std::vector<float> extent(6, 0.0f);
  for (size_t i = 0; i < mesh.positions.size(); ++i) {
    float& low = extent[i % 3];
    float& high = extent[3 + i % 3];
    low = i < 3 ? mesh.positions[i] : std::min(low, mesh.positions[i]);
    high = i < 3 ? mesh.positions[i] : std::max(high, mesh.positions[i]);
  }
  return extent;
}

// USD knows y and z as up; other directions are turned to one of them.
struct UpAxis {
  const char* name;
  const char* rotation;  // degrees about x, y, z; empty: none
};

UpAxis UpAxisOf(Up up) {
  switch (up) {
    case Up::kX:
      return {"Y", "(0, 0, 90)"};
    case Up::kMinusX:
      return {"Y", "(0, 0, -90)"};
    case Up::kY:
      return {"Y", ""};
    case Up::kMinusY:
      return {"Y", "(180, 0, 0)"};
    case Up::kMinusZ:
      return {"Z", "(180, 0, 0)"};
    case Up::kUnknown:
    case Up::kZ:
      break;
  }
  return {"Z", ""};
}

class UsdaWriter : public FrameWriter {
 public:
  UsdaWriter(const WriterSettings& settings, const Family& family, const ExportFolder& folder,
             std::vector<Spool> samples)
      : settings_(settings), family_(family), folder_(folder), samples_(std::move(samples)) {}

  absl::Status Add(const Frame& frame) override {
    LBC_ASSIGN_OR_RETURN(const Mesh mesh, DecodeMesh(frame.data));
    const double time = frame.time_s * settings_.frames_per_second;
    const bool is_whole = std::abs(time - std::round(time)) <= kWholeFrame;
    last_time_ = is_whole ? std::round(time) : time;
    std::string counts = "[";
    for (size_t t = 0; t < mesh.num_triangles(); ++t) counts += t > 0 ? ", 3" : "3";
    LBC_RETURN_IF_ERROR(AddSample(kExtentSamples, Tuples(ExtentOf(mesh))));
    LBC_RETURN_IF_ERROR(AddSample(kCountSamples, counts + "]"));
    LBC_RETURN_IF_ERROR(AddSample(kIndexSamples, Integers(mesh.triangles)));
    LBC_RETURN_IF_ERROR(AddSample(kPointSamples, Tuples(mesh.positions)));
    LBC_RETURN_IF_ERROR(AddIfKnown(kNormalSamples, mesh, mesh.normals));
    LBC_RETURN_IF_ERROR(AddIfKnown(kVelocitySamples, mesh, mesh.velocities));
    return AddIfKnown(kRestSamples, mesh, mesh.rest, 4);
  }

  absl::StatusOr<ExportedFiles> Finish() override {
    LBC_ASSIGN_OR_RETURN(Spool file, Spool::Create(folder_.TemporaryPath(kUsdaName)));
    LBC_RETURN_IF_ERROR(file.Append(Head()));
    for (size_t k = 0; k < kAttributes.size(); ++k) {
      if (samples_[k].size() == 0) continue;
      LBC_RETURN_IF_ERROR(file.Append(Begin(kAttributes[k])));
      LBC_RETURN_IF_ERROR(file.AppendAll(samples_[k]));
      LBC_RETURN_IF_ERROR(file.Append("        }\n"));
    }
    LBC_RETURN_IF_ERROR(file.Append("    }\n}\n"));
    LBC_RETURN_IF_ERROR(file.Close());
    return ExportedFiles{"", "", 0, {kUsdaName}};
  }

 private:
  // A frame without vertices has no values either, where others have some.
  absl::Status AddIfKnown(size_t attribute, const Mesh& mesh, const std::vector<float>& values,
                          size_t size = 3) {
    const bool is_empty = mesh.positions.empty() && samples_[attribute].size() > 0;
    if (values.empty() && !is_empty) return absl::OkStatus();
    return AddSample(attribute, Tuples(values, size));
  }

  absl::Status AddSample(size_t attribute, const std::string& value) {
    std::string line(12, ' ');
    AppendNumber(last_time_, &line);
    return samples_[attribute].Append(absl::StrCat(line, ": ", value, ",\n"));
  }

  // Empty default values: three.js finds metadata after a name with a colon only behind a "=".
  static std::string Begin(const Attribute& attribute) {
    std::string text;
    if (*attribute.metadata != '\0') {
      text = absl::StrCat("        ", attribute.declaration, " = [] (\n            ",
                          attribute.metadata, "\n        )\n");
    }
    return absl::StrCat(text, "        ", attribute.declaration, ".timeSamples = {\n");
  }

  std::string Head() const {
    const UpAxis up = UpAxisOf(family_.up);
    std::string text = absl::StrFormat(
        "#usda 1.0\n(\n    defaultPrim = \"liquid\"\n    endTimeCode = %.17g\n"
        "    framesPerSecond = %.17g\n    metersPerUnit = 1\n    startTimeCode = 0\n"
        "    timeCodesPerSecond = %.17g\n    upAxis = \"%s\"\n)\n\ndef Xform \"liquid\"\n{\n",
        last_time_, settings_.frames_per_second, settings_.frames_per_second, up.name);
    if (*up.rotation != '\0') {
      absl::StrAppend(&text, "    float3 xformOp:rotateXYZ = ", up.rotation,
                      "\n    uniform token[] xformOpOrder = [\"xformOp:rotateXYZ\"]\n\n");
    }
    return text +
           "    def Mesh \"surface\"\n    {\n"
           "        uniform token orientation = \"rightHanded\"\n"
           "        uniform token subdivisionScheme = \"none\"\n"
           "        color3f[] primvars:displayColor = [(0.15, 0.4, 0.7)]\n";
  }

  const WriterSettings& settings_;
  const Family& family_;
  const ExportFolder& folder_;
  std::vector<Spool> samples_;  // of kAttributes
  double last_time_ = 0.0;      // of the last frame, in frames
};

}  // namespace

absl::StatusOr<std::unique_ptr<FrameWriter>> MakeUsdaWriter(const WriterSettings& settings,
                                                            const Family& family,
                                                            const ExportFolder& folder) {
  LBC_RETURN_IF_ERROR(folder.CheckUnused({kUsdaName}));
  std::vector<Spool> samples;
  for (size_t k = 0; k < kAttributes.size(); ++k) {
    LBC_ASSIGN_OR_RETURN(Spool spool,
                         Spool::Create(folder.TemporaryPath(absl::StrCat("samples_", k))));
    samples.push_back(std::move(spool));
  }
  return std::make_unique<UsdaWriter>(settings, family, folder, std::move(samples));
}

}  // namespace liquidblend::cli
