#include "core/store/catalog/catalog_file.h"

#include "tests/core/store/store_testing.h"

namespace liquidblend::store::catalog_file_test {
namespace {

using Code = absl::StatusCode;

constexpr char kBlobA[] = "xxh3-0123456789abcdef0123456789abcdef";
constexpr char kBlobB[] = "xxh3-fedcba9876543210fedcba9876543210";

CatalogContents Sample() {
  CatalogContents contents;
  contents.animations.emplace_back().set_id("a");
  contents.animations.back().set_blob(kBlobA);
  contents.animations.emplace_back().set_id("b");
  contents.families.emplace_back().set_id("f");
  contents.members.emplace_back().set_family("f");
  contents.versions.emplace_back().set_last_version(7);
  contents.jobs.emplace_back().set_id("import-1");
  for (const char* blob : {kBlobB, kBlobA, "no blob"}) {
    contents.jobs.back().mutable_import_animation()->add_files()->set_blob(blob);
  }
  return contents;
}

std::string Written(const CatalogContents& contents) {
  MemoryWriter writer;
  EXPECT_THAT(WriteCatalogFile(contents, "/data", absl::FromUnixSeconds(1), writer), Succeeds());
  return writer.content;
}

TEST(CatalogFile, GivesBackTheRecords) {
  const std::string bytes = Written(Sample());
  const auto contents = ReadCatalogFile(AsBytes(bytes), "file");
  ASSERT_THAT(contents, Succeeds());
  ASSERT_EQ(contents->animations.size(), 2);
  EXPECT_EQ(contents->animations[0].blob(), kBlobA);
  EXPECT_EQ(contents->families.at(0).id(), "f");
  EXPECT_EQ(contents->members.at(0).family(), "f");
  EXPECT_EQ(contents->versions.at(0).last_version(), 7);
  EXPECT_EQ(contents->jobs.at(0).SerializeAsString(), Sample().jobs[0].SerializeAsString());
  EXPECT_EQ(Written(*contents), bytes);
}

TEST(CatalogFile, HasASectionOfKeptVersionsOnlyIfThereAreAny) {
  CatalogContents with_kept = Sample();
  with_kept.kept_versions.emplace_back().set_id("f");
  with_kept.kept_versions.back().set_version(6);
  const std::string bytes = Written(with_kept);
  const auto contents = ReadCatalogFile(AsBytes(bytes), "file");
  ASSERT_THAT(contents, Succeeds());
  EXPECT_EQ(contents->kept_versions.at(0).version(), 6);
  EXPECT_EQ(contents->jobs.size(), 1);
  EXPECT_THAT(bytes, testing::HasSubstr("kept_versions"));
  EXPECT_THAT(Written(Sample()), testing::Not(testing::HasSubstr("kept_versions")));
}

TEST(CatalogFile, NoticesEachByteThatChangesAndEachLengthThatIsNotItsOwn) {
  const std::string bytes = Written(Sample());
  for (size_t k = 0; k < bytes.size(); ++k) {
    std::string damaged = bytes;
    damaged[k] ^= 0x10;
    EXPECT_FALSE(ReadCatalogFile(AsBytes(damaged), "file").ok()) << "byte " << k;
    EXPECT_FALSE(ReadCatalogFile(AsBytes(bytes.substr(0, k)), "file").ok()) << "length " << k;
  }
  EXPECT_THAT(ReadCatalogFile(AsBytes(bytes + "x"), "file"), Fails(Code::kDataLoss, "file"));
  EXPECT_THAT(ReadCatalogFile(AsBytes("something else"), "file"),
              Fails(Code::kInvalidArgument, "is not a file of this type"));
}

TEST(CatalogFile, FindsTheBlobsOfARecordInWhateverField) {
  EXPECT_THAT(BlobIdsIn(Sample().animations[0]), testing::ElementsAre(kBlobA));
  EXPECT_THAT(BlobIdsIn(Sample().jobs[0]), testing::ElementsAre(kBlobB, kBlobA));
  EXPECT_THAT(BlobIdsIn(Sample().families[0]), testing::IsEmpty());
}

}  // namespace
}  // namespace liquidblend::store::catalog_file_test
