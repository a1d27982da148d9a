#include "server/admin/jobs.h"

#include <nlohmann/json.hpp>

#include "absl/time/clock.h"
#include "server/admin/print.h"
#include "tests/server/admin/admin_testing.h"

namespace liquidblend::admin {
namespace {

using nlohmann::json;
using testing::AllOf;
using testing::ElementsAre;
using testing::HasSubstr;

class JobsTest : public AdminTest {
 protected:
  std::string Fail(const store::Lease& lease) {
    EXPECT_THAT(data_.catalog().FailJob(lease.lease_id, absl::DataLossError("frame 3 is torn"),
                                        /*retry=*/false),
                Succeeds());
    return lease.job.id();
  }
};

TEST_F(JobsTest, TheQueueHasWhatIsNotDoneAndWhatFailedLast) {
  std::vector<std::string> failed;
  for (const char* id : {"a", "b", "c"}) {
    data_.SubmitImport(id);
    failed.push_back(Fail(data_.TakeJob()));
  }
  data_.SubmitImport("d");
  data_.SubmitImport("e");
  const store::Lease lease = data_.TakeJob();
  const auto report = InspectQueue(data_.catalog(), 2);
  ASSERT_THAT(report, Succeeds());
  const json queue = json::parse(Print(*report, absl::Now(), Format::kJson));
  EXPECT_EQ(queue["counts"], (json{{"failed", 3}, {"queued", 1}, {"running", 1}}));
  ASSERT_EQ(queue["unfinished"].size(), 2);
  EXPECT_EQ(queue["unfinished"][0]["job"], lease.job.id());
  EXPECT_EQ(queue["unfinished"][0]["worker"], "host:1");
  EXPECT_EQ(queue["unfinished"][0]["attempts"], 1);
  EXPECT_TRUE(queue["unfinished"][0].contains("lease_expires"));
  EXPECT_EQ(queue["unfinished"][1]["state"], "queued");
  ASSERT_EQ(queue["failed"].size(), 2);
  EXPECT_EQ(queue["failed"][0]["job"], failed[2]);
  EXPECT_EQ(queue["failed"][0]["error"], "DATA_LOSS: frame 3 is torn");
  EXPECT_THAT(
      Print(*report, absl::Now() + absl::Minutes(2), Format::kText),
      AllOf(HasSubstr("2m"), HasSubstr("animations/e"), HasSubstr("on host:1"),
            HasSubstr("DATA_LOSS: frame 3 is torn"), HasSubstr("1 queued, 1 running, 3 failed")));
}

TEST_F(JobsTest, WorkersTellWhatTheyHoldSinceWhen) {
  EXPECT_EQ(Print(*InspectWorkers(data_.catalog()), absl::Now(), Format::kText),
            "0 workers at work, 0 idle\n");
  data_.SubmitImport("a");
  data_.SubmitImport("b");
  const store::Lease lease = data_.TakeJob();
  ASSERT_TRUE(data_.catalog().LeaseJob("host:2", absl::Minutes(1))->has_value());
  store::pb::JobProgress progress;
  progress.set_stage("reading");
  progress.set_fraction(0.25);
  ASSERT_THAT(data_.catalog().Heartbeat(lease.lease_id, absl::Minutes(1), progress), Succeeds());
  const auto workers = InspectWorkers(data_.catalog());
  ASSERT_THAT(workers, Succeeds());
  ASSERT_EQ(workers->size(), 2);
  EXPECT_EQ((*workers)[0].name, "host:1");
  const HeldWork& work = (*workers)[0].work.at(0);
  EXPECT_EQ(work.subject, "animations/a");
  EXPECT_EQ(work.stage, "reading");
  EXPECT_GE(work.last_heartbeat, work.since);
  EXPECT_GT(work.since, absl::Now() - absl::Minutes(1));
  EXPECT_GT(work.lease_expires, absl::Now());
  const json printed = json::parse(Print(*workers, absl::Now(), Format::kJson));
  EXPECT_EQ(printed["workers"][1]["worker"], "host:2");
  EXPECT_EQ(printed["workers"][0]["work"][0]["fraction"], 0.25);
  EXPECT_THAT(Print(*workers, absl::Now() + absl::Minutes(5), Format::kText),
              AllOf(HasSubstr("animations/a, 25 % of it, reading, for 5m"),
                    HasSubstr("lease has expired"), HasSubstr("2 workers at work, 0 idle")));
}

TEST_F(JobsTest, WorkersShowThatWaitForWork) {
  data_.SubmitImport("a");
  data_.TakeJob();
  const int64_t memory_bytes = int64_t{2} << 30;
  // A handle each, as workers have.
  for (const auto& [name, memory] :
       {std::pair("host:2", memory_bytes), std::pair("host:3", store::kAnyMemory)}) {
    const TestedStore other(data_.location());
    const auto lease = other.catalog().LeaseJob(name, absl::Minutes(1), memory);
    ASSERT_TRUE(lease.ok() && !lease->has_value());
  }
  const auto workers = InspectWorkers(data_.catalog());
  ASSERT_THAT(workers, Succeeds());
  const json printed = json::parse(Print(*workers, absl::Now(), Format::kJson));
  ASSERT_EQ(printed["workers"].size(), 3);
  EXPECT_EQ(printed["workers"][0]["work"].size(), 1);
  EXPECT_EQ(printed["workers"][1]["worker"], "host:2");
  EXPECT_EQ(printed["workers"][1]["memory_bytes"], memory_bytes);
  EXPECT_TRUE(printed["workers"][1]["work"].empty());
  EXPECT_GT((*workers)[1].last_seen, absl::Now() - absl::Minutes(1));
  EXPECT_THAT(Print(*workers, (*workers)[1].last_seen + absl::Seconds(7), Format::kText),
              AllOf(testing::ContainsRegex("host:2 +idle, seen 7s ago, takes jobs up to 2.1 GB\n"),
                    testing::ContainsRegex("host:3 +idle, seen [0-9]+s ago, takes any job\n"),
                    HasSubstr("1 workers at work, 2 idle")));
}

TEST_F(JobsTest, WorkersShowWhyTheyTakeNoJobs) {
  store::pb::WorkerRecord worker;
  worker.set_name("host:2");
  worker.set_memory_bytes(store::kAnyMemory);
  worker.set_refusal("S3 denies it");
  ASSERT_THAT(data_.catalog().RecordWorker(worker), Succeeds());
  const auto workers = InspectWorkers(data_.catalog());
  ASSERT_THAT(workers, Succeeds());
  EXPECT_EQ(json::parse(Print(*workers, absl::Now(), Format::kJson))["workers"][0]["refusal"],
            "S3 denies it");
  EXPECT_THAT(Print(*workers, absl::Now(), Format::kText),
              AllOf(HasSubstr("takes no jobs for now"), HasSubstr(": S3 denies it\n"),
                    HasSubstr("0 workers at work, 0 idle, 1 refused")));
}

TEST_F(JobsTest, OwnersShowWithWhatTheyHave) {
  EXPECT_EQ(Print(*data_.catalog().ListOwners(), Format::kText), "0 owners\n");
  store::pb::AnimationRecord animation;
  animation.set_id("a");
  store::pb::JobRecord job;
  job.set_owner("studio");
  job.mutable_import_animation()->set_animation("a");
  job.mutable_import_animation()->add_files()->set_size_bytes(2'000'000);
  ASSERT_THAT(data_.catalog().SubmitImport(animation, job), Succeeds());
  data_.SubmitImport("b");
  const auto owners = data_.catalog().ListOwners();
  ASSERT_THAT(owners, Succeeds());
  const json printed = json::parse(Print(*owners, Format::kJson));
  ASSERT_EQ(printed["owners"].size(), 2);
  EXPECT_EQ(printed["owners"][1], (json{{"owner", "studio"},
                                        {"stored_bytes", 2'000'000},
                                        {"queued_jobs", 1},
                                        {"animations", 1},
                                        {"families", 0}}));
  EXPECT_THAT(Print(*owners, Format::kText),
              AllOf(testing::ContainsRegex("\\(nobody\\) .* 1 jobs not done"),
                    testing::ContainsRegex("studio +2.0 MB, 1 animations, 0 families, 1 jobs"),
                    HasSubstr("2 owners\n")));
}

}  // namespace
}  // namespace liquidblend::admin
