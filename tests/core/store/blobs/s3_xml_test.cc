#include "core/store/blobs/s3_xml.h"

#include <gmock/gmock.h>

#include "absl/strings/str_cat.h"
#include "tests/core/store/store_testing.h"

namespace liquidblend::store {
namespace {

using testing::IsEmpty;
using testing::SizeIs;

std::string List(const std::string& content) {
  return absl::StrCat(R"(<?xml version="1.0" encoding="UTF-8"?>)",
                      R"(<ListBucketResult xmlns="http://s3.amazonaws.com/doc/2006-03-01/">)",
                      content, "</ListBucketResult>");
}

std::string Object(const std::string& key, const std::string& size) {
  return absl::StrCat("<Contents><Key>", key, "</Key><LastModified>2026-01-02T03:04:05.000Z",
                      "</LastModified><Size>", size, "</Size></Contents>");
}

TEST(ParseS3Page, ReadsObjectsAndTheNextToken) {
  const auto page =
      ParseS3Page(List(absl::StrCat(Object("pre/a&amp;b&#x2F;c", "7"), Object("pre/d", "0"),
                                    "<NextContinuationToken>1/x==</NextContinuationToken>")),
                  "pre/");
  ASSERT_THAT(page, Succeeds());
  ASSERT_THAT(page->objects, SizeIs(2));
  EXPECT_EQ(page->objects[0].key, "a&b/c");
  EXPECT_EQ(page->objects[0].size_bytes, 7);
  EXPECT_EQ(page->objects[0].modified, absl::FromUnixSeconds(1767323045));
  EXPECT_EQ(page->objects[1].key, "d");
  EXPECT_EQ(page->next_token, "1/x==");
}

TEST(ParseS3Page, HasNothingInAnEmptyList) {
  const auto page = ParseS3Page(List("<KeyCount>0</KeyCount>"), "pre/");
  ASSERT_THAT(page, Succeeds());
  EXPECT_THAT(page->objects, IsEmpty());
  EXPECT_EQ(page->next_token, "");
}

TEST(ParseS3Page, RefusesWhatIsNoWholeList) {
  const std::string whole = List(Object("pre/a", "7"));
  for (const std::string& document :
       {std::string(), std::string("bad gateway"), std::string("<html><body>no</body></html>"),
        whole.substr(0, whole.size() - 5), whole.substr(0, whole.size() / 2)}) {
    EXPECT_THAT(ParseS3Page(document, "pre/"),
                Fails(absl::StatusCode::kInternal, "not a ListBucketResult"))
        << document;
  }
}

TEST(ParseS3Page, RefusesObjectsWithoutKeySizeOrTime) {
  for (const std::string& object :
       {Object("other/a", "7"), Object("pre/a", "-7"), Object("pre/a", "7x"), Object("pre/a", ""),
        std::string("<Contents><Key>pre/a</Key><Size>7</Size></Contents>"),
        std::string("<Contents/>")}) {
    EXPECT_THAT(ParseS3Page(List(object), "pre/"),
                Fails(absl::StatusCode::kInternal, "without key, size or time"))
        << object;
  }
}

std::string Uploads(const std::string& content) {
  return absl::StrCat("<ListMultipartUploadsResult>", content, "</ListMultipartUploadsResult>");
}

TEST(ParseS3UploadPage, ReadsUploadsAndWhereTheNextPageBegins) {
  const auto page = ParseS3UploadPage(
      Uploads("<Upload><Key>pre/a</Key><UploadId>u1</UploadId>"
              "<Initiated>2026-01-02T03:04:05.000Z</Initiated></Upload>"
              "<IsTruncated>true</IsTruncated><NextKeyMarker>pre/a</NextKeyMarker>"
              "<NextUploadIdMarker>u1</NextUploadIdMarker>"),
      "pre/");
  ASSERT_THAT(page, Succeeds());
  ASSERT_THAT(page->uploads, SizeIs(1));
  EXPECT_EQ(page->uploads[0].key, "a");
  EXPECT_EQ(page->uploads[0].id, "u1");
  EXPECT_EQ(page->uploads[0].begun, absl::FromUnixSeconds(1767323045));
  EXPECT_EQ(page->next_key, "pre/a");
  EXPECT_EQ(page->next_id, "u1");
}

TEST(ParseS3UploadPage, TheLastPageHasNoNext) {
  const auto page = ParseS3UploadPage(
      Uploads("<IsTruncated>false</IsTruncated><NextKeyMarker>pre/a</NextKeyMarker>"), "pre/");
  ASSERT_THAT(page, Succeeds());
  EXPECT_THAT(page->uploads, IsEmpty());
  EXPECT_EQ(page->next_key, "");
}

TEST(ParseS3UploadPage, RefusesUploadsWithoutKeyIdOrTime) {
  for (const char* upload : {"<Upload/>", "<Upload><Key>pre/a</Key><UploadId>u</UploadId></Upload>",
                             "<Upload><Key>other/a</Key><UploadId>u</UploadId>"
                             "<Initiated>2026-01-02T03:04:05.000Z</Initiated></Upload>"}) {
    EXPECT_THAT(ParseS3UploadPage(Uploads(upload), "pre/"),
                Fails(absl::StatusCode::kInternal, "without key, id or time"));
  }
  EXPECT_THAT(ParseS3UploadPage("<html>", "pre/"),
              Fails(absl::StatusCode::kInternal, "not a ListMultipartUploadsResult"));
}

TEST(XmlElement, IsTheFirstOfItsName) {
  const std::string error =
      "<Error><Code>NoSuchKey</Code><Message>no &lt;key&gt;</Message><Code>Other</Code></Error>";
  EXPECT_EQ(XmlElement(error, "Code"), "NoSuchKey");
  EXPECT_EQ(XmlElement(error, "Message"), "no <key>");
  EXPECT_EQ(XmlElement(error, "Key"), "");
  EXPECT_EQ(XmlElement("", "Code"), "");
  EXPECT_EQ(XmlElement("<Codes>x</Codes>", "Code"), "");
}

TEST(XmlElement, IsReadBeforeThePlaceWhereTheDocumentEnds) {
  EXPECT_EQ(XmlElement("<Error><Code>SlowDown</Code><Mess", "Code"), "SlowDown");
}

// Neither entities that grow nor elements within elements cost more than the document is long.
TEST(XmlElement, IsReadFromDocumentsThatAreMadeToHurt) {
  std::string nested;
  for (int k = 0; k < 200'000; ++k) absl::StrAppend(&nested, "<a>");
  EXPECT_EQ(XmlElement(nested, "Code"), "");
  const std::string entities =
      R"(<!DOCTYPE x [<!ENTITY a "aaaaaaaaaa"><!ENTITY b "&a;&a;&a;&a;">]><Code>&b;</Code>)";
  EXPECT_EQ(XmlElement(entities, "Code"), "&b;");
}

}  // namespace
}  // namespace liquidblend::store
