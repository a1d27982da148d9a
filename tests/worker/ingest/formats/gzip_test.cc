#include "worker/ingest/formats/gzip.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <numeric>
#include <string>
#include <vector>

#include "tests/worker/ingest/formats/encode_files.h"

namespace liquidblend::ingest {
namespace {

using testing::HasSubstr;

Bytes Counting(size_t size) {
  Bytes bytes(size);
  for (size_t i = 0; i < size; ++i) bytes[i] = static_cast<std::byte>(i * i >> 3);
  return bytes;
}

TEST(GzipReader, GivesBackTheBytesInPiecesOfAnySize) {
  const Bytes original = Counting(100000);
  const Bytes compressed = Gzip(original);
  GzipReader reader(compressed);
  Bytes read(original.size());
  for (size_t begin = 0, size = 1; begin < read.size(); begin += size, size = 2 * size + 1) {
    size = std::min(size, read.size() - begin);
    ASSERT_TRUE(reader.Read(std::span(read).subspan(begin, size)).ok());
  }
  EXPECT_EQ(read, original);
  EXPECT_EQ(reader.position(), 100000);
  EXPECT_TRUE(reader.ExpectEnd().ok());
}

TEST(GzipReader, RefusesEveryTruncation) {
  const Bytes original = Counting(300);
  const Bytes compressed = Gzip(original);
  Bytes read(original.size());
  for (size_t size = 0; size < compressed.size(); ++size) {
    GzipReader reader{std::span(compressed).first(size)};
    absl::Status status = reader.Read(read);
    if (status.ok()) status = reader.ExpectEnd();
    EXPECT_THAT(std::string(status.message()), HasSubstr("truncated")) << size;
    EXPECT_EQ(status.code(), absl::StatusCode::kDataLoss);
  }
}

TEST(GzipReader, RefusesAWrongChecksum) {
  const Bytes original = Counting(300);
  Bytes compressed = Gzip(original);
  compressed[compressed.size() - 8] ^= std::byte{1};
  GzipReader reader(compressed);
  Bytes read(original.size());
  absl::Status status = reader.Read(read);
  if (status.ok()) status = reader.ExpectEnd();
  EXPECT_THAT(std::string(status.message()), HasSubstr("incorrect data check"));
}

TEST(GzipReader, RefusesWhatFollows) {
  const Bytes original = Counting(300);
  Bytes compressed = Gzip(original);
  Bytes read(original.size());
  GzipReader longer(compressed);
  ASSERT_TRUE(longer.Read(std::span(read).first(299)).ok());
  EXPECT_THAT(std::string(longer.ExpectEnd().message()), HasSubstr("more data follows"));
  compressed.resize(compressed.size() + 5);
  GzipReader padded(compressed);
  ASSERT_TRUE(padded.Read(read).ok());
  EXPECT_EQ(padded.ExpectEnd().message(), "5 bytes follow the end of the gzip stream");
}

TEST(GzipReader, HandlesAnEmptyStream) {
  const Bytes compressed = Gzip({});
  GzipReader reader(compressed);
  EXPECT_TRUE(reader.ExpectEnd().ok());
  GzipReader early(compressed);
  std::byte one;
  EXPECT_THAT(std::string(early.Read({&one, 1}).message()), HasSubstr("too early"));
}

TEST(GzipReader, SkipsAsFarAsItReads) {
  const Bytes original = Counting(20000);
  const Bytes compressed = Gzip(original);
  GzipReader reader(compressed);
  ASSERT_TRUE(reader.Skip(12345).ok());
  std::byte one;
  ASSERT_TRUE(reader.Read({&one, 1}).ok());
  EXPECT_EQ(one, original[12345]);
  EXPECT_FALSE(reader.Skip(1 << 20).ok());
}

}  // namespace
}  // namespace liquidblend::ingest
