// Meshes -> the bytes of the file formats that ingest reads.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "core/mesh/animation.h"
#include "core/mesh/triangle_mesh.h"
#include "worker/ingest/read_animation.h"
#include "worker/ingest/read_directory.h"

namespace liquidblend::ingest {

using Bytes = std::vector<std::byte>;

Bytes ToBytes(std::string_view text);
std::span<const std::byte> AsBytes(std::string_view text);

// One gzip member.
Bytes Gzip(std::span<const std::byte> bytes);

// What lies inside of a .bobj.gz and a .uni.
Bytes RawBobj(const mesh::TriangleMesh& mesh);
Bytes RawUni(const Eigen::Matrix3Xf& velocities);

enum class PlyKind { kAscii, kLittleEndian, kBigEndian };
Bytes Ply(const mesh::TriangleMesh& mesh, PlyKind kind);

Bytes Obj(const mesh::TriangleMesh& mesh);

Bytes StlBinary(const mesh::TriangleMesh& mesh);
Bytes StlAscii(const mesh::TriangleMesh& mesh);

// The files of an animation in a format, numbered from first_number on with four digits.
std::vector<LoadedFile> Files(const mesh::Animation& animation, Format format,
                              int first_number = 1);

}  // namespace liquidblend::ingest
