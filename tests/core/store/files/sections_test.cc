#include "core/store/files/sections.h"

#include "core/base/status_macros.h"
#include "tests/core/store/store_testing.h"

namespace liquidblend::store::sections_test {
namespace {

using Code = absl::StatusCode;

constexpr FileFormat kFormat = {"test file", "\x89LBTEST\n", 1};

// Writes the texts as sections "0", "1", ...
std::string Write(const std::vector<std::string>& texts, const std::string& name = "") {
  std::vector<SectionData> sections;
  for (size_t k = 0; k < texts.size(); ++k) {
    sections.push_back({absl::StrCat(k), 1, AsBytes(texts[k])});
  }
  v1::FamilyManifest manifest;
  manifest.set_name(name);
  MemoryWriter writer;
  EXPECT_THAT(WriteSectionFile(kFormat, sections, manifest, *manifest.mutable_sections(), writer),
              Succeeds());
  return writer.content;
}

// The sections of a file, or what is wrong with it.
absl::StatusOr<std::vector<std::string>> Read(const std::string& content,
                                              const FileFormat& format = kFormat) {
  const MemoryBlob blob(content);
  SectionReader reader(format, "t", blob.bytes());
  v1::FamilyManifest manifest;
  LB_RETURN_IF_ERROR(reader.ReadManifest(manifest));
  std::vector<std::string> texts;
  for (int k = 0; k < manifest.sections_size(); ++k) {
    LB_ASSIGN_OR_RETURN(const auto bytes,
                        reader.ReadSection(manifest.sections(k), absl::StrCat(k), 1));
    EXPECT_EQ((bytes.data() - blob.bytes().data()) % 64, 0);
    texts.push_back(AsString(bytes));
  }
  LB_RETURN_IF_ERROR(reader.Finish());
  return texts;
}

TEST(SectionFile, GivesBackItsSections) {
  for (const std::vector<std::string>& texts :
       std::vector<std::vector<std::string>>{{},
                                             {""},
                                             {"", "", ""},
                                             {"a"},
                                             {"a", "", "b"},
                                             {SampleBytes(64), "x", SampleBytes(1000), ""}}) {
    const auto read = Read(Write(texts));
    ASSERT_THAT(read, Succeeds());
    EXPECT_EQ(*read, texts);
  }
}

// The manifest grows by a byte at a time past what its own offsets make of it.
TEST(SectionFile, FindsPlaceForManifestsOfAnySize) {
  for (size_t size = 0; size < 400; ++size) {
    const std::vector<std::string> texts = {SampleBytes(300), SampleBytes(20000), "end"};
    const auto read = Read(Write(texts, std::string(size, 'n')));
    ASSERT_THAT(read, Succeeds()) << size;
    EXPECT_EQ(*read, texts);
  }
}

TEST(SectionFile, IsTheSameEachTime) {
  EXPECT_EQ(Write({"a", SampleBytes(100)}), Write({"a", SampleBytes(100)}));
}

TEST(SectionFile, RefusesNamesThatAreNotUtf8) {
  v1::FamilyManifest manifest;
  manifest.set_name("\xff");
  MemoryWriter writer;
  EXPECT_THAT(WriteSectionFile(kFormat, {}, manifest, *manifest.mutable_sections(), writer),
              Fails(Code::kInvalidArgument, "UTF-8"));
  EXPECT_EQ(writer.content, "");
}

TEST(SectionFile, NoticesEachBitThatFlips) {
  const std::string whole = Write({"water", "", SampleBytes(70), "drop"});
  for (size_t i = 0; i < whole.size(); ++i) {
    for (int bit = 0; bit < 8; ++bit) {
      std::string flipped = whole;
      flipped[i] = static_cast<char>(flipped[i] ^ (1 << bit));
      const absl::Status status = Read(flipped).status();
      EXPECT_TRUE(absl::IsDataLoss(status) || absl::IsInvalidArgument(status)) << i << " " << bit;
    }
  }
}

TEST(SectionFile, NoticesEachLengthThatIsNotItsOwn) {
  const std::string whole = Write({"water", SampleBytes(70), ""});
  for (size_t size = 0; size < whole.size(); ++size) {
    EXPECT_THAT(Read(whole.substr(0, size)), Fails(Code::kDataLoss, "test file t: ")) << size;
  }
  for (const size_t more : {1, 64, 1000}) {
    EXPECT_THAT(Read(whole + std::string(more, '\0')), Fails(Code::kDataLoss, "goes on after"));
  }
}

TEST(SectionFile, TellsOtherFilesAndVersionsApart) {
  const std::string whole = Write({"water"});
  EXPECT_THAT(Read("ply\nformat binary"),
              Fails(Code::kInvalidArgument, "t: is not a file of this type"));
  EXPECT_THAT(Read(whole, {"test file", "\x89LBTESU\n", 1}),
              Fails(Code::kInvalidArgument, "t: is not a file of this type"));
  EXPECT_THAT(Read(whole, {"test file", "\x89LBTEST\n", 2}),
              Fails(Code::kInvalidArgument, "has format version 1; this program reads version 2"));
}

}  // namespace
}  // namespace liquidblend::store::sections_test
