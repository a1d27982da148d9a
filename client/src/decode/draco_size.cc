#include "client/src/decode/draco_size.h"

#include <draco/compression/config/compression_shared.h>
#include <draco/compression/point_cloud/point_cloud_decoder.h>
#include <draco/core/decoder_buffer.h>
#include <draco/core/varint_decoding.h>
#include <draco/metadata/geometry_metadata.h>
#include <draco/metadata/metadata_decoder.h>

#include "absl/strings/str_cat.h"

namespace liquidblend::client {
namespace {

absl::Status DamagedDraco(const std::string& what) {
  return absl::DataLossError(absl::StrCat("damaged Draco mesh: ", what));
}

struct Counts {
  uint32_t triangles = 0;
  uint32_t points = 0;
};

// Reads the counts that the connectivity begins with, of bitstream 2.2; false if it is cut off.
bool ReadCounts(uint8_t method, draco::DecoderBuffer& buffer, Counts& counts) {
  if (method == draco::MESH_EDGEBREAKER_ENCODING) {
    uint8_t traversal = 0;
    return buffer.Decode(&traversal) && draco::DecodeVarint(&counts.points, &buffer) &&
           draco::DecodeVarint(&counts.triangles, &buffer);
  }
  return draco::DecodeVarint(&counts.triangles, &buffer) &&
         draco::DecodeVarint(&counts.points, &buffer);
}

}  // namespace

absl::Status CheckDracoSize(const std::string& draco_bytes) {
  draco::DecoderBuffer buffer;
  buffer.Init(draco_bytes.data(), draco_bytes.size());
  draco::DracoHeader header;
  const bool has_header = draco::PointCloudDecoder::DecodeHeader(&buffer, &header).ok();
  if (!has_header || header.encoder_type != draco::TRIANGULAR_MESH) {
    return absl::InvalidArgumentError(
        absl::StrCat("not a Draco mesh (", draco_bytes.size(), " bytes)"));
  }
  if (header.version_major != draco::kDracoMeshBitstreamVersionMajor ||
      header.version_minor != draco::kDracoMeshBitstreamVersionMinor) {
    return absl::InvalidArgumentError(absl::StrCat("a Draco mesh of bitstream ",
                                                   header.version_major, ".", header.version_minor,
                                                   ", not 2.2"));
  }
  buffer.set_bitstream_version(draco::kDracoMeshBitstreamVersion);
  draco::GeometryMetadata metadata;
  if ((header.flags & METADATA_FLAG_MASK) != 0 &&
      !draco::MetadataDecoder().DecodeGeometryMetadata(&buffer, &metadata)) {
    return DamagedDraco("its metadata");
  }
  Counts counts;
  if (!ReadCounts(header.encoder_method, buffer, counts)) return DamagedDraco("it is cut off");
  const uint64_t max_triangles =
      kMaxSpareDracoTriangles + kMaxDracoTrianglesPerByte * draco_bytes.size();
  if (counts.triangles > max_triangles || counts.points > 3 * max_triangles) {
    return DamagedDraco(absl::StrCat(counts.triangles, " triangles and ", counts.points,
                                     " points in ", draco_bytes.size(), " bytes, where at most ",
                                     max_triangles,
                                     " triangles are read; the encoding FASTEST has fewer a byte"));
  }
  return absl::OkStatus();
}

}  // namespace liquidblend::client
