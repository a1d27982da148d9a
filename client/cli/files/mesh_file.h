// Mesh files: .drc, .ply, .obj, .bobj.gz and .stl.
//
// Written: PLY binary little endian (float x, y, z; nx, ny, nz and vx, vy, vz if the mesh has
// normals and velocities; uchar-int triangle lists), OBJ with 9 digits (floats are read back to the
// same bits), BOBJ as in Mantaflow's cache (gzip of int32 nv; float32 position[nv][3]; int32 nn =
// nv; float32 normal[nn][3]; int32 nt; int32 triangle[nt][3]), binary STL (normals of triangles).
// Read: the same formats but STL, triangles only; more floats per vertex of PLY and other
// statements of OBJ are skipped; anything else is refused with a reason.
#pragma once

#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "liquidblend/mesh.h"

namespace liquidblend::cli {

// The format comes from the file's name.
// Errors: kNotFound; kInvalidArgument for an unknown or unsupported format; kDataLoss for a damaged
// file, an index out of range, or a number that is not finite; the message names file and element.
//   passed_over  set to the skipped parts of the file, for a note to the user; or empty
absl::StatusOr<Mesh> ReadMeshFile(const std::string& path, std::string* passed_over = nullptr);

// True if ReadMeshFile reads files of this name.
bool IsMeshFileName(const std::string& path);

// True if WriteMeshFile writes files of this name, and the endings that it knows.
bool IsWrittenMeshFileName(const std::string& path);
inline constexpr char kWrittenMeshFiles[] = ".ply, .obj, .bobj.gz or .stl";

// Errors: kInvalidArgument for a name that does not end in kWrittenMeshFiles; those of WriteFile.
absl::Status WriteMeshFile(const Mesh& mesh, const std::string& path);

// The formats one by one: bytes of a file. `name` is for messages.
std::string ToPly(const Mesh& mesh);
std::string ToObj(const Mesh& mesh);
absl::StatusOr<std::string> ToBobj(const Mesh& mesh);
std::string ToStl(const Mesh& mesh);
absl::StatusOr<Mesh> FromPly(const std::string& bytes, const std::string& name,
                             std::string* passed_over = nullptr);
absl::StatusOr<Mesh> FromObj(const std::string& bytes, const std::string& name,
                             std::string* passed_over = nullptr);
absl::StatusOr<Mesh> FromBobj(const std::string& bytes, const std::string& name);

}  // namespace liquidblend::cli
