// VAT: vertex animation textures of the dynamic-remeshing kind, for players that draw with one
// shader.
#include <algorithm>
#include <array>
#include <cfloat>
#include <cstring>
#include <nlohmann/json.hpp>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "client/cli/export/exr_image.h"
#include "client/cli/export/formats.h"
#include "client/cli/export/spool.h"
#include "client/cli/export/vat_layout.h"
#include "client/cli/files/files.h"
#include "client/src/status_macros.h"
#include "liquidblend/decode.h"

namespace liquidblend::cli {
namespace {

constexpr char kJsonName[] = "vat.json";

// The textures. Those of vertices share their layout.
struct Texture {
  const char* name;
  ExrFormat::Number number;
};
enum TextureIndex { kTriangles, kPositions, kNormals, kVelocities, kNumTextures };
constexpr std::array<Texture, kNumTextures> kTextures = {
    {{"triangles", ExrFormat::Number::kFloat},
     {"positions", ExrFormat::Number::kFloat},
     {"normals", ExrFormat::Number::kHalf},
     {"velocities", ExrFormat::Number::kHalf}}};

// Whole numbers up to this are exact as float.
constexpr int64_t kMaxVertices = 1 << 24;

std::string FileOf(const Texture& texture) { return absl::StrCat("vat_", texture.name, ".exr"); }

std::vector<std::string> AllNames() {
  std::vector<std::string> names = {kJsonName};
  for (const Texture& texture : kTextures) names.push_back(FileOf(texture));
  return names;
}

class VatWriter : public FrameWriter {
 public:
  VatWriter(const WriterSettings& settings, const Family& family, const ExportFolder& folder,
            std::vector<Spool> data)
      : settings_(settings), family_(family), folder_(folder), data_(std::move(data)) {}

  absl::Status Add(const Frame& frame) override {
    LBC_ASSIGN_OR_RETURN(const Mesh mesh, DecodeMesh(frame.data));
    max_triangles_ = std::max(max_triangles_, static_cast<int64_t>(mesh.num_triangles()));
    max_vertices_ = std::max(max_vertices_, static_cast<int64_t>(mesh.num_vertices()));
    Widen(mesh);
    const std::vector<float> corners(mesh.triangles.begin(), mesh.triangles.end());
    const std::vector<float>* const values[] = {&corners, &mesh.positions, &mesh.normals,
                                                &mesh.velocities};
    for (size_t k = 0; k < kTextures.size(); ++k) {
      const auto size = static_cast<int64_t>(values[k]->size() * sizeof(float));
      spans_[k].push_back({data_[k].size(), size});
      LBC_RETURN_IF_ERROR(data_[k].Append(
          {reinterpret_cast<const char*>(values[k]->data()), static_cast<size_t>(size)}));
    }
    return Fit();
  }

  absl::StatusOr<ExportedFiles> Finish() override {
    ExportedFiles files{"", "", 0, {kJsonName}};
    for (size_t k = 0; k < kTextures.size(); ++k) {
      if (k > kPositions && data_[k].size() == 0) continue;
      LBC_RETURN_IF_ERROR(WriteTexture(k));
      files.names.push_back(FileOf(kTextures[k]));
    }
    LBC_RETURN_IF_ERROR(WriteFile(folder_.TemporaryPath(kJsonName), ToJson(files.names)));
    return files;
  }

 private:
  struct Span {
    int64_t offset = 0;
    int64_t size = 0;
  };

  void Widen(const Mesh& mesh) {
    for (size_t i = 0; i < mesh.positions.size(); ++i) {
      min_[i % 3] = std::min(min_[i % 3], mesh.positions[i]);
      max_[i % 3] = std::max(max_[i % 3], mesh.positions[i]);
    }
  }

