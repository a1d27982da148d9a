// Layout as in "OpenEXR File Layout" of the OpenEXR project: magic, version, attributes, offsets of
// the blocks, blocks of 16 rows.
#include "client/cli/export/exr_image.h"

#include <zlib.h>

#include <algorithm>
#include <bit>
#include <cmath>

#include "absl/strings/str_cat.h"
#include "client/src/status_macros.h"

namespace liquidblend::cli {
namespace {

constexpr uint32_t kExrMagic = 20000630;
constexpr uint32_t kExrVersion = 2;  // scan lines, one part
constexpr int kRowsPerBlock = 16;    // of ZIP compression
constexpr char kZipCompression = 3;
constexpr int kPixelTypes[] = {2, 1};  // FLOAT, HALF
constexpr int kZlibLevel = 4;          // a tenth larger than level 9, several times faster

template <typename T>
std::string Raw(const T& value) {
  return {reinterpret_cast<const char*>(&value), sizeof(value)};
}

std::string ExrAttribute(const std::string& name, const std::string& type,
                         const std::string& value) {
  return absl::StrCat(name, std::string(1, '\0'), type, std::string(1, '\0'),
                      Raw(static_cast<int32_t>(value.size())), value);
}

std::string ExrHead(const ExrFormat& format) {
  std::string channels;
  for (const char* name : {"B", "G", "R"}) {
    channels += absl::StrCat(name, std::string(1, '\0'),
                             Raw(int32_t{kPixelTypes[static_cast<int>(format.number)]}),
                             std::string(4, '\0'), Raw(int32_t{1}), Raw(int32_t{1}));
  }
  const std::string window = absl::StrCat(Raw(int64_t{0}), Raw(int32_t{format.width - 1}),
                                          Raw(int32_t{format.height - 1}));
  return absl::StrCat(Raw(kExrMagic), Raw(kExrVersion),
                      ExrAttribute("channels", "chlist", channels + std::string(1, '\0')),
                      ExrAttribute("compression", "compression", std::string(1, kZipCompression)),
                      ExrAttribute("dataWindow", "box2i", window),
                      ExrAttribute("displayWindow", "box2i", window),
                      ExrAttribute("lineOrder", "lineOrder", std::string(1, '\0')),
                      ExrAttribute("pixelAspectRatio", "float", Raw(1.0f)),
                      ExrAttribute("screenWindowCenter", "v2f", Raw(int64_t{0})),
                      ExrAttribute("screenWindowWidth", "float", Raw(1.0f)), std::string(1, '\0'));
}

// Even bytes, then odd ones, each as its difference from the one before, which zlib packs better.
std::string Shuffled(const std::string& bytes) {
  std::string shuffled(bytes.size(), '\0');
  const size_t half = (bytes.size() + 1) / 2;
  for (size_t i = 0; i < bytes.size(); ++i) shuffled[i / 2 + (i % 2) * half] = bytes[i];
  for (size_t i = shuffled.size(); i-- > 1;) {
    shuffled[i] = static_cast<char>(shuffled[i] - shuffled[i - 1] + 128);
  }
  return shuffled;
}

// `bytes` themselves if they do not get smaller.
std::string Compressed(const std::string& bytes) {
  const std::string shuffled = Shuffled(bytes);
  uLongf size = compressBound(static_cast<uLong>(shuffled.size()));
  std::string packed(size, '\0');
  const int code = compress2(reinterpret_cast<Bytef*>(packed.data()), &size,
                             reinterpret_cast<const Bytef*>(shuffled.data()),
                             static_cast<uLong>(shuffled.size()), kZlibLevel);
  if (code != Z_OK || size >= bytes.size()) return bytes;
  packed.resize(size);
  return packed;
}

}  // namespace

uint16_t ToHalf(float value) {
  constexpr float kLargest = 65504.0f;
  constexpr float kSmallestNormal = 6.103515625e-5f;   // 2^-14
  constexpr float kSmallest = 5.9604644775390625e-8f;  // 2^-24
  const uint16_t sign = std::signbit(value) ? 0x8000 : 0;
  const float size = std::min(std::abs(value), kLargest);
  if (size < kSmallestNormal) {
    return static_cast<uint16_t>(sign | std::lrint(size / kSmallest));
  }
  // 13 bits of the fraction are dropped, rounded to even; the exponent's bias goes from 127 to 15.
  const uint32_t bits = std::bit_cast<uint32_t>(size);
  const uint32_t rounded = bits + 0xFFF + ((bits >> 13) & 1);
  return static_cast<uint16_t>(sign | ((rounded >> 13) - ((127 - 15) << 10)));
}

absl::StatusOr<ExrImage> ExrImage::Create(const std::string& path, const ExrFormat& format) {
  LBC_ASSIGN_OR_RETURN(Spool file, Spool::Create(path));
  LBC_ASSIGN_OR_RETURN(Spool blocks, Spool::Create(path + ".blocks"));
  return ExrImage(format, std::move(file), std::move(blocks));
}

absl::Status ExrImage::AddRow(const std::vector<float>& row) {
  for (const size_t channel : {2, 1, 0}) {
    for (size_t i = channel; i < row.size(); i += 3) {
      const bool is_half = format_.number == ExrFormat::Number::kHalf;
      block_ += is_half ? Raw(ToHalf(row[i])) : Raw(row[i]);
    }
  }
  ++num_rows_;
  return num_rows_ % kRowsPerBlock == 0 ? FinishBlock() : absl::OkStatus();
}

absl::Status ExrImage::FinishBlock() {
  if (block_.empty()) return absl::OkStatus();
  const int first_row = (num_rows_ - 1) / kRowsPerBlock * kRowsPerBlock;
  const std::string packed = Compressed(block_);
  offsets_.push_back(blocks_.size());
  block_.clear();
  return blocks_.Append(
      absl::StrCat(Raw(int32_t{first_row}), Raw(static_cast<int32_t>(packed.size())), packed));
}

absl::Status ExrImage::Finish() {
  LBC_RETURN_IF_ERROR(FinishBlock());
  std::string head = ExrHead(format_);
  const auto begin = static_cast<int64_t>(head.size() + sizeof(int64_t) * offsets_.size());
  for (const int64_t offset : offsets_) head += Raw(begin + offset);
  LBC_RETURN_IF_ERROR(file_.Append(head));
  LBC_RETURN_IF_ERROR(file_.AppendAll(blocks_));
  return file_.Close();
}

}  // namespace liquidblend::cli
