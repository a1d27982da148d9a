// A data directory with animations, families and jobs in it.
#pragma once

#include <chrono>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/time/time.h"
#include "core/store/data_directory.h"
#include "core/store/files/files.h"
#include "core/store/open_store.h"
#include "tests/core/store/store_testing.h"
#include "tests/synthetic/families.h"

namespace liquidblend::admin {

using store::AsBytes;
using store::Fails;
using store::Succeeds;

// Work on any store, past servers and workers.
class TestedStore {
 public:
  explicit TestedStore(const store::StoreLocation& location) : location_(location) {
    auto opened = store::OpenStore(location);
    EXPECT_THAT(opened, Succeeds());
    if (opened.ok()) store_ = *std::move(opened);
  }

  const store::StoreLocation& location() const { return location_; }
  const store::Store& store() const { return store_; }
  store::Catalog& catalog() const { return *store_.catalog; }
  store::BlobStore& blobs() const { return *store_.blobs; }

  store::BlobId Put(const std::string& bytes) const {
    const auto id = store::PutBlob(blobs(), AsBytes(bytes));
    EXPECT_THAT(id, Succeeds());
    return id.ok() ? *id : "";
  }

  store::Lease TakeJob() const {
    auto lease = catalog().LeaseJob("host:1", absl::Minutes(1));
    EXPECT_THAT(lease, Succeeds());
    EXPECT_TRUE(lease.ok() && lease->has_value());
    return lease.ok() && lease->has_value() ? **lease : store::Lease();
  }

  // Queued, of one file; returns its blob.
  store::BlobId SubmitImport(const std::string& id) const {
    store::pb::AnimationRecord animation;
    animation.set_id(id);
    store::pb::JobRecord job;
    job.mutable_import_animation()->set_animation(id);
    store::BlobId file = Put("frames of " + id);
    job.mutable_import_animation()->add_files()->set_blob(file);
    EXPECT_THAT(catalog().SubmitImport(animation, job), Succeeds());
    return file;
  }

  // READY; returns its blob.
  store::BlobId MakeAnimation(const std::string& id) const {
    SubmitImport(id);
    store::pb::AnimationRecord animation;
    animation.set_id(id);
    animation.set_blob(Put("animation " + id));
    EXPECT_THAT(catalog().PublishAnimation(TakeJob().lease_id, animation), Succeeds());
    return animation.blob();
  }

  void SubmitRegistration(const std::string& family, const std::string& source,
                          const std::vector<std::string>& targets) const {
    store::pb::JobRecord job;
    job.mutable_register_family()->set_family(family);
    job.mutable_register_family()->set_source(source);
    for (const std::string& target : targets) job.mutable_register_family()->add_targets(target);
    EXPECT_THAT(catalog().SubmitRegistration(job), Succeeds());
  }

  // A new version of a -> b; returns its blob, a few kB that depend on the seed.
  store::BlobId MakeFamily(const std::string& id, uint64_t seed) const {
    SubmitRegistration(id, "a", {"b"});
    auto writer = blobs().Create();
    EXPECT_THAT(writer, Succeeds());
    synthetic::ComplexOptions options;
    options.num_frames = 2;
    EXPECT_THAT(
        store::WriteFamily(synthetic::MakeFamily(synthetic::HexahedralSphere(1, options),
                                                 {{synthetic::Noise(seed, 0.1F, 0.1F), {}}}),
                           **writer),
        Succeeds());
    store::pb::FamilyRecord family;
    family.set_id(id);
    family.set_blob(*(*writer)->Commit());
    EXPECT_THAT(catalog().PublishFamily(TakeJob().lease_id, family), Succeeds());
    return family.blob();
  }

  std::vector<store::BlobId> Present() const {
    std::vector<store::BlobId> ids;
    const auto blobs_now = blobs().List();
    EXPECT_THAT(blobs_now, Succeeds());
    for (const store::BlobInfo& blob : *blobs_now) ids.push_back(blob.id);
    return ids;
  }

 private:
  const store::StoreLocation location_;
  store::Store store_;
};

inline store::StoreLocation LocationIn(const std::string& directory) {
  store::StoreLocation location;
  location.data = directory;
  return location;
}

class AdminTest : public testing::Test {
 protected:
  std::string PathOf(const store::BlobId& id) const {
    return store::LocalBlobPath(folder_.path() + "/data", id);
  }

  // As if the blob had been committed so long ago.
  void Age(const store::BlobId& id, std::chrono::hours age) const {
    std::filesystem::last_write_time(PathOf(id),
                                     std::filesystem::file_time_type::clock::now() - age);
  }

  void Damage(const store::BlobId& id) const {
    std::string content = store::ReadFile(PathOf(id));
    content[content.size() / 2] = static_cast<char>(content[content.size() / 2] ^ 1);
    store::WriteFile(PathOf(id), content);
  }

  store::TemporaryFolder folder_;
  TestedStore data_{LocationIn(folder_.path() + "/data")};
};

}  // namespace liquidblend::admin
