// OpenVDB: a level set for each frame, by a module that is loaded only for this.
#include <dlfcn.h>

#include <filesystem>
#include <system_error>
#include <utility>

#include "absl/strings/str_cat.h"
#include "client/cli/export/formats.h"
#include "client/cli/export/voxels.h"
#include "client/cli/files/mesh_stats.h"
#include "client/src/status_macros.h"
#include "client/vdb/write_vdb.h"
#include "liquidblend/decode.h"

namespace liquidblend::cli {
namespace {

constexpr char kModule[] = "liquidblend_vdb.so";

constexpr double kEmptyVoxelSizeM = 1.0;  // of frames before there is liquid

// The module: beside the program where it is built, in a folder of libraries where it is installed.
absl::StatusOr<vdb::WriteFunction> LoadModule() {
  namespace fs = std::filesystem;
  std::error_code error;
  const fs::path folder = fs::read_symlink("/proc/self/exe", error).parent_path();
  fs::path path = folder / kModule;
  if (!fs::exists(path, error)) path = folder / LIQUIDBLEND_MODULES / kModule;
  void* const module = dlopen(path.lexically_normal().c_str(), RTLD_NOW | RTLD_LOCAL);
  if (module == nullptr) {
    return absl::FailedPreconditionError(
        absl::StrCat("--format vdb: ", dlerror(), "; it needs OpenVDB (Debian: libopenvdb10.0)"));
  }
  void* const function = dlsym(module, vdb::kWriteFunctionName);
  if (function != nullptr) return reinterpret_cast<vdb::WriteFunction>(function);
  return absl::FailedPreconditionError(
      absl::StrCat("--format vdb: ", path.string(), " is of another version"));
}

class VdbWriter : public FrameWriter {
 public:
  VdbWriter(const WriterSettings& settings, const ExportFolder& folder, vdb::WriteFunction write)
      : folder_(folder), voxel_size_m_(settings.voxel_size_m), write_(write) {}

  absl::Status Add(const Frame& frame) override {
    LBC_ASSIGN_OR_RETURN(const Mesh mesh, DecodeMesh(frame.data));
    if (voxel_size_m_ == 0.0) voxel_size_m_ = ComputeMeshStats(mesh).mean_edge_length_m;
    const double voxel_size_m = voxel_size_m_ > 0.0 ? voxel_size_m_ : kEmptyVoxelSizeM;
    LBC_RETURN_IF_ERROR(CheckVoxels(mesh, voxel_size_m));
    const std::string path = folder_.TemporaryPath(files_.NameOf(++files_.count));
    vdb::WriteRequest request;
    request.positions = mesh.positions.data();
    request.num_vertices = mesh.num_vertices();
    request.triangles = mesh.triangles.data();
    request.num_triangles = mesh.num_triangles();
    request.velocities = mesh.velocities.empty() ? nullptr : mesh.velocities.data();
    request.voxel_size_m = voxel_size_m;
    request.path = path.c_str();
    const char* const error = write_(&request);
    if (error == nullptr) return absl::OkStatus();
    return absl::InternalError(absl::StrCat(path, ": ", error));
  }

  absl::StatusOr<ExportedFiles> Finish() override { return files_; }

 private:
  const ExportFolder& folder_;
  double voxel_size_m_;  // 0: there was no liquid yet
  const vdb::WriteFunction write_;
  ExportedFiles files_ = {"frame_", ".vdb"};
};

}  // namespace

absl::StatusOr<std::unique_ptr<FrameWriter>> MakeVdbWriter(const WriterSettings& settings,
                                                           const ExportFolder& folder) {
  LBC_ASSIGN_OR_RETURN(const vdb::WriteFunction write, LoadModule());
  return std::make_unique<VdbWriter>(settings, folder, write);
}

}  // namespace liquidblend::cli
