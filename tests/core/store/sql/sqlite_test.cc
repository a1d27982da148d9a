#include "core/store/sql/sqlite.h"

#include <sqlite3.h>

#include <new>

#include "absl/cleanup/cleanup.h"
#include "core/base/retry.h"
#include "tests/core/store/store_testing.h"

namespace liquidblend::store {
namespace {

using Code = absl::StatusCode;

class SqliteTest : public ::testing::Test {
 protected:
  std::unique_ptr<Database> Open(absl::Duration busy_timeout = absl::Seconds(10)) {
    auto db = Database::Open(path_, busy_timeout);
    EXPECT_THAT(db, Succeeds());
    return db.ok() ? *std::move(db) : nullptr;
  }

  int64_t Int(Database& db, absl::string_view sql) {
    int64_t result = -1;
    EXPECT_THAT(db.Run(sql, {},
                       [&](const SqlRow& row) {
                         result = row.Int(0);
                         return absl::OkStatus();
                       }),
                Succeeds());
    return result;
  }

  TemporaryFolder folder_;
  std::string path_ = folder_.path() + "/test.db";
};

TEST_F(SqliteTest, WritesAheadAndFlushesEachCommit) {
  const auto db = Open();
  std::string mode;
  EXPECT_THAT(db->Run("PRAGMA journal_mode", {},
                      [&](const SqlRow& row) {
                        mode = row.String(0);
                        return absl::OkStatus();
                      }),
              Succeeds());
  EXPECT_EQ(mode, "wal");
  EXPECT_EQ(Int(*db, "PRAGMA synchronous"), 2);  // FULL
}

TEST_F(SqliteTest, KeepsValuesAsTheyAre) {
  const auto db = Open();
  ASSERT_THAT(db->RunScript("CREATE TABLE t (a INTEGER, b TEXT, c BLOB, d TEXT)"), Succeeds());
  const std::string odd("\0\xff'\"x", 5);
  ASSERT_THAT(db->Run("INSERT INTO t VALUES (?, ?, ?, ?)",
                      {int64_t{-5000000000}, std::string("Wasser"), Bytes{odd}, nullptr}),
              Succeeds());
  int num_rows = 0;
  EXPECT_THAT(db->Run("SELECT * FROM t", {},
                      [&](const SqlRow& row) {
                        ++num_rows;
                        EXPECT_EQ(row.Int(0), -5000000000);
                        EXPECT_EQ(row.String(1), "Wasser");
                        EXPECT_EQ(row.String(2), odd);
                        EXPECT_EQ(row.String(3), "");
                        return absl::OkStatus();
                      }),
              Succeeds());
  EXPECT_EQ(num_rows, 1);
}

TEST_F(SqliteTest, UndoesATransactionThatFails) {
  const auto db = Open();
  ASSERT_THAT(db->RunScript("CREATE TABLE t (a INTEGER UNIQUE)"), Succeeds());
  const absl::Status failed = db->Transaction([&]() -> absl::Status {
    EXPECT_THAT(db->Run("INSERT INTO t VALUES (1)"), Succeeds());
    return absl::AbortedError("no");
  });
  EXPECT_THAT(failed, Fails(Code::kAborted, "no"));
  EXPECT_EQ(Int(*db, "SELECT COUNT(*) FROM t"), 0);
  EXPECT_THAT(db->Transaction([&] { return db->Run("INSERT INTO t VALUES (1)"); }), Succeeds());
  EXPECT_THAT(db->Transaction([&] { return db->Run("INSERT INTO t VALUES (1)"); }),
              Fails(Code::kInternal, path_));
  EXPECT_EQ(Int(*db, "SELECT COUNT(*) FROM t"), 1);
}

TEST_F(SqliteTest, UndoesATransactionWhoseBodyThrows) {
  const auto db = Open();
  const auto other = Open(absl::ZeroDuration());
  ASSERT_THAT(db->RunScript("CREATE TABLE t (a INTEGER)"), Succeeds());
  EXPECT_THROW(db->Transaction([&]() -> absl::Status {
                   EXPECT_THAT(db->Run("INSERT INTO t VALUES (1)"), Succeeds());
                   throw std::bad_alloc();
                 }).IgnoreError(),
               std::bad_alloc);
  EXPECT_THAT(other->Transaction([&] { return other->Run("INSERT INTO t VALUES (2)"); }),
              Succeeds());
  EXPECT_THAT(db->Transaction([&] { return db->Run("INSERT INTO t VALUES (3)"); }), Succeeds());
  EXPECT_EQ(Int(*db, "SELECT COUNT(*) FROM t"), 2);
}

TEST_F(SqliteTest, NamesALockedDatabase) {
  const auto one = Open();
  const auto other = Open(absl::ZeroDuration());
  EXPECT_THAT(one->Transaction([&] {
    EXPECT_THAT(other->Transaction([] { return absl::OkStatus(); }),
                Fails(Code::kUnavailable, path_ + ": run: database is locked"));
    return absl::OkStatus();
  }),
              Succeeds());
  EXPECT_THAT(other->Transaction([] { return absl::OkStatus(); }), Succeeds());
}

TEST_F(SqliteTest, NamesAFullDatabase) {
  const auto db = Open();
  ASSERT_THAT(db->RunScript("CREATE TABLE t (a BLOB); PRAGMA max_page_count = 8"), Succeeds());
  EXPECT_THAT(db->Run("INSERT INTO t VALUES (?)", {Bytes{SampleBytes(100000)}}),
              Fails(Code::kResourceExhausted, path_ + ": run: database or disk is full"));
  EXPECT_TRUE(base::IsTransient(db->Run("INSERT INTO t VALUES (?)", {Bytes{SampleBytes(100000)}})));
  EXPECT_THAT(db->Run("INSERT INTO t VALUES (?)", {Bytes{"little"}}), Succeeds());
}

// A job that meets it is tried again.
TEST_F(SqliteTest, RunningOutOfMemoryIsOfTheEnvironment) {
  const auto db = Open();
  ASSERT_THAT(db->RunScript("CREATE TABLE t (a BLOB)"), Succeeds());
  absl::Status status;
  {
    sqlite3_hard_heap_limit64(sqlite3_memory_used() + (1 << 16));
    const absl::Cleanup no_limit = [] { sqlite3_hard_heap_limit64(0); };
    status = db->Run("INSERT INTO t VALUES (?)", {Bytes{SampleBytes(1 << 20)}});
  }
  EXPECT_THAT(status, Fails(Code::kResourceExhausted, path_ + ": run: out of memory"));
  EXPECT_TRUE(base::IsTransient(status));
  EXPECT_THAT(db->Run("INSERT INTO t VALUES (?)", {Bytes{SampleBytes(1 << 20)}}), Succeeds());
}

TEST_F(SqliteTest, NamesAFileThatIsNoDatabase) {
  WriteFile(path_, SampleBytes(10000));
  EXPECT_THAT(Database::Open(path_, absl::ZeroDuration()),
              Fails(Code::kDataLoss, path_ + ": prepare: file is not a database"));
}

TEST_F(SqliteTest, NamesAFileThatCannotBeMade) {
  const std::string path = folder_.path() + "/missing/test.db";
  EXPECT_THAT(Database::Open(path, absl::ZeroDuration()), Fails(Code::kUnavailable, path));
}

TEST_F(SqliteTest, NamesAStatementThatMakesNoSense) {
  EXPECT_THAT(Open()->Run("SELEKT 1"), Fails(Code::kInternal, "prepare: near \"SELEKT\""));
}

}  // namespace
}  // namespace liquidblend::store
