#include "core/store/catalog/blob_tables.h"

#include <algorithm>
#include <cstdint>
#include <utility>

#include "absl/functional/function_ref.h"
#include "core/base/status_macros.h"
#include "core/store/catalog/catalog_tables.h"
#include "core/store/catalog/record_parts.h"

namespace liquidblend::store {
namespace {

constexpr int64_t kNamesAtOnce = 20'000;
constexpr int64_t kJobsAtOnce = 50;  // an import may have thousands of files, 130 bytes each

// Reads all rows of `statement`, which selects (key, value) with the values (last key, limit) in
// the order of the keys, in pages. All rows of one key are read in one statement: the last key of
// a page, which may have more rows, is read again with the next page.
//   first  lower than every key
template <typename Key>
absl::Status ReadInPages(Sql& sql, const std::string& statement, Key first, int64_t page_size,
                         absl::FunctionRef<absl::Status(const std::string&)> each) {
  Key last = std::move(first);
  for (int64_t limit = page_size; true;) {
    Key key = last, before = last;  // of the current row; the last one with all its rows
    int64_t num_rows = 0;
    LB_RETURN_IF_ERROR(sql.Run(statement, {last, limit}, [&](const SqlRow& row) {
      ++num_rows;
      const Key previous = key;
      ReadKey(row, key);
      if (key != previous) before = previous;
      return each(row.String(1));
    }));
    if (num_rows < limit) return absl::OkStatus();
    limit = before == last ? 2 * limit : page_size;  // more rows of one key than a page has
    last = std::move(before);
  }
}

constexpr char kSelectAnimations[] =
    "SELECT id, blob FROM animations WHERE id > $1 ORDER BY id LIMIT $2";
// One statement for a family and its kept versions, since publications and rollbacks move blobs
// from one to the other.
constexpr char kSelectFamilies[] =
    "SELECT family, blob FROM (SELECT id AS family, blob FROM families "
    "UNION ALL SELECT family, blob FROM kept_versions) AS versions "
    "WHERE family > $1 ORDER BY family LIMIT $2";
// One statement for jobs of all states, since a job may change its state at any time. Of each state
// jobs_by_state has them in the order of their numbers, which the inner limits make PostgreSQL use.
// The lowest number comes first, since a file that was sent directly may be named by a later job,
// too. Children are among them.
constexpr char kSelectJobs[] =
    "SELECT number, record FROM ("
    "SELECT * FROM (SELECT number, record FROM jobs WHERE state = 1 AND number > $1 "
    "ORDER BY number LIMIT $2) AS queued UNION ALL "
    "SELECT * FROM (SELECT number, record FROM jobs WHERE state = 2 AND number > $1 "
    "ORDER BY number LIMIT $2) AS running UNION ALL "
    "SELECT * FROM (SELECT number, record FROM jobs WHERE state = 6 AND number > $1 "
    "ORDER BY number LIMIT $2) AS waiting) AS unfinished "
    "ORDER BY number LIMIT $2";
// Those that are done have results.
constexpr char kSelectChildren[] =
    "SELECT parent, record FROM jobs WHERE parent > $1 ORDER BY parent LIMIT $2";

}  // namespace

absl::StatusOr<std::vector<std::string>> BlobsInUse(Sql& sql) {
  std::vector<std::string> blobs;
  const auto append_blob = [&](const std::string& blob) {
    if (!blob.empty()) blobs.push_back(blob);
    return absl::OkStatus();
  };
  const auto append_of_job = [&](const std::string& record) -> absl::Status {
    LB_ASSIGN_OR_RETURN(const pb::JobRecord job, ParseJob(sql, record));
    AddBlobsOf(job, blobs);
    return absl::OkStatus();
  };
  for (const char* statement : {kSelectAnimations, kSelectFamilies}) {
    LB_RETURN_IF_ERROR(ReadInPages(sql, statement, std::string(), kNamesAtOnce, append_blob));
  }
  LB_RETURN_IF_ERROR(ReadInPages(sql, kSelectJobs, int64_t{0}, kJobsAtOnce, append_of_job));
  LB_RETURN_IF_ERROR(ReadInPages(sql, kSelectChildren, std::string(), kJobsAtOnce, append_of_job));
  return blobs;
}

void AddBlobsOf(const pb::JobRecord& job, std::vector<std::string>& blobs) {
  const auto add = [&](const std::string& blob) {
    if (!blob.empty()) blobs.push_back(blob);
  };
  for (const pb::SourceFile& file : job.import_animation().files()) add(file.blob());
  add(job.checkpoint_blob());
  add(job.result_blob());
}

std::vector<std::string> SortedOnce(std::vector<std::string> blobs) {
  std::sort(blobs.begin(), blobs.end());
  blobs.erase(std::unique(blobs.begin(), blobs.end()), blobs.end());
  return blobs;
}

}  // namespace liquidblend::store
