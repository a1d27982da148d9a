// Parts of stored files, through the server.
#include <filesystem>
#include <fstream>
#include <string>

#include "core/store/blobs/mapped_file.h"
#include "server/api/handlers.h"
#include "tests/server/backends_testing.h"

namespace liquidblend::server {
namespace {

using store::Fails;
using store::Succeeds;
using testing::ElementsAre;
using Code = absl::StatusCode;

constexpr int64_t kPart = int64_t{1} << 20;

class ReadFileTest : public RpcTest {
 protected:
  // An animation whose file has this content.
  void Publish(const std::string& id, const std::string& content) {
    store::pb::AnimationRecord animation;
    animation.set_id(id);
    animation.set_blob(*store::PutBlob(*blobs_, store::AsBytes(content)));
    SubmitImport(id);
    ASSERT_THAT(catalog_->PublishAnimation(TakeJob().lease_id, animation), Succeeds());
  }

  static v1::ReadFileRequest RequestFor(const std::string& name, int64_t offset = 0) {
    v1::ReadFileRequest request;
    request.set_name(name);
    request.set_offset(offset);
    return request;
  }

  std::string PathOf(const store::BlobId& blob) const {
    for (const auto& entry : std::filesystem::recursive_directory_iterator(folder_.path())) {
      if (entry.path().filename() == blob) return entry.path().string();
    }
    ADD_FAILURE() << blob << " is nowhere";
    return "";
  }

  Backends backends_{*catalog_, *blobs_, families_, SmallBackends()};
};

TEST_F(ReadFileTest, PartsAreTheWholeFile) {
  std::string content;
  for (int64_t i = 0; i < 2 * kPart + 5; ++i) content += static_cast<char>(i * i % 251);
  Publish("a", content);
  std::string read;
  for (const int64_t expected : {kPart, kPart, int64_t{5}, int64_t{0}}) {
    const auto part =
        ReadFile(backends_, RequestFor("animations/a", static_cast<int64_t>(read.size())));
    ASSERT_THAT(part, Succeeds());
    EXPECT_EQ(static_cast<int64_t>(part->data().size()), expected);
    EXPECT_EQ(part->size_bytes(), static_cast<int64_t>(content.size()));
    EXPECT_EQ(part->checksum(), catalog_->GetAnimation("a")->blob());
    read += part->data();
  }
  EXPECT_TRUE(read == content);
}

TEST_F(ReadFileTest, PlacesOutsideOfTheFileAreRefused) {
  Publish("a", "water");
  for (const int64_t offset : {int64_t{-1}, int64_t{6}, INT64_MAX, INT64_MIN}) {
    const absl::Status status = ReadFile(backends_, RequestFor("a", offset)).status();
    EXPECT_THAT(BlamedFields(status), ElementsAre("offset")) << offset;
  }
}

TEST_F(ReadFileTest, AFileThatWasReplacedIsNotMixedWithTheNewOne) {
  PublishSplash();
  const auto first = ReadFile(backends_, RequestFor("families/splash"));
  ASSERT_THAT(first, Succeeds());
  EXPECT_EQ(first->version(), 1);
  PublishFamily("splash", "a", "b", 2);
  v1::ReadFileRequest next = RequestFor("families/splash");
  next.set_checksum(first->checksum());
  EXPECT_THAT(ReadFile(backends_, next), Fails(Code::kAborted, "begin again"));
  EXPECT_EQ(ReadFile(backends_, RequestFor("families/splash"))->version(), 2);
}

TEST_F(ReadFileTest, AFileThatCannotBeReadIsOpenedAnewOnceItIsWholeAgain) {
  store::SurviveUnreadablePages();
  const std::string content(2 * kPart, 'w');
  Publish("a", content);
  ASSERT_THAT(ReadFile(backends_, RequestFor("a")), Succeeds());
  const std::string path = PathOf(catalog_->GetAnimation("a")->blob());
  std::filesystem::resize_file(path, kPart);
  EXPECT_THAT(ReadFile(backends_, RequestFor("a", kPart)), Fails(Code::kDataLoss, ""));
  std::ofstream(path, std::ios::binary) << content;
  const auto part = ReadFile(backends_, RequestFor("a", kPart));
  ASSERT_THAT(part, Succeeds());
  EXPECT_TRUE(part->data() == content.substr(kPart));
}

TEST_F(ReadFileTest, AFileThatIsMissingIsDataLoss) {
  Publish("a", "water");
  ASSERT_THAT(blobs_->Delete(catalog_->GetAnimation("a")->blob()), Succeeds());
  EXPECT_THAT(ReadFile(backends_, RequestFor("a")), Fails(Code::kDataLoss, "the file of a"));
  EXPECT_THAT(ReadFile(backends_, RequestFor("none")), Fails(Code::kNotFound, "none"));
}

}  // namespace
}  // namespace liquidblend::server
