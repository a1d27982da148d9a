#include "server/api/upload.h"

#include <functional>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "tests/server/backends_testing.h"
#include "tests/server/extremes.h"

namespace liquidblend::server::upload_test {
namespace {

using store::Fails;
using store::Succeeds;
using testing::ElementsAre;
using testing::IsEmpty;
using testing::Pair;

v1::UploadAnimationRequest Header(const std::string& id, const std::string& request_id = "") {
  v1::UploadAnimationRequest message;
  message.mutable_header()->set_animation_id(id);
  message.mutable_header()->set_request_id(request_id);
  return message;
}

v1::UploadAnimationRequest File(const std::string& name, int64_t size_bytes) {
  v1::UploadAnimationRequest message;
  message.mutable_file()->set_name(name);
  message.mutable_file()->set_size_bytes(size_bytes);
  return message;
}

v1::UploadAnimationRequest Chunk(const std::string& bytes) {
  v1::UploadAnimationRequest message;
  message.set_chunk(bytes);
  return message;
}

v1::UploadAnimationRequest WithOptions(const std::function<void(v1::ImportOptions&)>& set) {
  v1::UploadAnimationRequest message = Header("a");
  set(*message.mutable_header()->mutable_options());
  return message;
}

class UploadTest : public RpcTest {
 protected:
  // Sends the messages up to the first error, then submits.
  absl::StatusOr<store::pb::JobRecord> Send(const std::vector<v1::UploadAnimationRequest>& all) {
    Upload upload(stores_, SmallLimits());
    for (const v1::UploadAnimationRequest& message : all) {
      if (absl::Status status = upload.Add(message); !status.ok()) return status;
    }
    return upload.Submit();
  }

  UploadTally tally_;
  const UploadStores stores_ = {*catalog_, *blobs_, tally_};

  std::string ContentOf(const store::pb::SourceFile& file) {
    const auto blob = blobs_->Open(file.blob());
    EXPECT_TRUE(blob.ok()) << blob.status();
    return store::AsString((*blob)->bytes());
  }
};

TEST_F(UploadTest, UnknownFieldsDoNotReachTheJob) {
  v1::UploadAnimationRequest header = Header("drop", "r1");
  header.mutable_header()->mutable_options()->set_frames_per_second(30);
  v1::UploadAnimationRequest file = File("f1.ply", 3);
  const std::string mark = "a mark of the test";
  for (v1::UploadAnimationRequest* message : {&header, &file}) AddUnknownFields(*message, mark);
  const auto job = Send({header, file, Chunk("abc")});
  ASSERT_THAT(job, Succeeds());
  EXPECT_EQ(job->SerializeAsString().find(mark), std::string::npos);
}

TEST_F(UploadTest, FilesArriveWholeAndInOrder) {
  v1::UploadAnimationRequest header = Header("drop", "r1");
  header.mutable_header()->mutable_options()->set_format(v1::PLY);
  header.mutable_header()->mutable_options()->set_frames_per_second(30);
  header.mutable_header()->mutable_options()->set_allow_gaps(true);
  header.mutable_header()->mutable_options()->set_up(v1::UP_Y);
  header.mutable_header()->mutable_options()->add_frame_times(0);
  header.mutable_header()->mutable_options()->set_pattern("liquid.*");
  const auto job = Send({header, File("f1.ply", 6), Chunk("abc"), Chunk("def"), File("empty", 0),
                         File("f2.ply", 2), Chunk("xy")});
  ASSERT_THAT(job, Succeeds());
  const store::pb::ImportJob& import = job->import_animation();
  EXPECT_EQ(job->state(), store::pb::JobRecord::QUEUED);
  EXPECT_EQ(job->request_id(), "r1");
  EXPECT_EQ(import.animation(), "drop");
  EXPECT_EQ(import.options().format(), store::pb::ImportOptions::PLY);
  EXPECT_EQ(import.options().frames_per_second(), 30);
  EXPECT_TRUE(import.options().allow_gaps());
  EXPECT_EQ(import.options().up(), store::pb::UP_Y);
  EXPECT_EQ(import.options().frame_times_size(), 1);
  EXPECT_EQ(import.options().pattern(), "liquid.*");
  ASSERT_EQ(import.files_size(), 3);
  EXPECT_EQ(import.files(0).name(), "f1.ply");
  EXPECT_EQ(ContentOf(import.files(0)), "abcdef");
  EXPECT_EQ(ContentOf(import.files(1)), "");
  EXPECT_EQ(ContentOf(import.files(2)), "xy");
  EXPECT_EQ(catalog_->GetAnimation("drop")->state(), store::pb::AnimationRecord::IMPORTING);
}

TEST_F(UploadTest, TheAnimationMayBeNamedWithItsCollection) {
  const auto job = Send({Header("animations/drop", "r1"), File("f1.ply", 3), Chunk("abc")});
  ASSERT_THAT(job, Succeeds());
  EXPECT_EQ(job->import_animation().animation(), "drop");
  EXPECT_THAT(Send({Header("families/drop", "r2"), File("f1.ply", 3), Chunk("abc")}),
              Fails(absl::StatusCode::kInvalidArgument, "header.animation_id"));
}

// Messages with one mistake, and the field that the refusal must blame.
struct Mistake {
  const char* what;
  std::vector<v1::UploadAnimationRequest> messages;
  std::string field;
};

class MistakenUploadTest : public UploadTest {
 protected:
  void ExpectRefusals(const std::vector<Mistake>& mistakes) {
    for (const Mistake& mistake : mistakes) {
      const absl::Status status = Send(mistake.messages).status();
      EXPECT_EQ(status.code(), absl::StatusCode::kInvalidArgument)
          << mistake.what << ": " << status;
      EXPECT_THAT(BlamedFields(status), ElementsAre(mistake.field)) << mistake.what;
    }
    ExpectNothingVisible();
  }

