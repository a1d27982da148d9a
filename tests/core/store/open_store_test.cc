#include "core/store/open_store.h"

#include <cstdlib>

#include "core/store/data_directory.h"
#include "tests/core/store/store_testing.h"

namespace liquidblend::store {
namespace {

using Code = absl::StatusCode;

TEST(OpenStore, OpensADataDirectory) {
  const TemporaryFolder folder;
  StoreLocation location;
  location.data = folder.path();
  const auto store = OpenStore(location);
  ASSERT_THAT(store, Succeeds());
  EXPECT_EQ(store->name, folder.path());
  EXPECT_TRUE(std::filesystem::exists(CatalogPath(folder.path())));
  EXPECT_THAT(PutBlob(*store->blobs, AsBytes("water")), Succeeds());
}

TEST(OpenStore, NamesTheFlagThatIsMissingOrTooMany) {
  StoreLocation location;
  EXPECT_THAT(OpenStore(location), Fails(Code::kInvalidArgument, "either --data DIR"));
  location.catalog_url = "postgresql://u:secret@h/d";
  EXPECT_THAT(OpenStore(location), Fails(Code::kInvalidArgument, "--blobs"));
  location.blobs_url = "s3://bucket";
  EXPECT_THAT(OpenStore(location), Fails(Code::kInvalidArgument, "--cache"));
  location.cache = "cache";
  location.data = "data";
  EXPECT_THAT(OpenStore(location), Fails(Code::kInvalidArgument, "either --data DIR"));
  location.catalog_url = "";
  EXPECT_THAT(OpenStore(location), Fails(Code::kInvalidArgument, "--blobs goes with --store"));
}

// The environment that a service's unit sets, whichever store its operator chooses.
TEST(OpenStore, TakesFromTheEnvironmentWhatGoesWithTheStore) {
  setenv("LIQUIDBLEND_DATA", "the data", 1);
  setenv("LIQUIDBLEND_CACHE", "the cache", 1);
  StoreLocation local, shared, said;
  shared.catalog_url = "postgresql://u@h/d";
  shared.blobs_url = "s3://bucket";
  said.data = "said";
  for (StoreLocation* const location : {&local, &shared, &said}) {
    TakeFromEnvironment(*location);
    EXPECT_THAT(location->Validate(), Succeeds());
  }
  EXPECT_EQ(local.data, "the data");
  EXPECT_EQ(shared.cache, "the cache");
  EXPECT_EQ(said.data, "said");
  unsetenv("LIQUIDBLEND_DATA");
  unsetenv("LIQUIDBLEND_CACHE");
}

TEST(CheckReachable, IsOkWhereBothAnswer) {
  const TemporaryFolder folder;
  StoreLocation location;
  location.data = folder.path();
  const auto store = OpenStore(location);
  ASSERT_THAT(store, Succeeds());
  EXPECT_THAT(CheckReachable(*store->catalog, *store->blobs), Succeeds());
}

}  // namespace
}  // namespace liquidblend::store
