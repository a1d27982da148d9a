// What every backend of BlobStore must do. A backend's test includes this and instantiates
// BlobStoreSuite with a function that makes one BlobBackend.
#pragma once

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "absl/time/clock.h"
#include "core/store/blobs/blob_store.h"
#include "core/store/blobs/content_hash.h"
#include "tests/core/store/store_testing.h"

namespace liquidblend::store {

// An empty place for blobs.
class BlobBackend {
 public:
  virtual ~BlobBackend() = default;
  // One more handle on the same place.
  virtual std::unique_ptr<BlobStore> Open() = 0;
  // Changes a byte of the stored blob behind the store's back.
  virtual void Damage(const BlobId& id) = 0;
};

class BlobStoreSuite : public ::testing::TestWithParam<std::unique_ptr<BlobBackend> (*)()> {
 protected:
  BlobId Put(const std::string& content) {
    auto id = PutBlob(*blobs_, AsBytes(content));
    EXPECT_THAT(id, Succeeds());
    return id.ok() ? *id : BlobId();
  }

  BlobId PutUpload(const std::string& content) {
    auto writer = blobs_->CreateUpload();
    EXPECT_THAT(writer, Succeeds());
    EXPECT_THAT((*writer)->Append(AsBytes(content)), Succeeds());
    auto id = (*writer)->Commit();
    EXPECT_THAT(id, Succeeds());
    return id.ok() ? *id : BlobId();
  }

  static BlobId Xxh3IdOf(const std::string& content) {
    BlobHasher hasher(HashKind::kXxh3_128);
    hasher.Add(AsBytes(content));
    return hasher.Id();
  }

  std::string Get(BlobStore& blobs, const BlobId& id) {
    auto blob = blobs.Open(id);
    EXPECT_THAT(blob, Succeeds());
    return blob.ok() ? AsString((*blob)->bytes()) : "";
  }

  std::vector<BlobId> ListIds() {
    auto infos = blobs_->List();
    EXPECT_THAT(infos, Succeeds());
    std::vector<BlobId> ids;
    if (infos.ok()) {
      for (const BlobInfo& info : *infos) ids.push_back(info.id);
    }
    return ids;
  }

