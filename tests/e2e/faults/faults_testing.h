// A line of the fault table (docs/faults.md): a fault, met again and again, and what was lost of
// what had been accepted or published.
#pragma once

#include <functional>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "absl/synchronization/mutex.h"
#include "tests/core/store/blobs/fake_s3.h"
#include "tests/core/store/sql/postgres_server.h"
#include "tests/e2e/e2e_testing.h"
#include "tests/e2e/faults/fault_layer.h"

namespace liquidblend::e2e {

// How often each fault is met: LIQUIDBLEND_FAULT_RUNS, once unless that is set.
int NumFaultRuns();

enum class Tier { kEmbedded, kShared };

// Counts a line's runs. At its end nothing may have been lost; then the line goes to the file
// LIQUIDBLEND_FAULT_TABLE, if that is set.
class FaultLine {
 public:
  FaultLine(std::string fault, Tier tier) : fault_(std::move(fault)), tier_(tier) {}
  ~FaultLine();
  FaultLine(const FaultLine&) = delete;
  FaultLine& operator=(const FaultLine&) = delete;

  // Forgets the runs so far, which were there to find something out, but not what they lost.
  void Restart() {
    num_missed += num_runs;
    num_runs = num_accepted = num_retried = num_published = 0;
  }
  // The fault did not strike in this run, which does not count then.
  void Miss() {
    --num_runs;
    ++num_missed;
  }

  int num_runs = 0;
  int num_missed = 0;             // runs that do not count
  int num_accepted = 0;           // jobs whose submission was answered OK
  int num_retried = 0;            // attempts of jobs that failed or lost their worker
  int num_published = 0;          // animations and families that were to be read at the end
  std::vector<std::string> lost;  // what, and in which run

 private:
  const std::string fault_;
  const Tier tier_;
};

class FaultTest : public E2eTest {
 protected:
  FaultTest();
  ~FaultTest() override;

  // A store with the animations a and b and the family balls of them. On the embedded tier each
  // call makes it anew; on the shared tier it stays, and only the import is undone.
  void BeginRun(FaultLine& line, Tier tier);
  // What a fault strikes: an import, and another version of balls. What is refused is asked for
  // again in EndRun(), with the same request id. Whether all was accepted.
  bool SubmitWork();
  // Starts what is needed and not there, waits for all that was accepted, and notes in the line
  // what is lost: a job that is not there or has failed, an animation or a family that cannot be
  // read or has other bytes.
  //   server  that runs, or nothing that runs
  //   worker  likewise
  //   when_done  called before the results are looked at
  void EndRun(Process server, Process worker, const std::function<void()>& when_done = {});
  // Registers balls through that server; `what` is one of the run's accepted jobs then.
  // Threads: safe.
  void RegisterUntilAccepted(v1::LiquidBlend::Stub& stub, const std::string& what);

  // So many runs as one line of the shared tier.
  void Each(const std::string& fault, const std::function<void(int)>& run_once);
  // Makes registrations long enough to be met in mid-job.
  void TakeTime();

  // With a short lease, and a checkpoint after every iteration.
  Process StartFaultWorker(const std::vector<std::string>& environment = {});
  // Its lease; slow programs renew it late, too.
  absl::Duration WorkerLease() const { return Slowness() * worker_lease_; }
  // Until a program that is to die has died, or all that was accepted has been done for a while
  // without that: false.
  bool AwaitDeath(const Process& program);
  FaultLine* line() const { return line_; }
  const std::string& registration() const { return names_.at("registration"); }
  store::pb::JobRecord JobOf(const std::string& operation);
  store::Catalog& catalog();
  void Lose(const std::string& what);
  // Waits until the registration has come so far that it has a checkpoint.
  void AwaitMidJob();

  // Of the shared tier, once a run has begun.
  store::PostgresServer& postgres() { return *postgres_; }
  store::FakeS3& s3() { return *s3_; }
  const std::string& catalog_url() const { return catalog_url_; }
  // The layer that programs of this run may have; its environment is the caller's to pass on.
  FaultLayer& MakeLayer(bool has_disk);

  // What calls were refused with, and, after EndRun(), what attempts at jobs failed with.
  const std::vector<std::string>& errors() const { return errors_; }

  absl::Duration worker_lease_ = absl::Milliseconds(600);
  // What programs know of the fake S3 beside its address; read by the first BeginRun().
  std::vector<std::string> s3_environment_ = {"AWS_ACCESS_KEY_ID=id",
                                              "AWS_SECRET_ACCESS_KEY=secret"};

 private:
  void MakeStore();
  void TakeTemplate();
  bool Submit(const std::string& what);
  grpc::Status Register(v1::LiquidBlend::Stub& stub, const std::string& what,
                        Operation& operation) const;
  void NoteAccepted(const std::string& what, const Operation& operation)
      ABSL_LOCKS_EXCLUDED(names_mutex_);
  std::string RequestId(const std::string& what) const;
  void AwaitAll(Process& worker);
  bool IsDone(const std::string& what, const std::string& operation);
  void CheckPublished();
  // The import and all that it left: no later one finds its bytes.
  void ForgetImport();
  int Admin(std::vector<std::string> arguments) const;  // liquidblend-admin's exit code
  std::string FrameOf(const std::string& family);

  v1::RegistrationOptions options_ = Iterations(3);
  FaultLine* line_ = nullptr;
  Tier tier_ = Tier::kEmbedded;
  int run_ = 0;
  absl::Mutex names_mutex_;                   // only RegisterUntilAccepted() may run beside itself
  std::map<std::string, std::string> names_;  // of operations, by what they do
  std::string catalog_url_;                   // shared tier; past any proxy
  std::vector<std::string> errors_;
  int64_t num_versions_ = 0;  // of balls, published
  struct {
    std::string family_blob, import_blob, frame;
  } expected_;
  std::unique_ptr<store::TemporaryFolder> template_;
  std::unique_ptr<store::PostgresServer> postgres_;
  std::unique_ptr<store::FakeS3> s3_;
  std::unique_ptr<store::TemporaryFolder> own_;
  std::unique_ptr<FaultLayer> layer_;
  std::unique_ptr<store::Catalog> catalog_;
};

}  // namespace liquidblend::e2e
