// A node's values (openvdb::io::readCompressedValues): int8 code of the inactive values; up to two
// inactive values; a mask that chooses between them; then a block with the active values, or all. A
// block is plain, or int64 compressed size and zlib or Blosc data; a size of -n: n plain bytes.
#include "worker/ingest/formats/vdb_values.h"

#include <blosc.h>
#include <zlib.h>

#include <Eigen/Core>
#include <algorithm>
#include <bit>
#include <vector>

#include "absl/strings/str_cat.h"
#include "core/base/status_macros.h"

namespace liquidblend::ingest {
namespace {

// Which values inactive voxels have.
enum InactiveKind : int8_t {
  kBackground = 0,
  kMinusBackground = 1,
  kOneValue = 2,
  kMaskOfMinusAndPlusBackground = 3,
  kMaskOfOneValueAndBackground = 4,
  kMaskOfTwoValues = 5,
  kAllAreStored = 6
};

absl::Status Inflate(std::span<const std::byte> data, std::span<std::byte> out) {
  uLongf size = out.size();
  const int result = uncompress(reinterpret_cast<Bytef*>(out.data()), &size,
                                reinterpret_cast<const Bytef*>(data.data()), data.size());
  if (result == Z_OK && size == out.size()) return absl::OkStatus();
  return absl::DataLossError("a block of values is not valid zlib data of its size");
}

absl::Status Unblosc(std::span<const std::byte> data, std::span<std::byte> out) {
  size_t size = 0;
  if (blosc_cbuffer_validate(data.data(), data.size(), &size) == 0 && size == out.size()) {
    const int made =
        blosc_decompress_ctx(data.data(), out.data(), out.size(), /*numinternalthreads=*/1);
    if (made == static_cast<int>(out.size())) return absl::OkStatus();
  }
  return absl::DataLossError("a block of values is not valid Blosc data of its size");
}

absl::Status ReadBlock(ByteReader& reader, uint32_t compression, std::span<std::byte> out) {
  int64_t size = -static_cast<int64_t>(out.size());
  const bool is_compressed = (compression & (kVdbZip | kVdbBlosc)) != 0;
  if (is_compressed) LB_RETURN_IF_ERROR(reader.Read(size));
  if (size <= 0 && size != -static_cast<int64_t>(out.size())) {
    return absl::InvalidArgumentError(
        absl::StrCat("a block of values has the size ", size, ", not ", out.size()));
  }
  LB_ASSIGN_OR_RETURN(const auto data,
                      reader.Take(size > 0 ? static_cast<uint64_t>(size) : out.size()));
  if (size > 0) return (compression & kVdbBlosc) != 0 ? Unblosc(data, out) : Inflate(data, out);
  std::copy(data.begin(), data.end(), out.begin());
  return absl::OkStatus();
}

absl::Status ReadFloats(ByteReader& reader, const VdbValueFormat& format, std::span<float> out) {
  if (!format.is_half) return ReadBlock(reader, format.compression, std::as_writable_bytes(out));
  if (out.empty()) return absl::OkStatus();  // not even a size is written
  std::vector<uint16_t> bits(out.size());
  LB_RETURN_IF_ERROR(
      ReadBlock(reader, format.compression, std::as_writable_bytes(std::span(bits))));
  for (size_t i = 0; i < out.size(); ++i) {
    out[i] = Eigen::half_impl::half_to_float(Eigen::half_impl::raw_uint16_to_half(bits[i]));
  }
  return absl::OkStatus();
}

// The two values that inactive voxels may have; the first where the mask is off.
struct InactiveValues {
  float value[2][3] = {};
  std::vector<uint64_t> mask;  // empty: all off

  const float* At(size_t i) const { return value[!mask.empty() && IsOn(mask, i) ? 1 : 0]; }
};

absl::Status ReadInactive(ByteReader& reader, const VdbValueFormat& format, int8_t kind,
                          size_t num_words, InactiveValues& inactive) {
  const float sign = kind == kBackground ? 1.0f : -1.0f;
  for (int c = 0; c < format.num_components; ++c) {
    inactive.value[0][c] = sign * format.background[c];
    inactive.value[1][c] = format.background[c];
  }
  const auto read_value = [&](float* value) {
    for (int c = 0; c < format.num_components; ++c) LB_RETURN_IF_ERROR(reader.Read(value[c]));
    return absl::OkStatus();
  };
  if (kind == kOneValue || kind == kMaskOfOneValueAndBackground || kind == kMaskOfTwoValues) {
    LB_RETURN_IF_ERROR(read_value(inactive.value[0]));
  }
  if (kind == kMaskOfTwoValues) LB_RETURN_IF_ERROR(read_value(inactive.value[1]));
  if (kind < kMaskOfMinusAndPlusBackground || kind > kMaskOfTwoValues) return absl::OkStatus();
  inactive.mask.resize(num_words);
  for (uint64_t& word : inactive.mask) LB_RETURN_IF_ERROR(reader.Read(word));
  return absl::OkStatus();
}

}  // namespace

absl::Status ReadVdbValues(ByteReader& reader, const VdbValueFormat& format, VdbMask active,
                           std::span<float> values) {
  int8_t kind = kAllAreStored;
  LB_RETURN_IF_ERROR(reader.Read(kind));
  if (kind < kBackground || kind > kAllAreStored) {
    return absl::InvalidArgumentError(absl::StrCat("a node's values are of kind ", kind));
  }
  InactiveValues inactive;
  LB_RETURN_IF_ERROR(ReadInactive(reader, format, kind, active.size(), inactive));
  const bool are_all_stored = kind == kAllAreStored || (format.compression & kVdbActiveMask) == 0;
  if (are_all_stored) return ReadFloats(reader, format, values);
  size_t num_active = 0;
  for (const uint64_t word : active) num_active += static_cast<size_t>(std::popcount(word));
  const auto size = static_cast<size_t>(format.num_components);
  std::vector<float> stored(num_active * size);
  LB_RETURN_IF_ERROR(ReadFloats(reader, format, stored));
  const float* next = stored.data();
  for (size_t i = 0; i < values.size() / size; ++i) {
    const bool is_active = IsOn(active, i);
    std::copy_n(is_active ? next : inactive.At(i), size, &values[i * size]);
    if (is_active) next += size;
  }
  return absl::OkStatus();
}

}  // namespace liquidblend::ingest