  std::unique_ptr<BlobBackend> backend_ = GetParam()();
  std::unique_ptr<BlobStore> blobs_ = backend_->Open();
};

TEST_P(BlobStoreSuite, GivesBackWhatWasPut) {
  for (const size_t size : {size_t{0}, size_t{1}, size_t{63}, size_t{4096}, size_t{3} << 20}) {
    const std::string content = SampleBytes(size);
    EXPECT_TRUE(Get(*blobs_, Put(content)) == content) << size;
  }
}

TEST_P(BlobStoreSuite, JoinsWhatIsAppended) {
  const std::string content = SampleBytes(2500000);
  auto writer = blobs_->Create();
  ASSERT_THAT(writer, Succeeds());
  for (size_t begin = 0, size = 0; begin < content.size(); begin += size, size = size * 3 + 1) {
    ASSERT_THAT((*writer)->Append(AsBytes(content.substr(begin, size))), Succeeds());
  }
  const auto id = (*writer)->Commit();
  ASSERT_THAT(id, Succeeds());
  EXPECT_EQ(*id, Put(content));
  EXPECT_TRUE(Get(*blobs_, *id) == content);
}

TEST_P(BlobStoreSuite, NamesBlobsByTheirContent) {
  EXPECT_EQ(Put(""),  // from FIPS 180-4's examples
            "sha256-e3b0c44298fc1c149afbf4c8996fb92427ae41e4649b934ca495991b7852b855");
  EXPECT_EQ(Put("water"), Put("water"));
  EXPECT_NE(Put("water"), Put("Water"));
  EXPECT_TRUE(IsBlobId(Put("water")));
  EXPECT_EQ(ListIds().size(), 3);
}

TEST_P(BlobStoreSuite, ContentsThatCollideInXxh3AreTwoBlobs) {
  const auto [a, b] = CollidingContents();
  ASSERT_NE(a, b);
  ASSERT_EQ(Xxh3IdOf(a), Xxh3IdOf(b));
  const BlobId id_a = Put(a), id_b = Put(b);
  EXPECT_NE(id_a, id_b);
  EXPECT_TRUE(Get(*backend_->Open(), id_a) == a);
  EXPECT_TRUE(Get(*backend_->Open(), id_b) == b);
}

// ---- blobs of known ids, also of older stores

TEST_P(BlobStoreSuite, ReadsBlobsOfOlderStores) {
  const std::string content = SampleBytes(100000);
  const BlobId id = Xxh3IdOf(content), other = Put("water");
  ASSERT_THAT(PutBlobAs(*blobs_, id, AsBytes(content)), Succeeds());
  EXPECT_TRUE(Get(*backend_->Open(), id) == content);
  EXPECT_THAT(blobs_->Verify(id), Succeeds());
  EXPECT_EQ(ListIds(), (std::vector<BlobId>{other, id}));
  EXPECT_NE(Put(content), id);  // new blobs get new names
  backend_->Damage(id);
  EXPECT_THAT(backend_->Open()->Verify(id), Fails(absl::StatusCode::kDataLoss, id));
  EXPECT_THAT(blobs_->Quarantine(id), Succeeds());
  EXPECT_THAT(blobs_->Open(id), Fails(absl::StatusCode::kNotFound, id));
}

TEST_P(BlobStoreSuite, TakesNoOtherBytesForAKnownId) {
  for (const BlobId& id : {Xxh3IdOf("water"), Put("water")}) {
    EXPECT_THAT(blobs_->Delete(id), Succeeds());
    EXPECT_THAT(PutBlobAs(*blobs_, id, AsBytes("wine")), Fails(absl::StatusCode::kDataLoss, id));
    EXPECT_THAT(blobs_->Open(id), Fails(absl::StatusCode::kNotFound, id));
    EXPECT_THAT(PutBlobAs(*blobs_, id, AsBytes("water")), Succeeds());
    EXPECT_EQ(Get(*blobs_, id), "water");
  }
}

TEST_P(BlobStoreSuite, NeverReplacesAWholeBlobByOneThatCollides) {
  const auto [a, b] = CollidingContents();
  const BlobId id = Xxh3IdOf(a);
  ASSERT_THAT(PutBlobAs(*blobs_, id, AsBytes(a)), Succeeds());
  EXPECT_THAT(PutBlobAs(*backend_->Open(), id, AsBytes(b)),
              Fails(absl::StatusCode::kAlreadyExists, "other content with the same hash"));
  EXPECT_TRUE(Get(*backend_->Open(), id) == a);
  EXPECT_THAT(PutBlobAs(*blobs_, id, AsBytes(a)), Succeeds());
}

// ---- files of uploads

TEST_P(BlobStoreSuite, FilesOfUploadsAreSharedWithNobody) {
  const BlobId blob = Put("water");
  const BlobId first = PutUpload("water"), second = PutUpload("water");
  for (const BlobId& id : {first, second}) {
    EXPECT_TRUE(IsUploadId(id)) << id;
    EXPECT_EQ(ContentIdOf(id), blob);
    EXPECT_EQ(Get(*backend_->Open(), id), "water");
    EXPECT_THAT(blobs_->Verify(id), Succeeds());
  }
  EXPECT_EQ(ListIds(),
            (std::vector<BlobId>{blob, std::min(first, second), std::max(first, second)}));
  EXPECT_THAT(blobs_->Delete(first), Succeeds());
  EXPECT_THAT(blobs_->Open(first), Fails(absl::StatusCode::kNotFound, first));
  EXPECT_EQ(Get(*backend_->Open(), second), "water");
  EXPECT_EQ(Get(*backend_->Open(), blob), "water");
  EXPECT_THAT(blobs_->DeleteIfNotNewer(second, absl::InfiniteFuture()), Succeeds());
  EXPECT_EQ(ListIds(), std::vector<BlobId>{blob});
}

TEST_P(BlobStoreSuite, SaysWhichBlobIsMissing) {
  for (const BlobId& id :
       {BlobId("xxh3-00000000000000000000000000000000"), "sha256-" + std::string(64, '0'),
        "sha256-" + std::string(64, '0') + "-" + std::string(32, '1')}) {
    EXPECT_THAT(blobs_->Open(id), Fails(absl::StatusCode::kNotFound, id));
  }
}

TEST_P(BlobStoreSuite, KeepsTheMarkOfACatalogApartFromBlobs) {
  EXPECT_EQ(*blobs_->ReadCatalogId(), "");
  ASSERT_THAT(blobs_->WriteCatalogId("one"), Succeeds());
  ASSERT_THAT(blobs_->WriteCatalogId("two"), Succeeds());
  EXPECT_EQ(*backend_->Open()->ReadCatalogId(), "two");
  EXPECT_THAT(ListIds(), ::testing::IsEmpty());
}

TEST_P(BlobStoreSuite, RefusesWhatIsNoBlobId) {
  for (const std::string id :
       {"", "water", "../../etc/passwd", "xxh3-", "xxh3-0000000000000000000000000000000",
        "xxh3-000000000000000000000000000000000", "xxh3-0000000000000000000000000000000G",
        "xxh3-0000000000000000000000000000000A", "xxh3-../../00000000000000000000000000",
        "xxh2-00000000000000000000000000000000", "sha256-00000000000000000000000000000000",
        "xxh3-0000000000000000000000000000000000000000000000000000000000000000"}) {
    EXPECT_FALSE(IsBlobId(id));
    EXPECT_THAT(blobs_->Open(id), Fails(absl::StatusCode::kInvalidArgument, "not a blob id"));
    EXPECT_THAT(blobs_->Delete(id), Fails(absl::StatusCode::kInvalidArgument, "not a blob id"));
    EXPECT_THAT(blobs_->Verify(id), Fails(absl::StatusCode::kInvalidArgument, "not a blob id"));
    EXPECT_THAT(blobs_->Quarantine(id), Fails(absl::StatusCode::kInvalidArgument, "not a blob id"));
    EXPECT_THAT(blobs_->CreateAs(id), Fails(absl::StatusCode::kInvalidArgument, "not a blob id"));
    EXPECT_THAT(blobs_->DeleteIfNotNewer(id, absl::InfiniteFuture()),
                Fails(absl::StatusCode::kInvalidArgument, "not a blob id"));
  }
}

TEST_P(BlobStoreSuite, ShowsNothingBeforeCommit) {
  auto writer = blobs_->Create();
  ASSERT_THAT(writer, Succeeds());
  ASSERT_THAT((*writer)->Append(AsBytes(SampleBytes(100000))), Succeeds());
  EXPECT_TRUE(ListIds().empty());
  writer->reset();
  EXPECT_TRUE(ListIds().empty());
}

TEST_P(BlobStoreSuite, CommitsOnce) {
  auto writer = blobs_->Create();
  ASSERT_THAT(writer, Succeeds());
  ASSERT_THAT((*writer)->Commit(), Succeeds());
  EXPECT_THAT((*writer)->Commit(), Fails(absl::StatusCode::kFailedPrecondition, "already"));
  EXPECT_THAT((*writer)->Append(AsBytes("more")),
              Fails(absl::StatusCode::kFailedPrecondition, "already"));
}

TEST_P(BlobStoreSuite, DeletedBlobsStayReadableWhereTheyAreOpen) {
  const std::string content = SampleBytes(300000);
  const BlobId id = Put(content);
  const auto blob = blobs_->Open(id);
  ASSERT_THAT(blob, Succeeds());
  EXPECT_THAT(blobs_->Delete(id), Succeeds());
  EXPECT_THAT(blobs_->Open(id), Fails(absl::StatusCode::kNotFound, id));
  EXPECT_TRUE(ListIds().empty());
  EXPECT_TRUE(AsString((*blob)->bytes()) == content);
  EXPECT_THAT(blobs_->Delete(id), Succeeds());
}

TEST_P(BlobStoreSuite, BlobsOutliveTheStoreThatOpenedThem) {
  const std::string content = SampleBytes(300000);
  const auto blob = blobs_->Open(Put(content));
  ASSERT_THAT(blob, Succeeds());
  blobs_.reset();
  EXPECT_TRUE(AsString((*blob)->bytes()) == content);
}

TEST_P(BlobStoreSuite, ListsInTheOrderOfIdsWithSizesAndTimes) {
  const absl::Time before = absl::Now() - absl::Minutes(1);  // clocks of file systems are coarse
  std::vector<BlobId> ids;
  for (int k = 0; k < 20; ++k) ids.push_back(Put(SampleBytes(static_cast<size_t>(k), 7)));
  std::sort(ids.begin(), ids.end());
  EXPECT_EQ(ListIds(), ids);
  const auto infos = blobs_->List();
  ASSERT_THAT(infos, Succeeds());
  int64_t sum = 0;
  for (const BlobInfo& info : *infos) {
    sum += info.size_bytes;
    EXPECT_GT(info.modified, before);
    EXPECT_LT(info.modified, absl::Now() + absl::Minutes(1));
  }
  EXPECT_EQ(sum, 19 * 20 / 2);
}

TEST_P(BlobStoreSuite, NoticesDamage) {
  for (const size_t size : {size_t{1}, size_t{100}, size_t{2} << 20}) {
    const BlobId id = Put(SampleBytes(size));
    backend_->Damage(id);
    EXPECT_THAT(blobs_->Open(id), Fails(absl::StatusCode::kDataLoss, id));
    EXPECT_EQ(Put(SampleBytes(size)), id);  // and putting it again repairs it
    EXPECT_THAT(blobs_->Open(id), Succeeds());
  }
}

TEST_P(BlobStoreSuite, VerifiesWhatIsKeptAndNotACopy) {
  const BlobId id = Put(SampleBytes(100000));
  EXPECT_THAT(blobs_->Verify(id), Succeeds());
  backend_->Damage(id);
  EXPECT_THAT(blobs_->Verify(id), Fails(absl::StatusCode::kDataLoss, id));
  EXPECT_THAT(blobs_->Delete(id), Succeeds());
  EXPECT_THAT(blobs_->Verify(id), Fails(absl::StatusCode::kNotFound, id));
}

TEST_P(BlobStoreSuite, MovesADamagedBlobOutOfTheWay) {
  const BlobId id = Put(SampleBytes(100000));
  EXPECT_THAT(blobs_->Quarantine(id), Fails(absl::StatusCode::kFailedPrecondition, "is whole"));
  backend_->Damage(id);
  const auto aside = blobs_->Quarantine(id);
  ASSERT_THAT(aside, Succeeds());
  EXPECT_THAT(*aside, ::testing::HasSubstr("quarantine/" + id));
  EXPECT_THAT(blobs_->Open(id), Fails(absl::StatusCode::kNotFound, id));
  EXPECT_THAT(ListIds(), ::testing::IsEmpty());
  EXPECT_THAT(blobs_->Quarantine(id), Fails(absl::StatusCode::kNotFound, id));
  EXPECT_EQ(Put(SampleBytes(100000)), id);
  EXPECT_THAT(backend_->Open()->Open(id), Succeeds());
}

TEST_P(BlobStoreSuite, DeletesOnlyWhatIsAsOldAsItIsSaidToBe) {
  const BlobId id = Put("water");
  const auto infos = blobs_->List();
  ASSERT_THAT(infos, Succeeds());
  const absl::Time modified = infos->front().modified;
  auto is_gone = blobs_->DeleteIfNotNewer(id, modified - absl::Seconds(1));
  ASSERT_THAT(is_gone, Succeeds());
  EXPECT_FALSE(*is_gone);
  EXPECT_EQ(Get(*blobs_, id), "water");
  for (int call = 0; call < 2; ++call) {
    is_gone = blobs_->DeleteIfNotNewer(id, modified);
    ASSERT_THAT(is_gone, Succeeds());
    EXPECT_TRUE(*is_gone);
    EXPECT_THAT(blobs_->Open(id), Fails(absl::StatusCode::kNotFound, id));
  }
}

TEST_P(BlobStoreSuite, IsSharedBySeveralHandles) {
  const auto other = backend_->Open();
  const BlobId id = Put("water");
  EXPECT_EQ(Get(*other, id), "water");
  EXPECT_THAT(other->Delete(id), Succeeds());
  EXPECT_THAT(blobs_->Open(id), Fails(absl::StatusCode::kNotFound, id));
}

TEST_P(BlobStoreSuite, ThreadsMayPutTheSameBlobAtOnce) {
  const std::string content = SampleBytes(200000);
  std::vector<std::thread> threads;
  std::vector<absl::Status> statuses(4);
  for (absl::Status& status : statuses) {
    threads.emplace_back([&] {
      for (int k = 0; k < 5 && status.ok(); ++k) {
        const auto id = PutBlob(*blobs_, AsBytes(content));
        status = id.ok() ? blobs_->Open(*id).status() : id.status();
      }
    });
  }
  for (std::thread& thread : threads) thread.join();
  for (const absl::Status& status : statuses) EXPECT_THAT(status, Succeeds());
  EXPECT_EQ(ListIds().size(), 1);
}

}  // namespace liquidblend::store
