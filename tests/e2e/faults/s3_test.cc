// The fault table's object store: S3 that fails, refuses, hangs and forgets.
#include <algorithm>
#include <fstream>
#include <random>
#include <thread>

#include "absl/strings/str_cat.h"
#include "absl/time/clock.h"
#include "tests/e2e/balls_stream.h"
#include "tests/e2e/faults/faults_testing.h"

namespace liquidblend::e2e {
namespace {

using Fault = store::FakeS3::Fault;

class FaultsS3Test : public FaultTest {
 protected:
  FaultsS3Test() {
    // Time limits that tests can wait for, and parts that small blobs have several of.
    for (const char* variable :
         {"LIQUIDBLEND_S3_CONNECT_TIMEOUT=1s", "LIQUIDBLEND_S3_STALL_TIMEOUT=1s",
          "LIQUIDBLEND_S3_PART_BYTES=32768"}) {
      s3_environment_.push_back(variable);
    }
  }

  // Faults of about half of the next `num` requests of these kinds, others in each run; one of the
  // first two always has it. EndFaults() fails if no request met it.
  void PlanSome(const std::vector<std::string>& kinds, Fault fault, int num, int run) {
    std::mt19937 random(static_cast<uint32_t>(run));
    for (const std::string& kind : kinds) {
      std::vector<Fault> faults;
      for (int k = 0; k < num; ++k) faults.push_back(random() % 2 == 0 ? fault : Fault::kNone);
      faults[static_cast<size_t>(run % 2)] = fault;
      s3().Plan(kind, faults);
    }
    planned_ = kinds;
    planned_fault_ = fault;
    num_met_before_ = s3().NumMet(fault);
  }
  void EndFaults() {
    if (!planned_.empty()) {
      EXPECT_GT(s3().NumMet(planned_fault_), num_met_before_) << "no request met the fault";
    }
    for (const std::string& kind : planned_) s3().Plan(kind, {});
    planned_.clear();
    s3().SetFault(Fault::kNone);
    s3().StopHanging();
  }

  // A run whose faults end when all accepted work is done.
  void WorkThrough() { WorkThrough(StartServer()); }
  void WorkThrough(Process server) {
    SubmitWork();
    EndRun(std::move(server), StartFaultWorker(), [this] { EndFaults(); });
  }

  void AwaitRefusedWorker() {
    Await([&] {
      const auto workers = catalog().ListWorkers();
      return workers.ok() && std::any_of(workers->begin(), workers->end(), [](const auto& worker) {
               return !worker.refusal().empty();
             });
    });
  }

  // Frames of a family in memory while all requests to S3 meet this.
  void FramesGoOnWhile(const std::string& what, Fault fault) {
    Each(what, [&](int) {
      Process server = StartServer();
      {
        BallsStream begun(*stub_);
        begun.ExpectFrame();
        ExpectFrame(*stub_);
        EXPECT_TRUE(SubmitWork());
        s3().SetFault(fault);
        Process worker = StartFaultWorker();
        BallsStream new_one(*stub_);
        const absl::Time end = absl::Now() + absl::Seconds(2);
        while (absl::Now() < end && !HasFailure()) {
          ExpectFrame(*stub_);
          begun.ExpectFrame();
          new_one.ExpectFrame();
        }
        worker.Signal(SIGTERM);
        EXPECT_EQ(worker.Wait(), 0);
      }
      EndFaults();
      EndRun(std::move(server), StartFaultWorker());
    });
  }

