#include "core/store/catalog/worker_tables.h"

#include "core/base/status_macros.h"
#include "core/store/catalog/job_records.h"

namespace liquidblend::store {
namespace {

constexpr absl::Duration kKeptWorkers = absl::Hours(24);

}  // namespace

// The rows of others are removed by a worker that is new: only new names make the table grow.
absl::Status SaveWorker(Sql& sql, const pb::WorkerRecord& worker, absl::Time now) {
  bool is_known = false;
  LB_RETURN_IF_ERROR(
      sql.Run("UPDATE workers SET memory_bytes = $1, seen_us = $2, refusal = $3 WHERE name = $4 "
              "RETURNING name",
              {worker.memory_bytes(), absl::ToUnixMicros(now), worker.refusal(), worker.name()},
              [&](const SqlRow&) {
                is_known = true;
                return absl::OkStatus();
              }));
  if (is_known) return absl::OkStatus();
  LB_RETURN_IF_ERROR(sql.Run(
      "INSERT INTO workers (name, memory_bytes, seen_us, refusal) VALUES ($1, $2, $3, $4) ON "
      "CONFLICT (name) DO UPDATE SET memory_bytes = excluded.memory_bytes, seen_us = "
      "excluded.seen_us, refusal = excluded.refusal",
      {worker.name(), worker.memory_bytes(), absl::ToUnixMicros(now), worker.refusal()}));
  const int64_t oldest_us = absl::ToUnixMicros(now - kKeptWorkers);
  return sql.Run("DELETE FROM workers WHERE seen_us < $1", {oldest_us});
}

absl::StatusOr<std::vector<pb::WorkerRecord>> FindWorkers(Sql& sql, absl::Time since) {
  std::vector<pb::WorkerRecord> workers;
  const auto take = [&](const SqlRow& row) {
    pb::WorkerRecord& worker = workers.emplace_back();
    worker.set_name(row.String(0));
    worker.set_memory_bytes(row.Int(1));
    *worker.mutable_seen_time() = ToTimestamp(absl::FromUnixMicros(row.Int(2)));
    worker.set_refusal(row.String(3));
    return absl::OkStatus();
  };
  LB_RETURN_IF_ERROR(sql.Run(
      "SELECT name, memory_bytes, seen_us, refusal FROM workers WHERE seen_us >= $1 ORDER BY name",
      {absl::ToUnixMicros(since)}, take));
  return workers;
}

}  // namespace liquidblend::store