  void ExpectNothingVisible() {
    EXPECT_TRUE(catalog_->ListAnimations(100, "")->records.empty());
    EXPECT_TRUE(catalog_->ListJobs(100, "")->records.empty());
  }
};

TEST_F(MistakenUploadTest, HeadersAreRefusedByName) {
  const std::string long_id(64, 'a');
  const std::string long_request_id(129, 'r');
  ExpectRefusals({
      {"nothing at all", {}, "header"},
      {"no header", {File("f", 1)}, "header"},
      {"two headers", {Header("a"), Header("a")}, "header"},
      {"an empty message", {Header("a"), {}}, "payload"},
      {"no id", {Header("")}, "header.animation_id"},
      {"upper case id", {Header("Drop")}, "header.animation_id"},
      {"path as id", {Header("../a")}, "header.animation_id"},
      {"long id", {Header(long_id)}, "header.animation_id"},
      {"long request_id", {Header("a", long_request_id)}, "header.request_id"},
  });
}

TEST_F(MistakenUploadTest, OptionsAreRefusedByName) {
  const auto with = [](const std::function<void(v1::ImportOptions&)>& set) {
    return std::vector{WithOptions(set)};
  };
  const std::string long_pattern(256, '*');
  ExpectRefusals({
      {"unknown format", with([](auto& o) { o.set_format(static_cast<v1::AnimationFormat>(99)); }),
       "header.options.format"},
      {"unknown direction", with([](auto& o) { o.set_up(static_cast<v1::Up>(7)); }),
       "header.options.up"},
      {"negative frame rate", with([](auto& o) { o.set_frames_per_second(-1); }),
       "header.options.frames_per_second"},
      {"a frame rate that is too high", with([](auto& o) { o.set_frames_per_second(1e10); }),
       "header.options.frames_per_second"},
      {"a frame rate that is too low", with([](auto& o) { o.set_frames_per_second(1e-10); }),
       "header.options.frames_per_second"},
      {"a time before the first", with([](auto& o) { o.add_frame_times(-1); }),
       "header.options.frame_times"},
      {"a pattern that is longer than a name", with([&](auto& o) { o.set_pattern(long_pattern); }),
       "header.options.pattern"},
      {"scale not a number", with([](auto& o) { o.set_vertex_scale(std::nan("")); }),
       "header.options.vertex_scale"},
      {"infinite velocity scale", with([](auto& o) { o.set_velocity_scale(HUGE_VAL); }),
       "header.options.velocity_scale"},
      {"negative voxel size", with([](auto& o) { o.set_voxel_size_m(-0.1); }),
       "header.options.voxel_size_m"},
  });
}

TEST_F(MistakenUploadTest, FilesAndChunksAreRefusedByName) {
  const std::string long_name(256, 'n');
  const std::string long_chunk(101, 'x');
  const v1::UploadAnimationRequest header = Header("a");
  ExpectRefusals({
      {"no files", {header}, "file"},
      {"chunk without file", {header, Chunk("x")}, "chunk"},
      {"nameless file", {header, File("", 1)}, "file.name"},
      {"directory", {header, File("x/y", 1)}, "file.name"},
      {"parent", {header, File("..", 1)}, "file.name"},
      {"control character", {header, File("x\ny", 1)}, "file.name"},
      {"long name", {header, File(long_name, 1)}, "file.name"},
      {"negative size", {header, File("f", -1)}, "file.size_bytes"},
      {"twice the same", {header, File("f", 0), File("f", 0)}, "file.name"},
      {"file cut short", {header, File("f", 3), Chunk("ab"), File("g", 0)}, "file.size_bytes"},
      {"last file cut short", {header, File("f", 3), Chunk("ab")}, "file.size_bytes"},
      {"too much", {header, File("f", 3), Chunk("abcd")}, "chunk"},
      {"more after the end", {header, File("f", 1), Chunk("a"), Chunk("b")}, "chunk"},
      {"huge chunk", {header, File("f", 500), Chunk(long_chunk)}, "chunk"},
  });
}

TEST_F(MistakenUploadTest, MoreThanTheLimitsIsRefusedWithoutBlame) {
  constexpr int64_t kMostBytes = std::numeric_limits<int64_t>::max();
  const v1::UploadAnimationRequest header = Header("a");
  const std::map<std::string, std::vector<v1::UploadAnimationRequest>> uploads = {
      {"too many files",
       {header, File("1", 0), File("2", 0), File("3", 0), File("4", 0), File("5", 0)}},
      {"too many bytes", {header, File("1", 1), Chunk("x"), File("2", 1000)}},
      {"size that overflows", {header, File("1", kMostBytes)}},
  };
  for (const auto& [what, messages] : uploads) {
    const absl::Status status = Send(messages).status();
    EXPECT_EQ(status.code(), absl::StatusCode::kResourceExhausted) << what << ": " << status;
    EXPECT_THAT(BlamedFields(status), IsEmpty()) << what;
  }
  ExpectNothingVisible();
}

TEST_F(UploadTest, ATakenIdIsRefusedBeforeAnyFileIsSent) {
  ImportAnimation("drop");
  Upload upload(stores_, SmallLimits());
  EXPECT_THAT(upload.Add(Header("drop")), Fails(absl::StatusCode::kAlreadyExists, "drop"));
}

TEST_F(UploadTest, AFailedImportMayBeReplaced) {
  SubmitImport("drop");
  ASSERT_TRUE(catalog_->FailJob(TakeJob().lease_id, absl::InvalidArgumentError("bad"), false).ok());
  EXPECT_THAT(Send({Header("drop"), File("f", 0)}), Succeeds());
}

TEST_F(UploadTest, TheJobKnowsWhoseItIsAndHowUrgent) {
  Caller caller;
  caller.principal.name = "studio";
  v1::UploadAnimationRequest header = Header("drop");
  header.mutable_header()->set_priority(100);
  Upload upload(stores_, SmallLimits(), caller);
  ASSERT_THAT(upload.Add(header), Succeeds());
  ASSERT_THAT(upload.Add(File("f", 0)), Succeeds());
  const auto job = upload.Submit();
  ASSERT_THAT(job, Succeeds());
  EXPECT_EQ(job->owner(), "studio");
  EXPECT_EQ(job->priority(), 100);
  header.mutable_header()->set_priority(101);
  EXPECT_THAT(Upload(stores_, SmallLimits()).Add(header),
              Fails(absl::StatusCode::kInvalidArgument, "header.priority: must be in [-100, 100]"));
}

TEST_F(UploadTest, ARepeatedRequestIdGivesTheFirstJob) {
  const auto first = Send({Header("drop", "once"), File("f", 1), Chunk("x")});
  const auto second = Send({Header("drop", "once"), File("f", 1), Chunk("x")});
  ASSERT_THAT(first, Succeeds());
  ASSERT_THAT(second, Succeeds());
  EXPECT_EQ(first->id(), second->id());
  EXPECT_EQ(catalog_->ListJobs(100, "")->records.size(), 1U);
  EXPECT_EQ(blobs_->List()->size(), 1U);  // the first one's
  EXPECT_EQ(ContentOf(first->import_animation().files(0)), "x");
}

TEST_F(UploadTest, ABrokenOffUploadLeavesNoFiles) {
  {
    Upload upload(stores_, SmallLimits());
    ASSERT_TRUE(upload.Add(Header("drop")).ok());
    ASSERT_TRUE(upload.Add(File("f", 3)).ok());
    ASSERT_TRUE(upload.Add(Chunk("abc")).ok());
    ASSERT_TRUE(upload.Add(File("g", 3)).ok());
    ASSERT_TRUE(upload.Add(Chunk("abc")).ok());
    EXPECT_EQ(blobs_->List()->size(), 2U);
  }
  EXPECT_TRUE(blobs_->List()->empty());
}

TEST_F(UploadTest, ARefusedUploadLeavesNoFilesAndThoseOfOthersStay) {
  ASSERT_THAT(Send({Header("drop", "first"), File("f", 1), Chunk("x")}), Succeeds());
  EXPECT_THAT(Send({Header("drop", "second"), File("f", 1), Chunk("x")}),
              Fails(absl::StatusCode::kAlreadyExists, "drop"));
  ASSERT_EQ(blobs_->List()->size(), 1U);
  EXPECT_EQ(ContentOf(catalog_->ListJobs(1, "")->records[0].import_animation().files(0)), "x");
}

TEST_F(UploadTest, AnUploadWithoutAllOfItsFilesIsRefused) {
  v1::UploadAnimationRequest header = Header("drop");
  header.mutable_header()->set_num_files(2);
  const auto part = Send({header, File("f", 1), Chunk("x")});
  EXPECT_THAT(part, Fails(absl::StatusCode::kInvalidArgument, "1 of 2 files were sent"));
  EXPECT_THAT(BlamedFields(part.status()), ElementsAre("header.num_files"));
  EXPECT_THAT(Send({header, File("f", 1), Chunk("x"), File("g", 0)}), Succeeds());
  header.mutable_header()->set_animation_id("other");
  for (const int num_files : {-1, 5}) {
    header.mutable_header()->set_num_files(num_files);
    EXPECT_THAT(Send({header}), Fails(absl::StatusCode::kInvalidArgument, "must be in [0, 4]"));
  }
}

TEST_F(UploadTest, ADroppedUploadLeavesNoTemporaryFile) {
  {
    Upload upload(stores_, SmallLimits());
    ASSERT_TRUE(upload.Add(Header("drop")).ok());
    ASSERT_TRUE(upload.Add(File("f", 10)).ok());
    ASSERT_TRUE(upload.Add(Chunk("half")).ok());
  }
  EXPECT_EQ(store::CountFiles(folder_.path() + "/tmp"), 0);
  EXPECT_TRUE(blobs_->List()->empty());
}

// ---- what its owner may have

class OwnedUploadTest : public UploadTest {
 protected:
  OwnedUploadTest() { ann_.principal.name = ann_.principal.key = "ann"; }

