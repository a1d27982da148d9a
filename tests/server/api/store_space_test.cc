#include "server/api/store_space.h"

#include <functional>
#include <string>
#include <vector>

#include "core/base/disk_space.h"
#include "server/api/upload.h"
#include "tests/server/backends_testing.h"

namespace liquidblend::server {
namespace {

using store::Fails;
using store::Succeeds;

constexpr auto kExhausted = absl::StatusCode::kResourceExhausted;
constexpr int64_t kMoreThanAnyDisk = int64_t{1} << 60;

class StoreSpaceTest : public RpcTest {
 protected:
  StoreSpaceTest() { limits_.disk = folder_.path(); }

  std::unique_ptr<Upload> Begin(const std::string& owner) {
    Caller caller;
    caller.principal.name = caller.principal.key = owner;
    return std::make_unique<Upload>(stores_, limits_, caller);
  }

  static absl::Status AddHeader(Upload& upload, const std::string& id,
                                const std::string& request_id = "") {
    v1::UploadAnimationRequest message;
    message.mutable_header()->set_animation_id(id);
    message.mutable_header()->set_request_id(request_id);
    return upload.Add(message);
  }

  static absl::Status AddFile(Upload& upload, int64_t size_bytes) {
    v1::UploadAnimationRequest message;
    message.mutable_file()->set_name("f.ply");
    message.mutable_file()->set_size_bytes(size_bytes);
    return upload.Add(message);
  }

  static absl::Status AddBytes(Upload& upload, int64_t size_bytes) {
    LB_RETURN_IF_ERROR(AddFile(upload, size_bytes));
    v1::UploadAnimationRequest message;
    message.set_chunk(std::string(static_cast<size_t>(size_bytes), 'x'));
    return upload.Add(message);
  }

  absl::Status Send(const std::string& owner, const std::string& id, int64_t size_bytes,
                    const std::string& request_id = "") {
    const auto upload = Begin(owner);
    LB_RETURN_IF_ERROR(AddHeader(*upload, id, request_id));
    LB_RETURN_IF_ERROR(AddBytes(*upload, size_bytes));
    return upload->Submit().status();
  }

  const store::TemporaryFolder folder_;
  UploadTally tally_;
  const UploadStores stores_ = {*catalog_, *blobs_, tally_};
  Limits limits_ = SmallLimits();
};

TEST_F(StoreSpaceTest, BelowTheReserveNothingIsAcceptedAndTheDiskIsNamed) {
  limits_.disk_reserve_bytes = kMoreThanAnyDisk;
  const absl::Status status = Send("ann", "a", 3);
  EXPECT_THAT(status, Fails(kExhausted, "the disk of '" + folder_.path() + "' has "));
  EXPECT_THAT(status, Fails(kExhausted, "are kept in reserve: delete animations"));
  EXPECT_EQ(ReasonOf(status), "DISK_RESERVE_REACHED");
  EXPECT_EQ(ReasonOf(CheckStoreSpace(*catalog_, *blobs_, limits_, {})), "DISK_RESERVE_REACHED");
  limits_.disk_reserve_bytes = 1;
  EXPECT_THAT(Send("ann", "a", 3), Succeeds());
  EXPECT_THAT(CheckStoreSpace(*catalog_, *blobs_, limits_, {}), Succeeds());
}

TEST_F(StoreSpaceTest, AFileThatWouldNotLeaveTheReserveIsRefusedBeforeItsBytes) {
  const auto disk = base::ReadDiskSpace(folder_.path());
  ASSERT_THAT(disk, Succeeds());
  EXPECT_GT(disk->free_bytes, 0);
  EXPECT_GE(disk->size_bytes, disk->free_bytes);
  limits_.max_upload_bytes = kMoreThanAnyDisk;
  limits_.disk_reserve_bytes = 1;
  const auto upload = Begin("ann");
  ASSERT_THAT(AddHeader(*upload, "a"), Succeeds());
  const absl::Status status = AddFile(*upload, 4 * disk->size_bytes);
  EXPECT_EQ(ReasonOf(status), "DISK_RESERVE_REACHED");
}

TEST_F(StoreSpaceTest, BytesThatOtherUploadsHaveYetToWriteCountForTheDisk) {
  const auto disk = base::ReadDiskSpace(folder_.path());
  ASSERT_THAT(disk, Succeeds());
  limits_.max_upload_bytes = kMoreThanAnyDisk;
  limits_.disk_reserve_bytes = 1;
  const int64_t most = disk->free_bytes / 4 * 3;
  auto first = Begin("ann"), second = Begin("ben"), third = Begin("cid");
  ASSERT_THAT(AddHeader(*first, "a"), Succeeds());
  ASSERT_THAT(AddHeader(*second, "b"), Succeeds());
  ASSERT_THAT(AddHeader(*third, "c"), Succeeds());
  ASSERT_THAT(AddFile(*first, most), Succeeds());
  EXPECT_EQ(ReasonOf(AddFile(*second, most)), "DISK_RESERVE_REACHED");
  first = nullptr;
  second = nullptr;
  EXPECT_EQ(tally_.AddUnwritten(0), 0);
  EXPECT_THAT(AddFile(*third, most), Succeeds());
}

TEST_F(StoreSpaceTest, BytesThatWereWrittenAreNotCountedTwice) {
  limits_.max_upload_bytes = kMoreThanAnyDisk;
  const auto upload = Begin("ann");
  ASSERT_THAT(AddHeader(*upload, "a"), Succeeds());
  ASSERT_THAT(AddBytes(*upload, 5), Succeeds());
  EXPECT_EQ(tally_.AddUnwritten(0), 0);
}

// A local store that notes for how much room it is asked.
class RoomyBlobs : public store::BlobStore {
 public:
  explicit RoomyBlobs(store::BlobStore& blobs) : blobs_(blobs) {}
  absl::StatusOr<std::unique_ptr<store::BlobWriter>> Create() override { return blobs_.Create(); }
  absl::StatusOr<std::unique_ptr<store::BlobWriter>> CreateAs(const store::BlobId& id) override {
    return blobs_.CreateAs(id);
  }
  absl::StatusOr<std::unique_ptr<store::BlobWriter>> CreateUpload() override {
    return blobs_.CreateUpload();
  }
  absl::StatusOr<std::shared_ptr<const store::Blob>> Open(const store::BlobId& id) override {
    return blobs_.Open(id);
  }
  absl::Status Verify(const store::BlobId& id) override { return blobs_.Verify(id); }
  absl::Status Delete(const store::BlobId& id) override { return blobs_.Delete(id); }
  absl::StatusOr<bool> DeleteIfNotNewer(const store::BlobId& id, absl::Time time) override {
    return blobs_.DeleteIfNotNewer(id, time);
  }
  absl::StatusOr<std::string> Quarantine(const store::BlobId& id) override {
    return blobs_.Quarantine(id);
  }
  absl::StatusOr<std::vector<store::BlobInfo>> List() override { return blobs_.List(); }
  absl::StatusOr<std::string> ReadCatalogId() override { return blobs_.ReadCatalogId(); }
  absl::Status WriteCatalogId(const std::string& id) override { return blobs_.WriteCatalogId(id); }
  absl::Status MakeRoom(int64_t free_bytes) override {
    asked.push_back(free_bytes);
    return absl::OkStatus();
  }

