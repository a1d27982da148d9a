// What is left when programs are killed: everything whole, nothing half.
#include <signal.h>

#include <algorithm>
#include <memory>
#include <utility>

#include "absl/strings/str_cat.h"
#include "core/store/catalog/catalog.h"
#include "tests/e2e/e2e_testing.h"

namespace liquidblend::e2e {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;

class KillTest : public E2eTest {
 protected:
  static std::vector<std::string> DieAt(const std::string& fault_point) {
    return {"LIQUIDBLEND_FAULT_POINT=" + fault_point};
  }

  void ImportBoth() {
    Process worker = StartWorker();
    ExpectSuccess(AwaitDone(ImportBall("a", 1.0).name()));
    ExpectSuccess(AwaitDone(ImportBall("b", 2.0).name()));
  }

  v1::Animation GetAnimation(const std::string& id) {
    grpc::ClientContext context;
    v1::GetAnimationRequest request;
    request.set_name("animations/" + id);
    v1::Animation animation;
    EXPECT_TRUE(stub_->GetAnimation(&context, request, &animation).ok());
    return animation;
  }

  int64_t FamilyVersion() {
    grpc::ClientContext context;
    v1::GetFamilyRequest request;
    request.set_name("families/balls");
    v1::Family family;
    EXPECT_TRUE(stub_->GetFamily(&context, request, &family).ok());
    return family.version();
  }
};

TEST_F(KillTest, AnotherWorkerFinishesTheRegistrationOfAKilledOne) {
  Process server = StartServer();
  ImportBoth();
  Operation registration;
  ASSERT_TRUE(Register(LongWork(), registration).ok());
  Process first = StartWorker();
  const Operation running = Watch(registration.name(), [](const Operation& operation) {
    return ProgressOf(operation).iteration() > 0;
  });
  ASSERT_FALSE(running.done());
  EXPECT_EQ(first.Kill(), -SIGKILL);
  EXPECT_EQ(FamilyVersion(), 0);

  Process second = StartWorker();
  const Operation done = AwaitDone(registration.name());
  ExpectSuccess(done);
  EXPECT_EQ(ProgressOf(done).attempt(), 2);
  EXPECT_NE(ProgressOf(done).worker(), ProgressOf(running).worker());
  EXPECT_EQ(FamilyVersion(), 1);
}

TEST_F(KillTest, TheServerReplacesItsKilledWorkers) {
  Process server = StartServer(1);
  Await([&] { return ChildrenOf(server.pid()).size() == 1; });
  const pid_t worker = ChildrenOf(server.pid())[0];
  kill(worker, SIGKILL);
  Await([&] {
    const std::vector<pid_t> now = ChildrenOf(server.pid());
    return now.size() == 1 && now[0] != worker;
  });
  ExpectSuccess(AwaitDone(ImportBall("a", 1.0).name()));
}

TEST_F(KillTest, WorkersEndWithAKilledServer) {
  Process server = StartServer(2);
  Await([&] { return ChildrenOf(server.pid()).size() == 2; });
  const std::vector<pid_t> workers = ChildrenOf(server.pid());
  server.Kill();
  for (const pid_t worker : workers) Await([&] { return !IsAlive(worker); });
}

TEST_F(KillTest, AServerKilledInAnUploadLeavesNothingVisible) {
  {
    Process server = StartServer();
    grpc::ClientContext context;
    Operation operation;
    auto writer = stub_->UploadAnimation(&context, &operation);
    v1::UploadAnimationRequest message;
    message.mutable_header()->set_animation_id("a");
    ASSERT_TRUE(writer->Write(message));
    message.mutable_file()->set_name("f0001.ply");
    message.mutable_file()->set_size_bytes(100);
    ASSERT_TRUE(writer->Write(message));
    message.set_chunk(std::string(50, 'x'));
    ASSERT_TRUE(writer->Write(message));
    Await([&] { return store::CountFiles(blob_folder() + "/tmp") > 0; });
    server.Kill();
    EXPECT_FALSE(writer->Finish().ok());
  }
  Process server = StartServer(1);
  EXPECT_EQ(store::CountFiles(blob_folder() + "/tmp"), 0);
  EXPECT_THAT(AnimationNames(), IsEmpty());
  EXPECT_EQ(NumOperations(), 0);
  ExpectSuccess(AwaitDone(ImportBall("a", 1.0).name()));
}

// At every place where an upload may be cut, it is either accepted whole or not at all.
TEST_F(KillTest, AServerKilledAtAnyPointOfAnUploadIsAllOrNothing) {
  for (const char* point :
       {"blob.append", "blob.before_sync", "blob.before_rename", "blob.after_rename",
        "blob.committed", "catalog.before_commit", "catalog.after_commit"}) {
    SCOPED_TRACE(point);
    Operation operation;
    {
      Process server = StartServer(0, DieAt(point));
      EXPECT_FALSE(Upload("a", BallFiles(1.0), point, operation).ok());
      EXPECT_EQ(server.Wait(), -SIGKILL);
    }
    const bool is_accepted = std::string(point) == "catalog.after_commit";
    Process server = StartServer(1);
    EXPECT_EQ(NumOperations(), is_accepted ? 1 : 0);
    EXPECT_EQ(AnimationNames().size(), is_accepted ? 1U : 0U);
    if (!is_accepted) continue;
    // The client does not know, and asks again.
    ASSERT_TRUE(Upload("a", BallFiles(1.0), point, operation).ok());
    ExpectSuccess(AwaitDone(operation.name()));
    EXPECT_EQ(NumOperations(), 1);
  }
}

TEST_F(KillTest, AWorkerKilledAtAnyPointOfAnImportIsReplacedAndNothingHalfIsVisible) {
  Process server = StartServer();
  int num_imports = 0;
  for (const char* point : {"blob.append", "blob.before_rename", "blob.committed",
                            "publish.before_commit", "publish.after_commit"}) {
    SCOPED_TRACE(point);
    const std::string id = absl::StrCat("a", num_imports++);
    const Operation import = ImportBall(id, 1.0);
    Process killed = StartWorker(DieAt(point));
    EXPECT_EQ(killed.Wait(), -SIGKILL);
    const bool is_published = std::string(point) == "publish.after_commit";
    EXPECT_EQ(GetAnimation(id).state(),
              is_published ? v1::Animation::READY : v1::Animation::IMPORTING);
    Process worker = StartWorker();
    ExpectSuccess(AwaitDone(import.name()));
    EXPECT_EQ(GetAnimation(id).state(), v1::Animation::READY);
    EXPECT_EQ(GetAnimation(id).num_frames(), 6);
  }
}

TEST_F(KillTest, AWorkerKilledAtThePublishingOfAFamilyShowsAllOfItOrNothing) {
  Process server = StartServer();
  ImportBoth();
  int64_t version = 0;
  for (const char* point : {"publish.before_commit", "publish.after_commit"}) {
    SCOPED_TRACE(point);
    Operation registration;
    const grpc::Status status = Register(3, registration);
    ASSERT_TRUE(status.ok()) << status.error_message();
    Process killed = StartWorker(DieAt(point));
    EXPECT_EQ(killed.Wait(), -SIGKILL);
    const bool is_published = std::string(point) == "publish.after_commit";
    EXPECT_EQ(FamilyVersion(), is_published ? version + 1 : version);
    Process worker = StartWorker();
    ExpectSuccess(AwaitDone(registration.name()));
    EXPECT_EQ(FamilyVersion(), ++version);
  }
}

class KillManyTargetsTest : public KillTest {
 protected:
  // balls: a -> b, c, d, by one worker. Returns the family's file, which is called by its content.
  std::string RegisterUndisturbed(const v1::RegistrationOptions& options) {
    Process worker = StartWorker();
    for (const auto& [id, velocity] : kBalls) {
      ExpectSuccess(AwaitDone(ImportBall(id, velocity).name()));
    }
    Operation registration;
    EXPECT_TRUE(Register(options, registration, kTargets).ok());
    ExpectSuccess(AwaitDone(registration.name()));
    return FamilyBlob();
  }

