#include "client/cli/files/mesh_file.h"

#include <cmath>

#include "absl/strings/str_cat.h"
#include "client/cli/files/files.h"
#include "client/src/status_macros.h"
#include "liquidblend/decode.h"

namespace liquidblend::cli {
namespace {

absl::StatusOr<Mesh> Parse(const std::string& bytes, const std::string& path,
                           std::string* passed_over) {
  const std::string extension = Extension(path);
  if (extension == "ply") return FromPly(bytes, path, passed_over);
  if (extension == "obj") return FromObj(bytes, path, passed_over);
  if (extension == "bobj.gz") return FromBobj(bytes, path);
  absl::StatusOr<Mesh> mesh = DecodeMesh(bytes);
  if (!mesh.ok()) {
    return absl::Status(mesh.status().code(), absl::StrCat(path, ": ", mesh.status().message()));
  }
  return mesh;
}

absl::Status Check(const Mesh& mesh, const std::string& path) {
  for (size_t i = 0; i < mesh.positions.size(); ++i) {
    if (!std::isfinite(mesh.positions[i])) {
      return absl::DataLossError(
          absl::StrCat(path, ": vertex ", i / 3, " has a coordinate that is not finite"));
    }
  }
  for (size_t i = 0; i < mesh.triangles.size(); ++i) {
    if (mesh.triangles[i] >= mesh.num_vertices()) {
      return absl::DataLossError(absl::StrCat(path, ": triangle ", i / 3, " refers to vertex ",
                                              mesh.triangles[i], " of ", mesh.num_vertices()));
    }
  }
  return absl::OkStatus();
}

}  // namespace

bool IsMeshFileName(const std::string& path) {
  const std::string extension = Extension(path);
  return extension == "drc" || extension == "ply" || extension == "obj" || extension == "bobj.gz";
}

bool IsWrittenMeshFileName(const std::string& path) {
  const std::string extension = Extension(path);
  return extension == "ply" || extension == "obj" || extension == "bobj.gz" || extension == "stl";
}

absl::StatusOr<Mesh> ReadMeshFile(const std::string& path, std::string* passed_over) {
  if (!IsMeshFileName(path)) {
    return absl::InvalidArgumentError(
        absl::StrCat(path, ": not a mesh file by its name; .drc, .ply, .obj, .bobj.gz are read"));
  }
  LBC_ASSIGN_OR_RETURN(const std::string bytes, ReadFile(path));
  LBC_ASSIGN_OR_RETURN(Mesh mesh, Parse(bytes, path, passed_over));
  LBC_RETURN_IF_ERROR(Check(mesh, path));
  return mesh;
}

absl::Status WriteMeshFile(const Mesh& mesh, const std::string& path) {
  const std::string extension = Extension(path);
  if (extension == "ply") return WriteFile(path, ToPly(mesh));
  if (extension == "obj") return WriteFile(path, ToObj(mesh));
  if (extension == "bobj.gz") {
    LBC_ASSIGN_OR_RETURN(const std::string bytes, ToBobj(mesh));
    return WriteFile(path, bytes);
  }
  if (extension == "stl") return WriteFile(path, ToStl(mesh));
  return absl::InvalidArgumentError(
      absl::StrCat(path, ": a mesh is written to a file that ends in ", kWrittenMeshFiles));
}

}  // namespace liquidblend::cli