  // Up to the first error, then submitted.
  absl::StatusOr<store::pb::JobRecord> SendAs(const Caller& caller,
                                              const std::vector<v1::UploadAnimationRequest>& all) {
    Upload upload(stores_, SmallLimits(), caller);
    for (const v1::UploadAnimationRequest& message : all) {
      if (absl::Status status = upload.Add(message); !status.ok()) return status;
    }
    return upload.Submit();
  }

  std::map<std::string, std::string> MetadataOf(const absl::Status& status) {
    const auto info = PayloadOf<google::rpc::ErrorInfo>(status, kErrorInfoUrl);
    return {info.metadata().begin(), info.metadata().end()};
  }

  Caller ann_;
};

TEST_F(OwnedUploadTest, ParallelUploadsShareTheBytesThatTheyMayStore) {
  ann_.principal.limits.max_stored_bytes = 10;
  auto first = std::make_unique<Upload>(stores_, SmallLimits(), ann_);
  Upload second(stores_, SmallLimits(), ann_);
  ASSERT_THAT(first->Add(Header("a")), Succeeds());
  ASSERT_THAT(second.Add(Header("b")), Succeeds());
  ASSERT_THAT(first->Add(File("f", 6)), Succeeds());
  EXPECT_EQ(ReasonOf(second.Add(File("f", 5))), "STORED_BYTES_EXCEEDED");
  first = nullptr;  // broken off
  Upload third(stores_, SmallLimits(), ann_);
  ASSERT_THAT(third.Add(Header("c")), Succeeds());
  EXPECT_EQ(ReasonOf(third.Add(File("f", 10))), "STORED_BYTES_EXCEEDED");
  Caller other;
  other.principal.name = other.principal.key = "ben";
  other.principal.limits.max_stored_bytes = 10;
  EXPECT_THAT(SendAs(other, {Header("d"), File("f", 10), Chunk("0123456789")}), Succeeds());
}

TEST_F(OwnedUploadTest, IsRefusedBeyondTheBytesThatTheyMayStore) {
  ann_.principal.limits.max_stored_bytes = 10;
  ASSERT_THAT(SendAs(ann_, {Header("a"), File("f", 6), Chunk("abcdef")}), Succeeds());
  // At the file that would be too much, before its bytes are sent.
  const absl::Status status =
      SendAs(ann_, {Header("b"), File("f", 2), Chunk("ab"), File("g", 3)}).status();
  EXPECT_THAT(status, Fails(absl::StatusCode::kResourceExhausted,
                            "'ann' may have 10 bytes stored and has 6; 5 more"));
  EXPECT_EQ(ReasonOf(status), "STORED_BYTES_EXCEEDED");
  EXPECT_THAT(MetadataOf(status), ElementsAre(Pair("limit", "10"), Pair("needed", "5"),
                                              Pair("principal", "ann"), Pair("used", "6")));
  const auto failure = PayloadOf<google::rpc::QuotaFailure>(status, kQuotaFailureUrl);
  ASSERT_EQ(failure.violations_size(), 1);
  EXPECT_EQ(failure.violations(0).subject(), "principal:ann");
  EXPECT_EQ(failure.violations(0).description(), std::string(status.message()));
  ASSERT_THAT(SendAs(ann_, {Header("b"), File("f", 4), Chunk("abcd")}), Succeeds());
  // At the limit an upload does not even begin.
  EXPECT_THAT(SendAs(ann_, {Header("c")}), Fails(absl::StatusCode::kResourceExhausted, "has 10"));
  Caller bob = ann_;
  bob.principal.name = bob.principal.key = "bob";
  EXPECT_THAT(SendAs(bob, {Header("c"), File("f", 4), Chunk("abcd")}), Succeeds());
}

// Each by a server of its own: the catalog decides.
TEST_F(OwnedUploadTest, TwoAtOnceDoNotPassTogether) {
  ann_.principal.limits.max_stored_bytes = 10;
  UploadTally other_tally;
  Upload one(stores_, SmallLimits(), ann_);
  Upload two({*catalog_, *blobs_, other_tally}, SmallLimits(), ann_);
  for (auto& [upload, id] : {std::pair(&one, "a"), std::pair(&two, "b")}) {
    for (const auto& message : {Header(id), File("f", 6), Chunk("abcdef")}) {
      ASSERT_THAT(upload->Add(message), Succeeds());
    }
  }
  ASSERT_THAT(one.Submit(), Succeeds());
  const absl::Status status = two.Submit().status();
  EXPECT_EQ(ReasonOf(status), "STORED_BYTES_EXCEEDED");
  EXPECT_THAT(catalog_->GetAnimation("b"), Fails(absl::StatusCode::kNotFound, "'b'"));
}

TEST_F(OwnedUploadTest, DeletingGivesRoomBack) {
  ann_.principal.limits.max_stored_bytes = 10;
  ASSERT_THAT(SendAs(ann_, {Header("a"), File("f", 10), Chunk("abcdefghij")}), Succeeds());
  store::pb::AnimationRecord animation;
  animation.set_id("a");
  animation.set_blob("blob");
  animation.set_size_bytes(12);  // what is made of an upload may be larger
  ASSERT_THAT(catalog_->PublishAnimation(TakeJob().lease_id, animation), Succeeds());
  EXPECT_THAT(SendAs(ann_, {Header("b")}), Fails(absl::StatusCode::kResourceExhausted, "has 12"));
  ASSERT_THAT(catalog_->DeleteAnimation("a"), Succeeds());
  EXPECT_THAT(SendAs(ann_, {Header("b"), File("f", 10), Chunk("abcdefghij")}), Succeeds());
}

TEST_F(OwnedUploadTest, IsRefusedBeyondTheOperationsThatTheyMayQueue) {
  ann_.principal.limits.max_queued_jobs = 1;
  const auto first = SendAs(ann_, {Header("a", "r1"), File("f", 0)});
  ASSERT_THAT(first, Succeeds());
  const absl::Status status = SendAs(ann_, {Header("b")}).status();
  EXPECT_THAT(status, Fails(absl::StatusCode::kResourceExhausted,
                            "'ann' may have 1 operations that are not done and has 1"));
  EXPECT_EQ(ReasonOf(status), "QUEUED_JOBS_EXCEEDED");
  // A call that is repeated is answered.
  const auto again = SendAs(ann_, {Header("a", "r1"), File("f", 0)});
  ASSERT_THAT(again, Succeeds());
  EXPECT_EQ(again->id(), first->id());
  ASSERT_THAT(catalog_->RequestCancel(first->id()), Succeeds());
  EXPECT_THAT(SendAs(ann_, {Header("b"), File("f", 0)}), Succeeds());
}

}  // namespace
}  // namespace liquidblend::server::upload_test
