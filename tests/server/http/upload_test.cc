// UploadAnimation over HTTP: a tar archive as the body.
#include <nlohmann/json.hpp>
#include <sstream>
#include <thread>

#include "absl/strings/str_cat.h"
#include "server/tar/tar.h"
#include "tests/server/http/port_testing.h"

namespace liquidblend::http::upload_test {
namespace {

using store::AsBytes;
using testing::HasSubstr;

constexpr char kTarget[] =
    "/v1/animations:upload?header.animationId=drop&header.options.framesPerSecond=30";
constexpr char kTar[] = "Content-Type: application/x-tar\r\n";

std::string Archive(const std::vector<std::pair<std::string, std::string>>& files) {
  std::ostringstream out;
  tar::TarWriter writer(out);
  for (const auto& [name, content] : files) {
    EXPECT_TRUE(writer.Add(name, AsBytes(content)).ok());
  }
  EXPECT_TRUE(writer.End().ok());
  return out.str();
}

class UploadTest : public PortTest {
 protected:
  HttpReply Upload(HttpClient& client, const std::string& target, const std::string& body,
                   const std::string& headers = kTar) {
    client.Send(absl::StrCat("POST ", target, " HTTP/1.1\r\nHost: localhost\r\n", headers,
                             "Content-Length: ", body.size(), "\r\n\r\n", body));
    return client.ReadReply();
  }
  HttpReply Upload(const std::string& target, const std::string& body,
                   const std::string& headers = kTar) {
    HttpClient client(port_->port());
    return Upload(client, target, body, headers);
  }

  // Files in the store that nothing refers to yet.
  bool HasDrop() { return catalog_->GetAnimation("drop").ok(); }
};

TEST_F(UploadTest, FilesOfAnArchiveAreImported) {
  HttpClient client(port_->port());
  const HttpReply reply =
      Upload(client, absl::StrCat(kTarget, "&header.numFiles=2"),
             Archive({{"shot/f2.ply", std::string(700, 'x')}, {"f1.ply", "one"}}));
  ASSERT_EQ(reply.code, 200) << reply.body;
  const auto operation = nlohmann::json::parse(reply.body);
  EXPECT_EQ(operation["metadata"]["animation"], "animations/drop");
  const store::pb::ImportJob job = TakeJob().job.import_animation();
  EXPECT_EQ(job.options().frames_per_second(), 30);
  ASSERT_EQ(job.files_size(), 2);
  EXPECT_EQ(job.files(0).name(), "f2.ply");
  const auto blob = blobs_->Open(job.files(0).blob());
  ASSERT_TRUE(blob.ok()) << blob.status();
  EXPECT_EQ(store::AsString((*blob)->bytes()), std::string(700, 'x'));
  EXPECT_EQ(client.Get("/healthz").body, "ok\n") << "the connection goes on";
}

TEST_F(UploadTest, ErrorsAreThoseOfAnUploadByGrpc) {
  const std::string archive = Archive({{"f1.ply", "one"}});
  const auto expect = [&](const std::string& target, const std::string& body, int code,
                          const std::string& words) {
    const HttpReply reply = Upload(target, body);
    EXPECT_EQ(reply.code, code) << target;
    EXPECT_THAT(reply.body, HasSubstr(words)) << target;
  };
  expect("/v1/animations:upload", archive, 400, "header.animationId");
  expect("/v1/animations:upload?file.name=x", archive, 400, "header.animationId");
  expect("/v1/animations:upload?header.animationId=No!", archive, 400, "header.animation_id");
  expect("/v1/animations:upload?header.animationId=a", archive, 409, "animations/a exists");
  expect(absl::StrCat(kTarget, "&header.numFiles=2"), archive, 400, "1 of 2 files");
  expect(absl::StrCat(kTarget, "&header.options.vertexScale=-1"), archive, 400, "vertex_scale");
  expect(kTarget, Archive({{"f1.ply", std::string(1001, 'x')}}), 413, "UPLOAD_TOO_LARGE");
  expect(kTarget, Archive({}), 400, "file: there must be at least one");
  expect(kTarget, archive.substr(0, 600), 400, "ends early");
  expect(kTarget, "no archive", 400, "ARCHIVE_MALFORMED");
  expect(kTarget, "", 400, "must be a tar archive");
  EXPECT_EQ(Upload(kTarget, archive, "Content-Type: application/json\r\n").code, 415);
  EXPECT_EQ(Upload(kTarget, archive, absl::StrCat(kTar, "Origin: https://evil.example\r\n")).code,
            403);
  EXPECT_FALSE(HasDrop());
}

TEST_F(UploadTest, AnUploadThatBreaksOffLeavesNothing) {
  const std::string archive = Archive({{"f1.ply", "one"}});
  for (const std::string& part : {std::string(), archive.substr(0, 514), archive}) {
    HttpClient client(port_->port());
    client.Send(absl::StrCat("POST ", kTarget, " HTTP/1.1\r\nHost: localhost\r\n", kTar,
                             "Content-Length: ", archive.size() + 1, "\r\n\r\n", part));
  }
  port_->Stop(absl::Seconds(10));
  EXPECT_FALSE(HasDrop());
  EXPECT_TRUE(catalog_->ListJobs(10, "")->records.size() == 4U) << "those of the families";
}

TEST_F(UploadTest, ChunksOfHttpAreTakenToo) {
  const std::string archive = Archive({{"f1.ply", "one"}});
  HttpClient client(port_->port());
  client.Send(absl::StrCat("POST ", kTarget, " HTTP/1.1\r\nHost: localhost\r\n", kTar,
                           "Transfer-Encoding: chunked\r\n\r\n"));
  for (size_t begin = 0; begin < archive.size(); begin += 300) {
    const std::string chunk = archive.substr(begin, 300);
    client.Send(absl::StrCat(absl::Hex(chunk.size()), "\r\n", chunk, "\r\n"));
  }
  client.Send("0\r\n\r\n");
  EXPECT_EQ(client.ReadReply().code, 200);
  EXPECT_TRUE(HasDrop());
}

}  // namespace
}  // namespace liquidblend::http::upload_test
