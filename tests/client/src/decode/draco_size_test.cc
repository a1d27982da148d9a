#include "client/src/decode/draco_size.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>

#include "liquidblend/decode.h"
#include "tests/client/fake_server.h"

namespace liquidblend::client {
namespace {

using ::testing::HasSubstr;

std::string Varint(uint32_t value) {
  std::string bytes;
  for (; value >= 128; value >>= 7) bytes.push_back(static_cast<char>(value % 128 + 128));
  bytes.push_back(static_cast<char>(value));
  return bytes;
}

std::string Header(char version_minor, char method) {
  return std::string("DRACO\2") + version_minor + '\1' + method + std::string(2, '\0');
}

// The first bytes of an Edgebreaker mesh that claims so many triangles, and a few zeros.
std::string EdgebreakerClaim(uint32_t triangles) {
  return Header(2, 1) + '\0' + Varint(triangles / 2 + 2) + Varint(triangles) + '\0' +
         Varint(triangles - 1) + std::string(10, '\0');
}

// The same of a mesh whose triangles are listed.
std::string SequentialClaim(uint32_t triangles, uint32_t points) {
  return Header(2, 0) + Varint(triangles) + Varint(points) + std::string(10, '\0');
}

TEST(DracoSize, ClaimsThatNoFrameOfTheSizeKeepsAreRefusedBeforeTheyAreAllocated) {
  for (const std::string& bytes :
       {EdgebreakerClaim(1'000'000'000), EdgebreakerClaim(5'000'000),
        SequentialClaim(1'000'000'000, 3), SequentialClaim(1, 1'000'000'000)}) {
    const absl::Status status = DecodeMesh(bytes).status();
    EXPECT_EQ(status.code(), absl::StatusCode::kDataLoss);
    EXPECT_THAT(status.message(), HasSubstr(" points in ")) << bytes.size();
  }
}

TEST(DracoSize, FourMillionTrianglesMayBeInFewBytesAndMoreInMore) {
  EXPECT_TRUE(CheckDracoSize(EdgebreakerClaim(4'000'000)).ok());
  EXPECT_TRUE(CheckDracoSize(EdgebreakerClaim(5'000'000) + std::string(100'000, '\0')).ok());
}

TEST(DracoSize, OtherBitstreamsAreRefusedByVersion) {
  const absl::Status status = DecodeMesh(Header(1, 1) + std::string(30, '\1')).status();
  EXPECT_EQ(status.code(), absl::StatusCode::kInvalidArgument);
  EXPECT_THAT(status.message(), HasSubstr("bitstream 2.1, not 2.2"));
}

TEST(DracoSize, CountsBehindMetadataAreFound) {
  ::liquidblend::Mesh mesh = ::liquidblend::testing::MakeOctahedron(0.0, 0.0);
  mesh.velocities = mesh.positions;  // has a name, which is metadata
  const std::string bytes = ::liquidblend::testing::EncodeDraco(mesh, 14);
  ASSERT_THAT(bytes, HasSubstr("velocity"));
  EXPECT_TRUE(CheckDracoSize(bytes).ok());
  // The triangles' number is the byte before those of the attributes and symbols.
  const size_t name = bytes.find("velocity") + std::string("velocity").size();
  const size_t triangles = bytes.find(8, name);
  ASSERT_NE(triangles, std::string::npos);
  std::string claim = bytes;
  claim.replace(triangles, 1, Varint(1'000'000'000));
  EXPECT_THAT(DecodeMesh(claim).status().message(), HasSubstr("1000000000 triangles and 6 points"));
}

TEST(DracoSize, WhatIsCutOffIsDamaged) {
  for (const std::string& bytes : {Header(2, 1), Header(2, 0) + '\x80'}) {
    EXPECT_EQ(CheckDracoSize(bytes).code(), absl::StatusCode::kDataLoss);
  }
}

}  // namespace
}  // namespace liquidblend::client
