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
            "0 workers at work\n");
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
                    HasSubstr("lease has expired"), HasSubstr("2 workers at work")));
}

}  // namespace
}  // namespace liquidblend::admin
