#include "server/transcode/query_message.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "google/longrunning/operations.pb.h"
#include "liquidblend/v1/liquidblend.pb.h"
#include "tests/core/store/store_testing.h"

namespace liquidblend::transcode {
namespace {

using store::Fails;
using testing::ElementsAre;

const auto kInvalid = absl::StatusCode::kInvalidArgument;

template <typename Message>
absl::StatusOr<Message> Read(const std::string& query) {
  Message message;
  server::FieldViolations violations;
  const auto fields = ParseQuery(query);
  if (!fields.ok()) return fields.status();
  for (const QueryField& field : *fields) SetField(field, message, violations);
  const absl::Status status = violations.ToStatus();
  if (!status.ok()) return status;
  return message;
}

TEST(SetField, ReadsEachKindInEitherSpelling) {
  const auto upload = Read<v1::UploadAnimationRequest>(
      "header.animationId=drop&header.options.frames_per_second=1.5e1&header.options.allowGaps=true"
      "&header.options.frameTimes=0,0.5,1e0&header.numFiles=3&header.options.format=ply"
      "&header.options.up=2");
  ASSERT_TRUE(upload.ok()) << upload.status();
  EXPECT_EQ(upload->header().animation_id(), "drop");
  EXPECT_EQ(upload->header().options().frames_per_second(), 15);
  EXPECT_TRUE(upload->header().options().allow_gaps());
  EXPECT_THAT(upload->header().options().frame_times(), ElementsAre(0, 0.5, 1));
  EXPECT_EQ(upload->header().num_files(), 3);
  EXPECT_EQ(upload->header().options().format(), v1::PLY);
  EXPECT_EQ(upload->header().options().up(), v1::UP_Y);
  const auto family = Read<v1::GetFamilyRequest>("version=-9223372036854775808");
  EXPECT_EQ(family->version(), std::numeric_limits<int64_t>::min()) << "the method says more";
  const auto wait = Read<google::longrunning::WaitOperationRequest>("timeout=1.5s");
  ASSERT_TRUE(wait.ok()) << wait.status();
  EXPECT_EQ(wait->timeout().nanos(), 500'000'000);
  EXPECT_EQ(Read<v1::Family>("createTime=2026-01-02T03:04:05Z")->create_time().seconds(),
            1767323045);
  EXPECT_EQ(Read<v1::RegistrationOptions>("seed=18446744073709551615")->seed(), ~uint64_t{0});
}

TEST(SetField, NamesEveryFieldAtFault) {
  for (const auto& [query, words] : std::vector<std::pair<std::string, std::string>>{
           {"header=1", "header: is a Header: name one of its fields, got '1'"},
           {"header.size=1", "header.size: is not a field of this query"},
           {"header..numFiles=1", "header..numFiles: is not a field"},
           {".=1", ".: is not a field"},
           {"chunk=abc", "chunk: cannot stand in a query"},
           {"header.animation_id.x=1", "header.animation_id.x: is not a field"},
           {"header.numFiles=1.5", "header.numFiles: must be a whole number, got '1.5'"},
           {"header.numFiles=2147483648", "header.numFiles: must be a whole number"},
           {"header.options.vertexScale=", "header.options.vertexScale: must be a number, got ''"},
           {"header.options.frameTimes=1,,2",
            "header.options.frameTimes: must be a number, got ''"},
           {"header.options.allowGaps=maybe", "header.options.allowGaps: must be true or false"},
           {"header.options.format=gif",
            "header.options.format: must be one of MANTAFLOW, PLY, OBJ, STL, VDB, got 'gif'"}}) {
    EXPECT_THAT(Read<v1::UploadAnimationRequest>(query), Fails(kInvalid, words)) << query;
  }
  EXPECT_THAT(Read<v1::RegisterFamilyRequest>("correspondences=1"),
              Fails(kInvalid, "correspondences: cannot stand in a query"));
  EXPECT_THAT(Read<google::longrunning::WaitOperationRequest>("timeout=soon"),
              Fails(kInvalid, "timeout: must be a duration"));
  const auto both = Read<v1::ListFamiliesRequest>("pageSize=x&page=3");
  EXPECT_THAT(both, Fails(kInvalid, "pageSize: must be a whole number"));
  EXPECT_THAT(both, Fails(kInvalid, "page: is not a field of this query"));
}

}  // namespace
}  // namespace liquidblend::transcode
