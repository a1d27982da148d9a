#include "core/store/catalog/blob_tables.h"

#include <algorithm>
#include <cstdint>
#include <utility>

#include "absl/strings/str_cat.h"
#include "core/base/status_macros.h"
#include "core/store/catalog/catalog_tables.h"

namespace liquidblend::store {
namespace {

constexpr int64_t kRowsAtOnce = 20'000;

void Append(std::string blob, std::vector<std::string>& blobs) {
  if (!blob.empty()) blobs.push_back(std::move(blob));
}

// Of animations or families.
absl::Status AppendPublished(Sql& sql, absl::string_view table, std::vector<std::string>& blobs) {
  const std::string statement =
      absl::StrCat("SELECT id, blob FROM ", table, " WHERE id > $1 ORDER BY id LIMIT $2");
  std::string last;
  for (int64_t num_rows = kRowsAtOnce; num_rows == kRowsAtOnce;) {
    num_rows = 0;
    LB_RETURN_IF_ERROR(sql.Run(statement, {last, kRowsAtOnce}, [&](const SqlRow& row) {
      ++num_rows;
      last = row.String(0);
      Append(row.String(1), blobs);
      return absl::OkStatus();
    }));
  }
  return absl::OkStatus();
}

absl::Status AppendKept(Sql& sql, std::vector<std::string>& blobs) {
  std::string last;
  int64_t last_version = 0;
  for (int64_t num_rows = kRowsAtOnce; num_rows == kRowsAtOnce;) {
    num_rows = 0;
    LB_RETURN_IF_ERROR(sql.Run(
        "SELECT family, version, blob FROM kept_versions WHERE (family, version) > ($1, $2) "
        "ORDER BY family, version LIMIT $3",
        {last, last_version, kRowsAtOnce}, [&](const SqlRow& row) {
          ++num_rows;
          last = row.String(0);
          last_version = row.Int(1);
          Append(row.String(2), blobs);
          return absl::OkStatus();
        }));
  }
  return absl::OkStatus();
}

absl::Status AppendOfJobs(Sql& sql, std::vector<std::string>& blobs) {
  LB_ASSIGN_OR_RETURN(const std::vector<pb::JobRecord> jobs, FindUnfinishedJobs(sql));
  for (const pb::JobRecord& job : jobs) {
    for (const pb::SourceFile& file : job.import_animation().files()) Append(file.blob(), blobs);
    Append(job.checkpoint_blob(), blobs);
  }
  LB_ASSIGN_OR_RETURN(const std::vector<pb::JobRecord> children, FindAllChildren(sql));
  for (const pb::JobRecord& child : children) {
    Append(child.result_blob(), blobs);
    Append(child.checkpoint_blob(), blobs);
  }
  return absl::OkStatus();
}

}  // namespace

absl::StatusOr<std::vector<std::string>> BlobsInUse(Sql& sql) {
  std::vector<std::string> blobs;
  for (const char* table : {"animations", "families"}) {
    LB_RETURN_IF_ERROR(AppendPublished(sql, table, blobs));
  }
  LB_RETURN_IF_ERROR(AppendKept(sql, blobs));
  LB_RETURN_IF_ERROR(AppendOfJobs(sql, blobs));
  return blobs;
}

std::vector<std::string> SortedOnce(std::vector<std::string> blobs) {
  std::sort(blobs.begin(), blobs.end());
  blobs.erase(std::unique(blobs.begin(), blobs.end()), blobs.end());
  return blobs;
}

}  // namespace liquidblend::store