  std::vector<int64_t> asked;

 private:
  store::BlobStore& blobs_;
};

TEST_F(StoreSpaceTest, TheStoreMakesRoomBeforeAnythingIsRefused) {
  RoomyBlobs blobs(*blobs_);
  limits_.disk_reserve_bytes = 1;
  EXPECT_THAT(CheckDisk(blobs, limits_, 0), Succeeds());
  EXPECT_TRUE(blobs.asked.empty()) << "there is enough";
  limits_.disk_reserve_bytes = kMoreThanAnyDisk;
  EXPECT_EQ(ReasonOf(CheckDisk(blobs, limits_, 7)), "DISK_RESERVE_REACHED");
  EXPECT_THAT(blobs.asked, testing::ElementsAre(kMoreThanAnyDisk + 7));
}

TEST_F(StoreSpaceTest, ADiskThatCannotBeAskedRefusesNothing) {
  limits_.disk = folder_.path() + "/none";
  limits_.disk_reserve_bytes = kMoreThanAnyDisk;
  EXPECT_THAT(base::ReadDiskSpace(limits_.disk), Fails(absl::StatusCode::kNotFound, limits_.disk));
  EXPECT_THAT(Send("ann", "a", 3), Succeeds());
}

TEST_F(StoreSpaceTest, AllOwnersShareWhatMayBeStored) {
  limits_.max_stored_bytes = 10;
  EXPECT_THAT(Send("ann", "a", 6), Succeeds());
  const absl::Status status = Send("ben", "b", 5);
  EXPECT_THAT(status, Fails(kExhausted,
                            "all owners together may have 10 bytes stored and have 6; "
                            "5 more would be needed: delete animations"));
  EXPECT_EQ(ReasonOf(status), "STORE_FULL");
  EXPECT_THAT(Send("ben", "b", 4), Succeeds());
  const auto none = Begin("cid");
  EXPECT_EQ(ReasonOf(AddHeader(*none, "c")), "STORE_FULL") << "an upload does not even begin";
  EXPECT_EQ(ReasonOf(CheckStoreSpace(*catalog_, *blobs_, limits_, {})), "STORE_FULL");
}

TEST_F(StoreSpaceTest, UploadsSideBySideShareIt) {
  limits_.max_stored_bytes = 10;
  const auto first = Begin("ann"), second = Begin("ben");
  ASSERT_THAT(AddHeader(*first, "a"), Succeeds());
  ASSERT_THAT(AddHeader(*second, "b"), Succeeds());
  ASSERT_THAT(AddFile(*first, 6), Succeeds());
  EXPECT_EQ(ReasonOf(AddFile(*second, 5)), "STORE_FULL");
}

TEST_F(StoreSpaceTest, AnUploadThatOthersOvertookIsRefusedAtItsEnd) {
  limits_.max_stored_bytes = 10;
  const auto slow = Begin("ann");
  ASSERT_THAT(AddHeader(*slow, "a"), Succeeds());
  ASSERT_THAT(AddBytes(*slow, 6), Succeeds());
  UploadTally elsewhere;  // of another server
  {
    Upload other({*catalog_, *blobs_, elsewhere}, limits_);
    ASSERT_THAT(AddHeader(other, "b"), Succeeds());
    ASSERT_THAT(AddBytes(other, 6), Succeeds());
    ASSERT_THAT(other.Submit(), Succeeds());
  }
  EXPECT_EQ(ReasonOf(slow->Submit().status()), "STORE_FULL");
}

TEST_F(StoreSpaceTest, ARequestThatWasAcceptedBeforeIsAnsweredAlthoughNothingMoreFits) {
  limits_.max_stored_bytes = 6;
  ASSERT_THAT(Send("ann", "a", 6, "r1"), Succeeds());
  EXPECT_THAT(Send("ann", "a", 6, "r1"), Succeeds());
  limits_.disk_reserve_bytes = kMoreThanAnyDisk;
  EXPECT_THAT(Send("ann", "a", 6, "r1"), Succeeds());
  EXPECT_EQ(ReasonOf(Send("ann", "b", 6, "r2")), "DISK_RESERVE_REACHED");
}

}  // namespace
}  // namespace liquidblend::server
