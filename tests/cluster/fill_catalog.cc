#include "tests/cluster/fill_catalog.h"

#include <algorithm>
#include <memory>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "core/base/status_macros.h"
#include "core/store/catalog/catalog_tables.h"
#include "core/store/sql/postgres.h"

namespace liquidblend::bench {
namespace {

constexpr int64_t kBlobsPerFamily = 10;
constexpr int64_t kRecordsPerTransaction = 1000;
constexpr int kFrames = 150;

// As long as a SHA-256, and different for each k.
std::string BlobName(int64_t k) {
  const auto bits = static_cast<uint64_t>(k);
  return absl::StrFormat("%016x%016x%016x%016x", bits * 0x9E3779B97F4A7C15u,
                         bits * 0xC2B2AE3D27D4EB4Fu, bits * 0x165667B19E3779F9u, bits);
}

std::string AnimationId(int64_t k) { return absl::StrCat("filled_", k); }

store::pb::AnimationRecord MakeAnimation(int64_t k) {
  store::pb::AnimationRecord animation;
  animation.set_id(AnimationId(k));
  animation.set_state(store::pb::AnimationRecord::READY);
  animation.set_blob(BlobName(k));
  animation.set_size_bytes(50'000'000);
  animation.set_num_vertices(50'000 * int64_t{kFrames});
  animation.set_num_triangles(100'000 * int64_t{kFrames});
  animation.set_owner(absl::StrCat("team_", k % 20));
  animation.mutable_manifest()->set_num_frames(kFrames);
  for (int frame = 0; frame < kFrames; ++frame) animation.mutable_manifest()->add_times(frame);
  return animation;
}

store::pb::FamilyRecord MakeFamily(int64_t k) {
  store::pb::FamilyRecord family;
  family.set_id(absl::StrCat("filled_family_", k));
  family.set_version(1);
  family.set_blob(BlobName(k));
  family.set_size_bytes(400'000'000);
  family.set_owner(absl::StrCat("team_", k % 20));
  return family;
}

// Adds the record of number k: a family of the two animations before it, or an animation.
absl::Status AddRecord(store::Sql& sql, int64_t k) {
  if (k % kBlobsPerFamily != kBlobsPerFamily - 1)
    return store::SaveAnimation(sql, MakeAnimation(k));
  const store::pb::FamilyRecord family = MakeFamily(k);
  LB_RETURN_IF_ERROR(store::SaveFamily(sql, family));
  return store::SetFamilyMembers(sql, family.id(), {AnimationId(k - 2), AnimationId(k - 1)});
}

absl::Status AddRecords(store::Sql& sql, int64_t begin, int64_t end) {
  for (int64_t k = begin; k < end; ++k) LB_RETURN_IF_ERROR(AddRecord(sql, k));
  return absl::OkStatus();
}

}  // namespace

absl::Status FillCatalog(const std::string& url, int64_t num_blobs) {
  LB_ASSIGN_OR_RETURN(const store::PostgresTarget target,
                      store::ParsePostgresUrl(url, absl::Seconds(10)));
  LB_ASSIGN_OR_RETURN(
      const std::unique_ptr<store::PostgresConnection> connection,
      store::PostgresConnection::Open(target, {.timeout = absl::Minutes(1), .now = {}}));
  LB_ASSIGN_OR_RETURN(const int64_t num_there,
                      store::QueryInt(*connection, "SELECT COUNT(*) FROM animations"));
  if (num_there > 0) return absl::OkStatus();
  for (int64_t begin = 0; begin < num_blobs; begin += kRecordsPerTransaction) {
    const int64_t end = std::min(num_blobs, begin + kRecordsPerTransaction);
    LB_RETURN_IF_ERROR(
        connection->Transaction([&] { return AddRecords(*connection, begin, end); }));
  }
  return connection->RunScript("ANALYZE");
}

}  // namespace liquidblend::bench
