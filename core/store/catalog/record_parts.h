// Reads of records in parts of bounded size, in any database.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "core/base/status_macros.h"
#include "core/store/sql/sql.h"

namespace liquidblend::store {

// Bytes of the records that one statement reads, unless a single record is longer. PostgreSQL hands
// over all rows of a statement at once, and a record takes several times its length in memory.
inline constexpr int64_t kPartBytes = int64_t{4} << 20;
inline constexpr int64_t kLengthsAtOnce = 10'000;

// Rows of a table in the order of a key, which is text or an integer. The first statement decides
// how many rows the second one reads; rows that change between the two may make it read a little
// more.
struct RecordRows {
  // Selects (key, length(record)) with the values (last key before, limit). Neither database reads
  // a long record for its length.
  std::string lengths;
  // Selects (key, ..) with the values (last key before, last key), in the same order.
  std::string records;
};

template <typename Key>
struct RecordLength {
  Key key;
  int64_t num_bytes = 0;
};

inline void ReadKey(const SqlRow& row, std::string& key) { key = row.String(0); }
inline void ReadKey(const SqlRow& row, int64_t& key) { key = row.Int(0); }

// The lengths of the next `limit` records.
template <typename Key>
absl::StatusOr<std::vector<RecordLength<Key>>> ReadLengths(Sql& sql, const RecordRows& rows,
                                                           const Key& before, int64_t limit) {
  std::vector<RecordLength<Key>> lengths;
  LB_RETURN_IF_ERROR(sql.Run(rows.lengths, {before, limit}, [&](const SqlRow& row) {
    ReadKey(row, lengths.emplace_back().key);
    lengths.back().num_bytes = row.Int(1);
    return absl::OkStatus();
  }));
  return lengths;
}

// The end of the part that begins at `begin`, of at most max_rows rows: at least one row, and all
// rows of its last key.
template <typename Key>
size_t EndOfPart(const std::vector<RecordLength<Key>>& lengths, size_t begin, size_t max_rows) {
  int64_t num_bytes = lengths[begin].num_bytes;
  size_t end = begin + 1;
  for (; end < lengths.size(); ++end) {
    num_bytes += lengths[end].num_bytes;
    const bool is_full = end - begin >= max_rows || num_bytes > kPartBytes;
    if (is_full && lengths[end].key != lengths[end - 1].key) break;
  }
  return end;
}

// Hands all rows after `before` to `each_row`.
template <typename Key>
absl::Status ReadInParts(Sql& sql, const RecordRows& rows, Key before, Sql::EachRow each_row) {
  while (true) {
    LB_ASSIGN_OR_RETURN(const std::vector<RecordLength<Key>> lengths,
                        ReadLengths(sql, rows, before, kLengthsAtOnce));
    for (size_t begin = 0; begin < lengths.size();) {
      begin = EndOfPart(lengths, begin, lengths.size());
      const Key& last = lengths[begin - 1].key;
      LB_RETURN_IF_ERROR(sql.Run(rows.records, {before, last}, each_row));
      before = last;
    }
    if (static_cast<int64_t>(lengths.size()) < kLengthsAtOnce) return absl::OkStatus();
  }
}

}  // namespace liquidblend::store
