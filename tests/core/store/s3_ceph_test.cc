// The blob store's suite against a real object store: tests/ceph.sh, which ctest starts before.
#include <algorithm>
#include <cstdlib>

#include "absl/strings/str_split.h"
#include "core/store/s3_blob_store.h"
#include "core/store/s3_client.h"
#include "tests/core/store/blob_store_suite.h"
#include "tests/core/store/ceph_environment.h"

namespace liquidblend::store {
namespace {

S3Options CephOptions() {
  for (const std::string& line : CephEnvironment()) {
    const std::pair<std::string, std::string> variable = absl::StrSplit(line, '=');
    setenv(variable.first.c_str(), variable.second.c_str(), 1);
  }
  S3Options options;
  options.part_bytes = int64_t{5} << 20;
  return options;
}

// A prefix of its own; each handle has its own cache.
class CephBackend : public BlobBackend {
 public:
  std::unique_ptr<BlobStore> Open() override {
    options_.cache_directory = absl::StrCat(folder_.path(), "/cache", num_handles_++);
    auto blobs = OpenS3BlobStore(url_, options_);
    EXPECT_THAT(blobs, Succeeds());
    return blobs.ok() ? *std::move(blobs) : nullptr;
  }

  void Damage(const BlobId& id) override {
    const std::string key = absl::StrCat("blobs/", id.substr(5, 2), "/", id);
    options_.cache_directory = folder_.path() + "/unused";
    const auto s3 = S3Client::Make(url_, options_);
    ASSERT_THAT(s3, Succeeds());
    const auto object = (*s3)->Find(key);
    ASSERT_THAT(object, Succeeds());
    const S3Client::Range whole = {0, object->size_bytes};
    auto content = (*s3)->Get(key, {&whole, 1});
    ASSERT_THAT(content, Succeeds());
    std::string& bytes = content->front();
    bytes[bytes.size() / 2] ^= 0x10;
    EXPECT_THAT((*s3)->Put(key, AsBytes(bytes)), Succeeds());
    for (int k = 0; k < num_handles_; ++k) {
      std::filesystem::remove(LocalBlobPath(absl::StrCat(folder_.path(), "/cache", k), id));
    }
  }

 private:
  TemporaryFolder folder_;
  S3Options options_ = CephOptions();
  // Characters that signatures and lists have to encode.
  const std::string url_ = "s3://liquidblend/" +
                           folder_.path().substr(folder_.path().rfind('/') + 1) +
                           "/a b+c&d=\xc3\xa4";
  int num_handles_ = 0;
};

INSTANTIATE_TEST_SUITE_P(Ceph, BlobStoreSuite,
                         ::testing::Values([]() -> std::unique_ptr<BlobBackend> {
                           return std::make_unique<CephBackend>();
                         }));

TEST(S3Ceph, SendsAndGetsLargeBlobsInParts) {
  CephBackend backend;
  const std::string content = SampleBytes((size_t{5} << 20) * 5 + 7);
  const auto id = PutBlob(*backend.Open(), AsBytes(content));
  ASSERT_THAT(id, Succeeds());
  const auto blob = backend.Open()->Open(*id);
  ASSERT_THAT(blob, Succeeds());
  EXPECT_TRUE(AsString((*blob)->bytes()) == content);
  EXPECT_EQ(backend.Open()->List()->size(), 1);
}

TEST(S3Ceph, SaysWhoRefusesWhat) {
  const TemporaryFolder folder;
  S3Options options = CephOptions();
  options.cache_directory = folder.path();
  EXPECT_THAT(OpenS3BlobStore("s3://no-such-bucket/x", options),
              Fails(absl::StatusCode::kNotFound, "NoSuchBucket"));
  options.secret_access_key = "wrong";
  EXPECT_THAT(OpenS3BlobStore("s3://liquidblend/x", options),
              Fails(absl::StatusCode::kPermissionDenied, "SignatureDoesNotMatch"));
}

}  // namespace
}  // namespace liquidblend::store