  std::string FamilyBlob() { return catalog()->GetFamily("balls")->blob(); }

  // Of the operation; the workers' own view, past the server.
  std::vector<store::pb::JobRecord> ChildrenOf(const Operation& operation) {
    return *catalog()->ListChildren(operation.name().substr(std::string("operations/").size()));
  }

  const std::vector<std::string> kTargets = {"b", "c", "d"};

 private:
  store::Catalog* catalog() {
    if (!catalog_) catalog_ = OpenCatalog();
    return catalog_.get();
  }

  const std::vector<std::pair<std::string, double>> kBalls = {
      {"a", 1.0}, {"b", 2.0}, {"c", 0.0}, {"d", -1.0}};
  std::unique_ptr<store::Catalog> catalog_;
};

TEST_F(KillManyTargetsTest, ManyWorkersOneOfThemKilledMakeTheSameFamilyAsOne) {
  Process server = StartServer();
  const std::string expected = RegisterUndisturbed(LongWork());
  EXPECT_EQ(FamilyVersion(), 1);

  Operation registration;
  ASSERT_TRUE(Register(LongWork(), registration, kTargets).ok());
  Process killed = StartWorker(), other = StartWorker();
  const auto is_at_work = [](const auto& child) {
    return child.state() == store::pb::JobRecord::RUNNING && child.progress().iteration() > 0;
  };
  std::vector<store::pb::JobRecord> children;
  Await([&] {
    children = ChildrenOf(registration);
    return std::count_if(children.begin(), children.end(), is_at_work) == 2;
  });
  EXPECT_EQ(killed.Kill(), -SIGKILL);
  EXPECT_EQ(FamilyVersion(), 1);
  Process third = StartWorker();
  Await([&] {
    children = ChildrenOf(registration);
    return std::any_of(children.begin(), children.end(),
                       [](const auto& child) { return child.attempts() == 2; });
  });
  const Operation done = AwaitDone(registration.name());
  ExpectSuccess(done);
  EXPECT_EQ(FamilyVersion(), 2);
  EXPECT_EQ(FamilyBlob(), expected);
  EXPECT_TRUE(ChildrenOf(registration).empty());
}

// Three for the children, one for the family; each dies when the catalog has its first result.
TEST_F(KillManyTargetsTest, AFamilyIsWholeThoughEveryWorkerDiesWithItsFirstResult) {
  Process server = StartServer();
  const std::string expected = RegisterUndisturbed(Iterations(3));
  Operation registration;
  ASSERT_TRUE(Register(3, registration, kTargets).ok());
  for (int k = 0; k < 4; ++k) {
    EXPECT_EQ(FamilyVersion(), 1);
    Process worker = StartWorker(DieAt("publish.after_commit"));
    EXPECT_EQ(worker.Wait(), -SIGKILL);
  }
  ExpectSuccess(AwaitDone(registration.name()));
  EXPECT_EQ(FamilyVersion(), 2);
  EXPECT_EQ(FamilyBlob(), expected);
}

TEST_F(KillManyTargetsTest, AChildKilledBeforeItsResultIsKnownIsDoneAgain) {
  Process server = StartServer();
  const std::string expected = RegisterUndisturbed(Iterations(3));
  Operation registration;
  ASSERT_TRUE(Register(3, registration, kTargets).ok());
  Process killed = StartWorker(DieAt("publish.before_commit"));
  EXPECT_EQ(killed.Wait(), -SIGKILL);
  for (const auto& child : ChildrenOf(registration)) EXPECT_EQ(child.result_blob(), "");
  Process worker = StartWorker();
  ExpectSuccess(AwaitDone(registration.name()));
  EXPECT_EQ(FamilyBlob(), expected);
}

TEST_F(KillManyTargetsTest, ACancellationStopsAllWorkers) {
  Process server = StartServer();
  RegisterUndisturbed(Iterations(3));
  Operation registration;
  ASSERT_TRUE(Register(LongWork(), registration, kTargets).ok());
  Process one = StartWorker(), two = StartWorker();
  Watch(registration.name(),
        [](const Operation& operation) { return ProgressOf(operation).iteration() > 0; });
  grpc::ClientContext context;
  google::longrunning::CancelOperationRequest cancel;
  cancel.set_name(registration.name());
  google::protobuf::Empty empty;
  ASSERT_TRUE(operations_->CancelOperation(&context, cancel, &empty).ok());
  EXPECT_EQ(AwaitDone(registration.name()).error().code(), grpc::StatusCode::CANCELLED);
  // Both are free for other work, long before the registration would be done.
  ASSERT_TRUE(Register(3, registration, kTargets).ok());
  ExpectSuccess(AwaitDone(registration.name()));
  EXPECT_EQ(FamilyVersion(), 2);
}

// The whole machine goes down, as far as the programs can tell, while a job runs.
TEST_F(KillTest, AServerKilledWithItsWorkersFinishesTheJobAfterwards) {
  Operation registration;
  {
    Process server = StartServer(1);
    ExpectSuccess(AwaitDone(ImportBall("a", 1.0).name()));
    ExpectSuccess(AwaitDone(ImportBall("b", 2.0).name()));
    ASSERT_TRUE(Register(LongWork(), registration).ok());
    Watch(registration.name(),
          [](const Operation& operation) { return ProgressOf(operation).iteration() > 0; });
    const std::vector<pid_t> workers = ChildrenOf(server.pid());
    for (const pid_t worker : workers) kill(worker, SIGKILL);
    server.Kill();
  }
  Process server = StartServer(1);
  ExpectSuccess(AwaitDone(registration.name()));
  EXPECT_THAT(AnimationNames(), ElementsAre("animations/a", "animations/b"));
}

}  // namespace
}  // namespace liquidblend::e2e
