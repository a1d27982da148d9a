#include "client/cli/export/frame_writer.h"

#include "client/cli/export/formats.h"
#include "client/cli/files/mesh_file.h"
#include "client/src/status_macros.h"
#include "liquidblend/decode.h"

namespace liquidblend::cli {
namespace {

// A mesh file for each frame.
class MeshFilesWriter : public FrameWriter {
 public:
  MeshFilesWriter(const std::string& format, const ExportFolder& folder) : folder_(folder) {
    files_ = {"frame_", "." + format};
    if (format == "bobj") files_ = {"fluid_mesh_", ".bobj.gz"};
  }

  absl::Status Add(const Frame& frame) override {
    LBC_ASSIGN_OR_RETURN(const Mesh mesh, DecodeMesh(frame.data));
    return WriteMeshFile(mesh, folder_.TemporaryPath(files_.NameOf(++files_.count)));
  }

  absl::StatusOr<ExportedFiles> Finish() override { return files_; }

 private:
  const ExportFolder& folder_;
  ExportedFiles files_;
};

}  // namespace

absl::StatusOr<std::unique_ptr<FrameWriter>> MakeFrameWriter(const WriterSettings& settings,
                                                             const Family& family,
                                                             const ExportFolder& folder) {
  if (settings.format == "gltf") return MakeGltfWriter(settings, family, folder);
  if (settings.format == "usda") return MakeUsdaWriter(settings, family, folder);
  if (settings.format == "vat") return MakeVatWriter(settings, family, folder);
  if (settings.format == "vdb") return MakeVdbWriter(settings, folder);
  return std::make_unique<MeshFilesWriter>(settings.format, folder);
}

}  // namespace liquidblend::cli
