#include "client/cli/export/exr_image.h"

#include <gtest/gtest.h>
#include <zlib.h>

#include <cmath>
#include <cstring>
#include <limits>

#include "tests/client/temp_files.h"

namespace liquidblend::cli {
namespace {

// Half-precision bits as a number.
float FromHalf(uint16_t bits) {
  const int exponent = (bits >> 10) & 31;
  const int fraction = bits & 1023;
  const double size =
      exponent == 0 ? std::ldexp(fraction, -24) : std::ldexp(1024 + fraction, exponent - 25);
  return static_cast<float>((bits & 0x8000) != 0 ? -size : size);
}

TEST(ToHalf, IsTheNearestHalf) {
  for (const float value : {0.0f, 1.0f, -1.0f, 0.3333333f, -0.99951f, 1e-3f, 6.1e-5f, 3e-6f,
                            65504.0f, 1234.567f, 2049.0f}) {
    const uint16_t half = ToHalf(value);
    const float error = std::abs(FromHalf(half) - value);
    for (const int step : {-1, 1}) {
      const auto neighbour = static_cast<uint16_t>(half + step);
      if ((half & 0x7fff) == 0 || (neighbour & 0x7c00) == 0x7c00) continue;
      EXPECT_LE(error, std::abs(FromHalf(neighbour) - value)) << value;
    }
  }
  EXPECT_EQ(FromHalf(ToHalf(1e9f)), 65504.0f);
  EXPECT_EQ(FromHalf(ToHalf(-std::numeric_limits<float>::infinity())), -65504.0f);
  EXPECT_EQ(ToHalf(1.0f), 0x3C00);
}

template <typename T>
T At(const std::string& bytes, size_t offset) {
  T value;
  std::memcpy(&value, bytes.data() + offset, sizeof(value));
  return value;
}

// A block's bytes before they were compressed.
std::string Unpack(const std::string& packed, size_t size) {
  if (packed.size() == size) return packed;
  std::string shuffled(size, '\0');
  uLongf length = static_cast<uLongf>(size);
  EXPECT_EQ(
      uncompress(reinterpret_cast<Bytef*>(shuffled.data()), &length,
                 reinterpret_cast<const Bytef*>(packed.data()), static_cast<uLong>(packed.size())),
      Z_OK);
  for (size_t i = 1; i < size; ++i) {
    shuffled[i] = static_cast<char>(shuffled[i] + shuffled[i - 1] - 128);
  }
  std::string bytes(size, '\0');
  for (size_t i = 0; i < size; ++i) bytes[i] = shuffled[i / 2 + (i % 2) * ((size + 1) / 2)];
  return bytes;
}

// tests/e2e/web reads such files by a reader that is not ours.
TEST(ExrImage, HoldsItsRowsInBlocksOfSixteen) {
  const testing::TempDir dir;
  constexpr int kWidth = 5, kHeight = 19;
  auto image = ExrImage::Create(dir.File("a.exr"), {kWidth, kHeight, ExrFormat::Number::kFloat});
  ASSERT_TRUE(image.ok()) << image.status();
  const auto value = [](int row, int column, int channel) {
    return static_cast<float>(100 * row + 10 * column + channel);
  };
  for (int row = 0; row < kHeight; ++row) {
    std::vector<float> values;
    for (int i = 0; i < 3 * kWidth; ++i) values.push_back(value(row, i / 3, i % 3));
    ASSERT_TRUE(image->AddRow(values).ok());
  }
  ASSERT_TRUE(image->Finish().ok());
  const std::string bytes = testing::ReadBytes(dir.File("a.exr"));
  EXPECT_EQ(bytes.substr(0, 8), std::string("\x76\x2f\x31\x01\x02\x00\x00\x00", 8));
  const size_t table = bytes.find("screenWindowWidth") + 18 + 6 + 4 + 4 + 1;
  for (const int first_row : {0, 16}) {
    const auto offset = At<uint64_t>(bytes, table + static_cast<size_t>(first_row) / 2);
    EXPECT_EQ(At<int32_t>(bytes, offset), first_row);
    const auto size = static_cast<size_t>(At<int32_t>(bytes, offset + 4));
    const int num_rows = std::min(16, kHeight - first_row);
    const std::string block =
        Unpack(bytes.substr(offset + 8, size), static_cast<size_t>(num_rows) * kWidth * 3 * 4);
    for (int row = 0; row < num_rows; ++row) {
      for (int i = 0; i < 3 * kWidth; ++i) {
        const auto place = static_cast<size_t>(row * 3 * kWidth + i) * 4;
        EXPECT_EQ(At<float>(block, place), value(first_row + row, i % kWidth, 2 - i / kWidth));
      }
    }
  }
  EXPECT_EQ(dir.List().size(), 1U) << "no temporary file is left";
}

}  // namespace
}  // namespace liquidblend::cli
