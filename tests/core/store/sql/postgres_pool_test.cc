#include "core/store/sql/postgres_pool.h"

#include <gtest/gtest.h>

#include <new>

#include "tests/core/store/sql/postgres_server.h"

namespace liquidblend::store {
namespace {

using Code = absl::StatusCode;

std::string LockTimeout(Sql& sql) {
  std::string timeout;
  EXPECT_THAT(sql.Run("SHOW lock_timeout", {},
                      [&](const SqlRow& row) {
                        timeout = row.String(0);
                        return absl::OkStatus();
                      }),
              Succeeds());
  return timeout;
}

absl::Status ThrowBadAlloc() { throw std::bad_alloc(); }

class PostgresPoolTest : public ::testing::Test {
 protected:
  PostgresPool PoolOf(int max_connections) const {
    PostgresOptions options;
    options.timeout = absl::Seconds(5);
    return PostgresPool(*ParsePostgresUrl(url_, absl::Seconds(10)), options, max_connections);
  }

  const std::string url_ = SharedPostgresServer().NewUrl();
};

TEST_F(PostgresPoolTest, KeepsItsConnectionsIfABodyThrows) {
  PostgresPool pool = PoolOf(1);
  for (int n = 0; n < 3; ++n) {
    EXPECT_THROW(pool.Use([](PostgresConnection&) { return ThrowBadAlloc(); }).IgnoreError(),
                 std::bad_alloc);
  }
  EXPECT_THAT(pool.Use([](PostgresConnection& sql) { return sql.Run("SELECT 1"); }), Succeeds());
}

TEST_F(PostgresPoolTest, ATransactionWhoseBodyThrowsIsRolledBack) {
  const auto connection =
      PostgresConnection::Open(*ParsePostgresUrl(url_, absl::Seconds(10)), PostgresOptions());
  ASSERT_THAT(connection, Succeeds());
  PostgresConnection& sql = **connection;
  ASSERT_THAT(sql.RunScript("CREATE TABLE t (a INTEGER)"), Succeeds());
  EXPECT_THROW(sql.Transaction([&] {
                    EXPECT_THAT(sql.Run("INSERT INTO t VALUES (1)"), Succeeds());
                    return ThrowBadAlloc();
                  })
                   .IgnoreError(),
               std::bad_alloc);
  EXPECT_EQ(sql.for_update(), "") << "no transaction is open";
  EXPECT_EQ(*QueryInt(sql, "SELECT count(*) FROM t"), 0);
  EXPECT_THAT(sql.Transaction([&] { return sql.Run("INSERT INTO t VALUES (2)"); }), Succeeds());
  EXPECT_EQ(SharedPostgresServer().Run(url_, "SELECT count(*) FROM t"), "1");
}

TEST_F(PostgresPoolTest, ASnapshotStaysAsItWasAndChangesNothing) {
  PostgresPool pool = PoolOf(2);
  const auto count = [](Sql& sql) { return *QueryInt(sql, "SELECT count(*) FROM t"); };
  EXPECT_THAT(pool.Use([&](PostgresConnection& sql) -> absl::Status {
    LB_RETURN_IF_ERROR(sql.RunScript("CREATE TABLE t (a INTEGER)"));
    return sql.Snapshot([&] {
      EXPECT_EQ(count(sql), 0);
      EXPECT_EQ(sql.for_update(), "");
      EXPECT_THAT(
          pool.Use([](PostgresConnection& other) { return other.Run("INSERT INTO t VALUES (1)"); }),
          Succeeds());
      EXPECT_EQ(count(sql), 0);
      return absl::OkStatus();
    });
  }),
              Succeeds());
  EXPECT_THAT(pool.Use([&](PostgresConnection& sql) {
    EXPECT_EQ(count(sql), 1);
    return sql.Snapshot([&] { return sql.Run("INSERT INTO t VALUES (2)"); });
  }),
              ::testing::Not(Succeeds()));
}

TEST_F(PostgresPoolTest, ALockThatIsNotFreeInTimeIsNoError) {
  PostgresPool pool = PoolOf(2);
  const auto try_lock = [](PostgresConnection& sql) {
    absl::StatusOr<bool> is_locked = false;
    sql.Transaction([&] {
         is_locked = sql.TryLock("SELECT pg_advisory_xact_lock(1)", absl::Milliseconds(50));
         return is_locked.ok() && !*is_locked ? absl::UnavailableError("busy") : is_locked.status();
       })
        .IgnoreError();
    return *is_locked;
  };
  EXPECT_THAT(pool.Use([&](PostgresConnection& sql) {
    return sql.Transaction([&]() -> absl::Status {
      EXPECT_TRUE(*sql.TryLock("SELECT pg_advisory_xact_lock(1)", absl::Seconds(1)));
      EXPECT_EQ(LockTimeout(sql), "5s");  // of later statements
      return pool.Use([&](PostgresConnection& other) {
        EXPECT_FALSE(try_lock(other));
        EXPECT_EQ(LockTimeout(other), "5s");
        return absl::OkStatus();
      });
    });
  }),
              Succeeds());
  EXPECT_THAT(pool.Use([&](PostgresConnection& sql) {
    EXPECT_TRUE(try_lock(sql));
    return sql.Transaction([&] { return sql.TryLock("no statement", absl::Seconds(1)).status(); });
  }),
              Fails(Code::kInternal, "syntax error"));
}

}  // namespace
}  // namespace liquidblend::store