  // Layouts for the frames so far, so that what is too much is refused early.
  absl::Status Fit() {
    const auto num_frames = static_cast<int64_t>(spans_[kTriangles].size());
    if (max_vertices_ > kMaxVertices) {
      return absl::InvalidArgumentError(
          absl::StrCat("--format vat: a frame has ", max_vertices_, " vertices; at most ",
                       kMaxVertices, " can be numbered; use a coarser level (--lod)"));
    }
    LBC_ASSIGN_OR_RETURN(triangle_layout_, FitVatLayout(num_frames, max_triangles_, "triangles",
                                                        settings_.texture_size));
    LBC_ASSIGN_OR_RETURN(vertex_layout_, FitVatLayout(num_frames, max_vertices_, "vertices",
                                                      settings_.texture_size));
    return absl::OkStatus();
  }

  const VatLayout& LayoutOf(size_t texture) const {
    return texture == kTriangles ? triangle_layout_ : vertex_layout_;
  }

  absl::Status WriteTexture(size_t k) {
    const VatLayout& layout = LayoutOf(k);
    LBC_ASSIGN_OR_RETURN(ExrImage image,
                         ExrImage::Create(folder_.TemporaryPath(FileOf(kTextures[k])),
                                          {layout.width, layout.height, kTextures[k].number}));
    const size_t row_floats = 3 * static_cast<size_t>(layout.width);
    for (const Span& span : spans_[k]) {
      LBC_ASSIGN_OR_RETURN(const std::string bytes, data_[k].Read(span.offset, span.size));
      std::vector<float> values(row_floats * static_cast<size_t>(layout.rows_per_frame), 0.0f);
      std::memcpy(values.data(), bytes.data(), bytes.size());
      for (auto row = values.begin(); row != values.end();
           row += static_cast<int64_t>(row_floats)) {
        LBC_RETURN_IF_ERROR(
            image.AddRow(std::vector<float>(row, row + static_cast<int64_t>(row_floats))));
      }
    }
    return image.Finish();
  }

  std::string ToJson(const std::vector<std::string>& names) const {
    nlohmann::ordered_json json;
    json["format"] = "liquidblend vat";
    json["format_version"] = 1;
    json["family"] = family_.name;
    json["frames_per_second"] = settings_.frames_per_second;
    json["num_frames"] = spans_[kTriangles].size();
    json["up"] = NameOf(family_.up == Up::kUnknown ? Up::kZ : family_.up);
    if (max_vertices_ > 0) json["bounds"] = {{"min", min_}, {"max", max_}};
    json["max_triangles"] = max_triangles_;
    json["max_vertices"] = max_vertices_;
    for (size_t k = 0; k < kTextures.size(); ++k) {
      if (std::count(names.begin(), names.end(), FileOf(kTextures[k])) == 0) continue;
      const VatLayout& layout = LayoutOf(k);
      json["textures"][kTextures[k].name] = {{"file", FileOf(kTextures[k])},
                                             {"width", layout.width},
                                             {"height", layout.height},
                                             {"rows_per_frame", layout.rows_per_frame}};
    }
    return json.dump(1, ' ', false, nlohmann::ordered_json::error_handler_t::replace) + "\n";
  }

  const WriterSettings& settings_;
  const Family& family_;
  const ExportFolder& folder_;
  std::vector<Spool> data_;  // floats of kTextures, a frame after the other
  std::array<std::vector<Span>, kNumTextures> spans_;  // of each frame in data_
  VatLayout triangle_layout_, vertex_layout_;
  int64_t max_triangles_ = 0;
  int64_t max_vertices_ = 0;
  std::array<float, 3> min_ = {FLT_MAX, FLT_MAX, FLT_MAX};
  std::array<float, 3> max_ = {-FLT_MAX, -FLT_MAX, -FLT_MAX};
};

}  // namespace

absl::StatusOr<std::unique_ptr<FrameWriter>> MakeVatWriter(const WriterSettings& settings,
                                                           const Family& family,
                                                           const ExportFolder& folder) {
  LBC_RETURN_IF_ERROR(folder.CheckUnused(AllNames()));
  std::vector<Spool> data;
  for (const Texture& texture : kTextures) {
    LBC_ASSIGN_OR_RETURN(Spool spool,
                         Spool::Create(folder.TemporaryPath(absl::StrCat(texture.name, ".data"))));
    data.push_back(std::move(spool));
  }
  return std::make_unique<VatWriter>(settings, family, folder, std::move(data));
}

}  // namespace liquidblend::cli
