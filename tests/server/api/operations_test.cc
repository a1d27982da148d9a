#include "server/api/handlers.h"

#include <set>
#include <string>
#include <vector>

#include "server/api/api_messages.h"
#include "tests/server/api/handlers_testing.h"

namespace liquidblend::server {
namespace {

using store::Succeeds;

using OperationsTest = HandlersTest;

TEST_F(OperationsTest, AnOperationThatNobodyTakesSaysWhatItWaitsFor) {
  store::pb::JobRecord job;
  job.set_state(store::pb::JobRecord::QUEUED);  // since 1970
  job.mutable_import_animation()->set_animation("drop");
  job.set_memory_bytes(int64_t{12} << 30);
  ASSERT_TRUE(catalog_->LeaseJob("small", absl::Minutes(1), int64_t{8} << 30).ok());
  const auto progress = [&] {
    const auto operation = ToOperation(job, *catalog_);
    EXPECT_THAT(operation, Succeeds());
    v1::ImportAnimationMetadata metadata;
    EXPECT_TRUE(operation->metadata().UnpackTo(&metadata));
    return metadata.progress();
  };
  EXPECT_EQ(progress().waiting_for(),
            "needs about 12.0 GiB of memory; no worker that asked lately can hold it");
  EXPECT_EQ(progress().memory_bytes(), int64_t{12} << 30);
  job.mutable_update_time()->set_seconds(absl::ToUnixSeconds(absl::Now()));
  EXPECT_EQ(progress().waiting_for(), "");  // not yet
}

TEST_F(OperationsTest, AnOperationThatRefusedWorkersLeaveSaysSo) {
  store::pb::JobRecord job;
  job.set_state(store::pb::JobRecord::QUEUED);
  job.mutable_import_animation()->set_animation("drop");
  job.mutable_next_attempt_time()->set_seconds(1);  // it was tried before, and is due
  store::pb::WorkerRecord worker;
  worker.set_name("host:1");
  worker.set_refusal("HTTP status 403, AccessDenied");
  ASSERT_THAT(catalog_->RecordWorker(worker), Succeeds());
  const auto waiting_for = [&] {
    const auto operation = ToOperation(job, *catalog_);
    EXPECT_THAT(operation, Succeeds());
    v1::ImportAnimationMetadata metadata;
    EXPECT_TRUE(operation->metadata().UnpackTo(&metadata));
    return metadata.progress().waiting_for();
  };
  EXPECT_EQ(waiting_for(), "workers take no jobs for now; host:1: HTTP status 403, AccessDenied");
  job.mutable_next_attempt_time()->set_seconds(absl::ToUnixSeconds(absl::Now()) + 60);
  EXPECT_EQ(waiting_for(), "");  // it would wait in any case
}

TEST_F(OperationsTest, AnOperationThatIsHandedBackInVainSaysSo) {
  const store::pb::JobRecord job = SubmitImport("drop");
  const auto hand_back = [&] {
    EXPECT_THAT(catalog_->ReleaseJob(TakeJob().lease_id), Succeeds());
    const auto operation = ToOperation(*catalog_->GetJob(job.id()), *catalog_);
    EXPECT_THAT(operation, Succeeds());
    v1::ImportAnimationMetadata metadata;
    EXPECT_TRUE(operation->metadata().UnpackTo(&metadata));
    return metadata.progress();
  };
  EXPECT_EQ(hand_back().waiting_for(), "");  // that may happen to any
  const v1::Progress progress = hand_back();
  EXPECT_EQ(progress.handed_back(), 2);
  EXPECT_THAT(progress.waiting_for(),
              testing::HasSubstr("handed back 2 times in succession without a new checkpoint"));
}

TEST_F(OperationsTest, AnOperationThatIsTriedAgainSaysWhenAndWhy) {
  const store::pb::JobRecord job = SubmitImport("drop");
  ASSERT_THAT(catalog_->FailJob(TakeJob().lease_id, absl::UnavailableError("no S3"), true),
              Succeeds());
  lro::GetOperationRequest request;
  request.set_name("operations/" + job.id());
  const auto operation = GetOperation(backends_, request);
  ASSERT_THAT(operation, Succeeds());
  EXPECT_FALSE(operation->done());
  v1::ImportAnimationMetadata metadata;
  EXPECT_TRUE(operation->metadata().UnpackTo(&metadata));
  const v1::Progress& progress = metadata.progress();
  EXPECT_EQ(progress.stage(), "queued");
  EXPECT_EQ(progress.attempt(), 1);
  EXPECT_EQ(progress.last_failure().code(), 14);
  EXPECT_EQ(progress.last_failure().message(), "no S3");
  EXPECT_EQ(progress.next_attempt_time().seconds(),
            catalog_->GetJob(job.id())->next_attempt_time().seconds());
  EXPECT_GT(progress.next_attempt_time().seconds(), 0);
}

TEST_F(OperationsTest, AnOperationTellsItsWholeLife) {
  const store::pb::JobRecord job = SubmitImport("drop");
  lro::GetOperationRequest request;
  request.set_name("operations/" + job.id());
  v1::ImportAnimationMetadata metadata;

  auto queued = GetOperation(backends_, request);
  ASSERT_THAT(queued, Succeeds());
  EXPECT_FALSE(queued->done());
  ASSERT_TRUE(queued->metadata().UnpackTo(&metadata));
  EXPECT_EQ(metadata.animation(), "animations/drop");
  EXPECT_EQ(metadata.progress().stage(), "queued");

  const store::Lease lease = TakeJob();
  store::pb::JobProgress progress;
  progress.set_stage("reading frames");
  progress.set_fraction(0.25);
  ASSERT_TRUE(catalog_->Heartbeat(lease.lease_id, absl::Hours(1), progress).ok());
  auto running = GetOperation(backends_, request);
  ASSERT_TRUE(running->metadata().UnpackTo(&metadata));
  EXPECT_EQ(metadata.progress().stage(), "reading frames");
  EXPECT_EQ(metadata.progress().fraction(), 0.25);
  EXPECT_EQ(metadata.progress().attempt(), 1);
  EXPECT_EQ(metadata.progress().worker(), "test");

  store::pb::AnimationRecord record;
  record.set_id("drop");
  record.mutable_manifest()->set_num_frames(3);
  ASSERT_TRUE(catalog_->PublishAnimation(lease.lease_id, record).ok());
  auto done = GetOperation(backends_, request);
  EXPECT_TRUE(done->done());
  v1::Animation animation;
  ASSERT_TRUE(done->response().UnpackTo(&animation));
  EXPECT_EQ(animation.name(), "animations/drop");
  EXPECT_EQ(animation.state(), v1::Animation::READY);
  EXPECT_EQ(animation.num_frames(), 3);

  ASSERT_TRUE(catalog_->DeleteAnimation("drop").ok());
  ASSERT_TRUE(GetOperation(backends_, request)->response().UnpackTo(&animation));
  EXPECT_EQ(animation.name(), "animations/drop");
  EXPECT_EQ(animation.state(), v1::Animation::STATE_UNSPECIFIED);
}

// The job's records are short.
TEST_F(OperationsTest, AListEndsByTheBytesOfItsResults) {
  store::pb::AnimationManifest manifest = SmallManifest();
  manifest.add_notes(std::string(1'200'000, 'x'));
  for (const std::string id : {"a", "b", "c", "d", "e"}) ImportAnimation(id, manifest);
  lro::ListOperationsRequest request;
  std::vector<int> sizes;
  std::set<std::string> names;
  do {
    const auto page = ListOperations(backends_, request);
    ASSERT_THAT(page, Succeeds());
    EXPECT_LT(page->ByteSizeLong(), size_t{4} << 20);
    sizes.push_back(page->operations_size());
    for (const lro::Operation& operation : page->operations()) names.insert(operation.name());
    request.set_page_token(page->next_page_token());
  } while (!request.page_token().empty());
  EXPECT_THAT(sizes, testing::ElementsAre(3, 2));
  EXPECT_EQ(names.size(), 5U);
}

TEST_F(OperationsTest, AListHasAResultThatIsLongerThanAnAnswer) {
  store::pb::AnimationManifest manifest = SmallManifest();
  manifest.add_notes(std::string(5'000'000, 'x'));
  for (const std::string id : {"a", "b"}) ImportAnimation(id, manifest);
  const auto page = ListOperations(backends_, {});
  ASSERT_THAT(page, Succeeds());
  EXPECT_EQ(page->operations_size(), 1);
  lro::ListOperationsRequest request;
  request.set_page_token(page->next_page_token());
  EXPECT_EQ(ListOperations(backends_, request)->operations_size(), 1);
}

TEST_F(OperationsTest, ARegistrationOfSeveralTargetsIsOneOperation) {
  for (const std::string id : {"a", "b", "c"}) ImportAnimation(id);
  v1::RegisterFamilyRequest registration = Registration();
  registration.clear_targets();
  for (const std::string id : {"b", "c"}) registration.add_targets("animations/" + id);
  const auto submitted = RegisterFamily(backends_, registration);
  ASSERT_THAT(submitted, Succeeds());
  EXPECT_EQ(ListOperations(backends_, {})->operations_size(), 4);  // with three imports
  lro::GetOperationRequest request;
  request.set_name(submitted->name());
  const auto progress_now = [&] {
    const auto operation = GetOperation(backends_, request);
    EXPECT_THAT(operation, Succeeds());
    EXPECT_FALSE(operation->done());
    v1::RegisterFamilyMetadata metadata;
    EXPECT_TRUE(operation->metadata().UnpackTo(&metadata));
    return metadata.progress();
  };
  EXPECT_EQ(progress_now().stage(), "queued");
  const store::Lease first = TakeJob(), second = TakeJob();
  const auto report = [&](const store::Lease& lease, double fraction) {
    store::pb::JobProgress progress;
    progress.set_stage("registration");
    progress.set_fraction(fraction);
    EXPECT_THAT(catalog_->Heartbeat(lease.lease_id, absl::Hours(1), progress), Succeeds());
  };
  report(first, 0.75);
  report(second, 0.25);
  EXPECT_EQ(progress_now().stage(), "registration");
  EXPECT_DOUBLE_EQ(progress_now().fraction(), store::kChildrenShare / 2);
  EXPECT_EQ(progress_now().target_index(), 1);
  EXPECT_EQ(progress_now().attempt(), 1);
  EXPECT_THAT(catalog_->FinishChild(first.lease_id, "blob"), Succeeds());
  EXPECT_THAT(catalog_->FinishChild(second.lease_id, "blob"), Succeeds());
  EXPECT_EQ(progress_now().stage(), "queued");
  EXPECT_DOUBLE_EQ(progress_now().fraction(), store::kChildrenShare);
  EXPECT_EQ(TakeJob().job.parent(), "");
  EXPECT_DOUBLE_EQ(progress_now().fraction(), store::kChildrenShare);
}

TEST_F(OperationsTest, AFailedOperationTellsWhy) {
  const store::pb::JobRecord job = SubmitImport("drop");
  const absl::Status error = absl::InvalidArgumentError("frame 3: not closed");
  ASSERT_TRUE(catalog_->FailJob(TakeJob().lease_id, error, false).ok());
  lro::GetOperationRequest request;
  request.set_name("operations/" + job.id());
  const auto operation = GetOperation(backends_, request);
  ASSERT_THAT(operation, Succeeds());
  EXPECT_TRUE(operation->done());
  EXPECT_EQ(operation->error().code(), 3);
  EXPECT_EQ(operation->error().message(), "frame 3: not closed");
}

TEST_F(OperationsTest, ACancelledOperationSaysSo) {
  const store::pb::JobRecord job = SubmitImport("drop");
  lro::CancelOperationRequest cancel;
  cancel.set_name("operations/" + job.id());
  ASSERT_THAT(CancelOperation(backends_, cancel), Succeeds());
  const auto operations = ListOperations(backends_, {});
  ASSERT_THAT(operations, Succeeds());
  ASSERT_EQ(operations->operations_size(), 1);
  EXPECT_TRUE(operations->operations(0).done());
  EXPECT_EQ(operations->operations(0).error().code(), 1);
}

class CancelledImportTest : public OperationsTest {
 protected:
  // An import that has been accepted, with an empty file for each entry.
  store::pb::JobRecord Submit(const std::vector<bool>& are_sent_directly) {
    store::pb::JobRecord job;
    job.mutable_import_animation()->set_animation("drop");
    store::pb::AnimationRecord animation;
    animation.set_id("drop");
    for (const bool is_sent_directly : are_sent_directly) {
      store::pb::SourceFile& file = *job.mutable_import_animation()->add_files();
      file.set_blob((*blobs_->CreateUpload())->Commit().value());
      file.set_sent_directly(is_sent_directly);
    }
    return catalog_->SubmitImport(animation, job, {}).value();
  }
  void Cancel(const store::pb::JobRecord& job) {
    lro::CancelOperationRequest request;
    request.set_name("operations/" + job.id());
    EXPECT_THAT(CancelOperation(backends_, request), Succeeds());
    backends_.Stop();  // after what was posted
  }
  bool HasFile(const store::pb::JobRecord& job, int k) {
    return blobs_->Open(job.import_animation().files(k).blob()).ok();
  }
};

TEST_F(CancelledImportTest, InTheQueueLeavesOnlyFilesThatWereSentDirectly) {
  const store::pb::JobRecord job = Submit({false, true});
  ASSERT_TRUE(HasFile(job, 0));
  Cancel(job);
  EXPECT_FALSE(HasFile(job, 0));
  EXPECT_TRUE(HasFile(job, 1));
}

TEST_F(CancelledImportTest, WhileItRunsKeepsItsFilesForItsWorker) {
  const store::pb::JobRecord job = Submit({false});
  TakeJob();
  Cancel(job);
  EXPECT_TRUE(HasFile(job, 0));
}

}  // namespace
}  // namespace liquidblend::server