 private:
  std::vector<std::string> planned_;  // kinds of requests
  Fault planned_fault_ = Fault::kNone;
  int num_met_before_ = 0;
};

struct S3Fault {
  const char* name;
  Fault fault;
  int num = 8;  // requests of each kind that may meet it
};

class FaultsOfRequestsTest : public FaultsS3Test, public testing::WithParamInterface<S3Fault> {};

// Of each kind of request some fail, so many in a row that now and then a whole attempt does.
TEST_P(FaultsOfRequestsTest, LosesNothing) {
  Each(absl::StrCat("S3 answers with ", GetParam().name), [&](int run) {
    PlanSome({"PUT", "GET", "HEAD", "POST", "DELETE"}, GetParam().fault, GetParam().num, run);
    WorkThrough();
  });
}

INSTANTIATE_TEST_SUITE_P(
    Faults, FaultsOfRequestsTest,
    testing::Values(S3Fault{"500", Fault::kStatus500}, S3Fault{"503 SlowDown", Fault::kStatus503},
                    S3Fault{"a reset connection", Fault::kReset},
                    S3Fault{"half of the body", Fault::kTruncate},
                    S3Fault{"a reset connection after it did what was asked", Fault::kAnswerLost},
                    S3Fault{"an error in the middle of the body", Fault::kErrorInBody},
                    S3Fault{"nothing, and the connection hangs", Fault::kHang, 3},
                    S3Fault{"403 ExpiredToken", Fault::kExpiredToken, 2},
                    S3Fault{"404 of a proxy", Fault::kPlain404},
                    S3Fault{"301 to another region", Fault::kRedirect},
                    S3Fault{"400 AuthorizationHeaderMalformed (wrong region)", Fault::kWrongRegion,
                            2},
                    S3Fault{"a byte of the body every 50 ms", Fault::kDrip, 3}),
    [](const testing::TestParamInfo<S3Fault>& fault) {
      return absl::StrCat("Fault", fault.index);
    });

// A server does not start with a bucket that does not exist, nor does a worker, which is started
// again.
TEST_F(FaultsS3Test, BucketIsMissing) {
  Each("S3 answers with 404 NoSuchBucket while the server runs", [&](int run) {
    Process server = StartServer();
    PlanSome({"PUT", "GET", "HEAD", "POST", "DELETE"}, Fault::kNoSuchBucket, 2, run);
    WorkThrough(std::move(server));
  });
}

TEST_F(FaultsS3Test, MultipartUploadsVanish) {
  Each("S3 forgets multipart uploads", [&](int run) {
    PlanSome({"upload part", "complete upload"}, Fault::kUploadVanished, 8, run);
    WorkThrough();
  });
}

TEST_F(FaultsS3Test, CompletionsAreNotHeardOf) {
  Each("S3 completes multipart uploads, and the answers are lost", [&](int run) {
    PlanSome({"complete upload"}, Fault::kAnswerLost, 8, run);
    WorkThrough();
  });
}

TEST_F(FaultsS3Test, ListingsLag) {
  Each("S3 lists objects a second late", [&](int) {
    s3().SetListLag(absl::Seconds(1));
    WorkThrough();
  });
}

TEST_F(FaultsS3Test, ClocksDiffer) {
  TakeTime();
  Each("403 RequestTimeTooSkewed: the clock of S3 jumps by an hour in mid-job", [&](int run) {
    Process server = StartServer();
    EXPECT_TRUE(SubmitWork());
    Process worker = StartFaultWorker();
    AwaitMidJob();
    s3().SetClockAhead(absl::Hours(run % 2 == 0 ? 1 : -1));
    EndRun(std::move(server), std::move(worker), [&] { s3().SetClockAhead(absl::ZeroDuration()); });
  });
}

TEST_F(FaultsS3Test, DeniesEverythingInMidJob) {
  TakeTime();
  Each("403 AccessDenied from mid-job until the worker says that it is refused", [&](int) {
    Process server = StartServer();
    EXPECT_TRUE(SubmitWork());
    Process worker = StartFaultWorker();
    AwaitMidJob();
    s3().SetFault(Fault::kStatus403);
    AwaitRefusedWorker();
    EndFaults();
    EndRun(std::move(server), std::move(worker));
  });
}

TEST_F(FaultsS3Test, DeniesEverythingAtTheStart) {
  Each("403 AccessDenied when server and worker start", [&](int) {
    s3().SetFault(Fault::kStatus403);
    Process server = StartServer();
    EXPECT_FALSE(SubmitWork());
    Process worker = StartFaultWorker();
    AwaitRefusedWorker();
    EndFaults();
    EndRun(std::move(server), std::move(worker));
  });
}

// The key is replaced in the file before S3 refuses the old one, or only after that has been
// noticed.
class RotatedKeyTest : public FaultsS3Test {
 protected:
  RotatedKeyTest() {
    s3_environment_.erase(s3_environment_.begin(), s3_environment_.begin() + 2);
    s3_environment_.insert(s3_environment_.end(), {"AWS_SHARED_CREDENTIALS_FILE=" + file_,
                                                   "AWS_ACCESS_KEY_ID=", "AWS_PROFILE="});
    WriteKey("key 0");
  }
  void WriteKey(const std::string& id) {
    std::ofstream(file_ + ".new") << "[default]\naws_access_key_id = " << id
                                  << "\naws_secret_access_key = secret\n";
    std::filesystem::rename(file_ + ".new", file_);
  }

  store::TemporaryFolder folder_of_file_;
  const std::string file_ = folder_of_file_.path() + "/credentials";
};

TEST_F(RotatedKeyTest, IsReadAgain) {
  TakeTime();
  Each("403 InvalidAccessKeyId: the key is replaced in mid-job", [&](int run) {
    const std::string key = absl::StrCat("key ", run);
    Process server = StartServer();
    EXPECT_TRUE(SubmitWork());
    Process worker = StartFaultWorker();
    AwaitMidJob();
    if (run % 2 == 0) WriteKey(key);
    s3().SetKeyId(key);
    if (run % 2 != 0) {
      AwaitRefusedWorker();
      WriteKey(key);
    }
    EndRun(std::move(server), std::move(worker));
  });
}

TEST_F(FaultsS3Test, FramesGoOnWhileS3Denies) {
  FramesGoOnWhile("S3 denies everything while frames are asked for", Fault::kStatus403);
}

TEST_F(FaultsS3Test, FramesGoOnWhileS3Hangs) {
  FramesGoOnWhile("S3 hangs while frames are asked for", Fault::kHang);
}

}  // namespace
}  // namespace liquidblend::e2e
