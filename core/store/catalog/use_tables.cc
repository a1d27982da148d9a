#include "core/store/catalog/use_tables.h"

#include "core/base/status_macros.h"

namespace liquidblend::store {
namespace {

constexpr int64_t kKeptDays = 7;

int64_t DayOf(absl::Time time) { return absl::ToUnixSeconds(time) / (24 * 60 * 60); }

}  // namespace

// The rows are locked in the order of the map, the same in all programs.
absl::Status AddFamilyUses(Sql& sql, const std::map<std::string, int64_t>& num_frames,
                           absl::Time now) {
  const int64_t today = DayOf(now);
  for (const auto& [family, num] : num_frames) {
    LB_RETURN_IF_ERROR(
        sql.Run("INSERT INTO family_uses (family, day, num_frames) "
                "SELECT id, CAST($1 AS BIGINT), CAST($2 AS BIGINT) FROM families WHERE id = $3 "
                "ON CONFLICT (family, day) DO UPDATE "
                "SET num_frames = family_uses.num_frames + excluded.num_frames",
                {today, num, family}));
  }
  return sql.Run("DELETE FROM family_uses WHERE day <= $1", {today - kKeptDays});
}

// Days to come, by a clock that was set back, do not count.
absl::StatusOr<std::vector<UsedFamily>> FindMostUsedFamilies(Sql& sql, int max_num,
                                                             absl::Time now) {
  std::vector<UsedFamily> families;
  const auto take = [&](const SqlRow& row) {
    families.push_back({.id = row.String(0), .size_bytes = row.Int(1)});
    return absl::OkStatus();
  };
  const int64_t today = DayOf(now);
  LB_RETURN_IF_ERROR(
      sql.Run("SELECT families.id, families.stored_bytes FROM families JOIN "
              "(SELECT family, SUM(num_frames / ($1 - day + 1)) AS score FROM family_uses "
              "WHERE day <= $1 AND day > $2 GROUP BY family) AS uses ON uses.family = families.id "
              "WHERE families.version > 0 ORDER BY uses.score DESC, families.id LIMIT $3",
              {today, today - kKeptDays, int64_t{max_num}}, take));
  return families;
}

absl::Status RemoveFamilyUses(Sql& sql, const std::string& family) {
  return sql.Run("DELETE FROM family_uses WHERE family = $1", {family});
}

}  // namespace liquidblend::store
