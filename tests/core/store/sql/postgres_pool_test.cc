#include "core/store/sql/postgres_pool.h"

#include <gtest/gtest.h>

#include <new>

#include "tests/core/store/sql/postgres_server.h"

namespace liquidblend::store {
namespace {

using Code = absl::StatusCode;

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

}  // namespace
}  // namespace liquidblend::store
