// Lists and inspections of large catalogs in PostgreSQL.
#include "absl/strings/str_cat.h"
#include "core/base/data_limit.h"
#include "core/store/sql/postgres.h"
#include "tests/allocation_testing.h"
#include "tests/core/store/catalog/catalog_testing.h"
#include "tests/core/store/sql/postgres_server.h"

namespace liquidblend::store {
namespace {

class PostgresListsTest : public ::testing::Test {
 protected:
  std::unique_ptr<Catalog> MustOpen(const CatalogOptions& options = {}) {
    auto catalog = OpenPostgresCatalog(url_, options);
    EXPECT_THAT(catalog, Succeeds());
    return catalog.ok() ? *std::move(catalog) : nullptr;
  }

  std::unique_ptr<PostgresConnection> OpenConnection(absl::Duration timeout) {
    auto connection = PostgresConnection::Open(*ParsePostgresUrl(url_, timeout),
                                               PostgresOptions{.timeout = timeout, .now = {}});
    EXPECT_THAT(connection, Succeeds());
    return connection.ok() ? *std::move(connection) : nullptr;
  }

  void RunScript(const std::string& script) {
    EXPECT_THAT(OpenConnection(absl::Seconds(60))->RunScript(script), Succeeds());
  }

  PostgresServer& server_ = SharedPostgresServer();
  const std::string url_ = server_.NewUrl();
};

TEST_F(PostgresListsTest, FindsAPageOfRecordsByAnIndex) {
  MustOpen();
  RunScript(
      "INSERT INTO animations SELECT 'a' || k, 2, 'b', 'r', '', 0 FROM generate_series(1, 9000) "
      "AS k; "
      "INSERT INTO families SELECT 'f' || k, 1, 'b', 'r', '', 0 FROM generate_series(1, 9000) AS "
      "k; "
      "INSERT INTO jobs (id, state, subject, parent, ended_us, record) SELECT 'job-' || k, "
      "1 + k % 6, 'families/' || k, CASE k % 4 WHEN 0 THEN 'p' || k END, CASE k % 6 WHEN 2 THEN k "
      "END, 'r' FROM generate_series(1, 20000) AS k; ANALYZE animations, families, jobs");
  const auto plan = [&](const std::string& statement) {
    std::string text = server_.Run(url_, "EXPLAIN (FORMAT JSON) " + statement);
    EXPECT_THAT(text, ::testing::Not(::testing::HasSubstr("Seq Scan")));
    return text;
  };
  const auto plan_in_order = [&](const std::string& statement) {
    std::string text = plan(statement);
    EXPECT_THAT(text, ::testing::Not(::testing::HasSubstr("\"Sort\"")));
    return text;
  };
  using ::testing::ContainsRegex;
  using ::testing::HasSubstr;
  for (const std::string table : {"animations", "families"}) {
    EXPECT_THAT(plan_in_order("SELECT id, length(record) FROM " + table +
                              " WHERE id > 'a' ORDER BY id LIMIT 101"),
                HasSubstr(table + "_pkey"));
    EXPECT_THAT(
        plan("SELECT id, record FROM " + table + " WHERE id > 'f7' AND id <= 'f71' ORDER BY id"),
        HasSubstr(table + "_pkey"));
  }
  EXPECT_THAT(plan_in_order("SELECT number, length(record) FROM jobs WHERE parent IS NULL AND "
                            "number < 9223372036854775807 ORDER BY number DESC LIMIT 101"),
              ContainsRegex("jobs_pkey|jobs_by_parent"));
  EXPECT_THAT(plan_in_order("SELECT number, record FROM jobs WHERE parent IS NULL AND number < 700 "
                            "AND number >= 600 ORDER BY number DESC"),
              ContainsRegex("jobs_pkey|jobs_by_parent"));
  EXPECT_THAT(plan_in_order("SELECT number, length(record) FROM jobs WHERE ended_us > 7 "
                            "ORDER BY ended_us DESC LIMIT 1000"),
              HasSubstr("jobs_by_end"));
  EXPECT_THAT(plan("SELECT record FROM jobs WHERE number IN (7, 9, 13) ORDER BY ended_us DESC"),
              HasSubstr("jobs_pkey"));
  EXPECT_THAT(plan("SELECT subject, record FROM jobs WHERE state IN (1, 2, 6) AND parent IS NULL "
                   "AND subject > 'families/1' AND subject <= 'families/13' ORDER BY subject"),
              HasSubstr("jobs_unfinished_by_subject"));
}

// Reading a record takes 30 ms here, so that all of them take longer than a statement may.
TEST_F(PostgresListsTest, InspectsACatalogThatTakesLongerThanAStatementMay) {
  constexpr int kNumJobs = 100;
  CatalogOptions options;
  options.busy_timeout = absl::Seconds(2);
  CatalogContents contents;
  for (int k = 0; k < kNumJobs; ++k) {
    contents.jobs.push_back(ImportOf(absl::StrCat("a", k)));
    contents.jobs.back().set_id(absl::StrCat("job-", k));
    contents.jobs.back().set_state(pb::JobRecord::CANCELLED);
  }
  ASSERT_THAT(MustOpen()->Import(contents), Succeeds());
  const auto catalog = MustOpen(options);
  RunScript(
      "ALTER TABLE jobs RENAME TO fast_jobs; CREATE VIEW jobs AS SELECT number, id, state, "
      "subject, "
      "request_id, parent, CASE WHEN pg_sleep(0.03) IS NOT NULL THEN record END AS record FROM "
      "fast_jobs");
  EXPECT_THAT(catalog->ListJobs(1000, ""), Fails(absl::StatusCode::kUnavailable, "timeout"));
  const auto inspection = catalog->Inspect();
  ASSERT_THAT(inspection, Succeeds());
  EXPECT_THAT(inspection->damage, ::testing::IsEmpty());
  EXPECT_EQ(inspection->contents.jobs.size(), kNumJobs);
}

// 64 MB of records, twice that in the answer to one statement.
TEST_F(PostgresListsTest, ReadsASnapshotInParts) {
  LB_SKIP_UNLESS_ALLOCATIONS_MAY_FAIL();
  CatalogContents contents;
  for (int k = 0; k < 32; ++k) {
    pb::AnimationRecord& animation = contents.animations.emplace_back();
    animation.set_id(absl::StrCat("a", k));
    animation.mutable_error()->set_message(std::string(2'000'000, 'x'));
  }
  ASSERT_THAT(MustOpen()->Import(contents), Succeeds());
  const int status = RunChild([&] {
    const auto catalog = MustOpen();
    const base::ScopedDataLimit limit(int64_t{112} << 20);
    const auto inspection = catalog->Inspect();
    return limit.is_set() && inspection.ok() && inspection->contents.animations.size() == 32 ? 0
                                                                                             : 1;
  });
  EXPECT_EQ(status, 0);
}

TEST_F(PostgresListsTest, ASnapshotMayTakeLongerThanATransaction) {
  const auto connection = OpenConnection(absl::Milliseconds(700));
  const auto limits = [&] {
    std::string text;
    EXPECT_THAT(connection->Run("SELECT current_setting('statement_timeout') || ' ' || "
                                "current_setting('idle_in_transaction_session_timeout')",
                                {},
                                [&](const SqlRow& row) {
                                  text = row.String(0);
                                  return absl::OkStatus();
                                }),
                Succeeds());
    return text;
  };
  std::string inside;
  EXPECT_THAT(connection->Snapshot([&] {
    inside = limits();
    return absl::OkStatus();
  }),
              Succeeds());
  EXPECT_EQ(inside, "2min 2min");
  EXPECT_EQ(limits(), "700ms 700ms");
}

}  // namespace
}  // namespace liquidblend::store
