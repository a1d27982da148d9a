#include "core/store/blobs/s3_xml.h"

#include <cstring>
#include <pugixml.hpp>
#include <utility>

#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/strip.h"
#include "core/base/status_macros.h"

namespace liquidblend::store {
namespace {

pugi::xml_parse_result Parse(const std::string& document, pugi::xml_document& xml) {
  return xml.load_buffer(document.data(), document.size(), pugi::parse_default,
                         pugi::encoding_utf8);
}

// Parses a list of S3; returns its root element. Errors: kInternal if the document is something
// else.
absl::StatusOr<pugi::xml_node> ParseList(const std::string& document, const char* name,
                                         pugi::xml_document& xml) {
  const pugi::xml_parse_result parsed = Parse(document, xml);
  const pugi::xml_node list = xml.child(name);
  if (parsed && list) return list;
  return absl::InternalError(absl::StrCat("not a ", name, ": ", parsed.description()));
}

// Reads a key without the prefix. Returns false if the key does not begin with it.
bool ReadKey(const pugi::xml_node& element, const std::string& prefix, std::string& key) {
  absl::string_view text = element.child_value("Key");
  if (!absl::ConsumePrefix(&text, prefix)) return false;
  key = std::string(text);
  return true;
}

bool ReadTime(const pugi::xml_node& element, const char* name, absl::Time& time) {
  std::string error;
  return absl::ParseTime(absl::RFC3339_full, element.child_value(name), &time, &error);
}

absl::StatusOr<S3Object> ParseObject(const pugi::xml_node& contents, const std::string& prefix) {
  S3Object object;
  if (!ReadKey(contents, prefix, object.key) ||
      !absl::SimpleAtoi(contents.child_value("Size"), &object.size_bytes) ||
      object.size_bytes < 0 || !ReadTime(contents, "LastModified", object.modified)) {
    return absl::InternalError("a list with an object without key, size or time");
  }
  return object;
}

absl::StatusOr<S3OpenUpload> ParseUpload(const pugi::xml_node& element, const std::string& prefix) {
  S3OpenUpload upload;
  upload.id = element.child_value("UploadId");
  if (!ReadKey(element, prefix, upload.key) || upload.id.empty() ||
      !ReadTime(element, "Initiated", upload.begun)) {
    return absl::InternalError("a list with an upload without key, id or time");
  }
  return upload;
}

}  // namespace

absl::StatusOr<S3Page> ParseS3Page(const std::string& document, const std::string& prefix) {
  pugi::xml_document xml;
  LB_ASSIGN_OR_RETURN(const pugi::xml_node list, ParseList(document, "ListBucketResult", xml));
  S3Page page;
  for (const pugi::xml_node& contents : list.children("Contents")) {
    LB_ASSIGN_OR_RETURN(S3Object object, ParseObject(contents, prefix));
    page.objects.push_back(std::move(object));
  }
  page.next_token = list.child_value("NextContinuationToken");
  return page;
}

absl::StatusOr<S3UploadPage> ParseS3UploadPage(const std::string& document,
                                               const std::string& prefix) {
  pugi::xml_document xml;
  LB_ASSIGN_OR_RETURN(const pugi::xml_node list,
                      ParseList(document, "ListMultipartUploadsResult", xml));
  S3UploadPage page;
  for (const pugi::xml_node& element : list.children("Upload")) {
    LB_ASSIGN_OR_RETURN(S3OpenUpload upload, ParseUpload(element, prefix));
    page.uploads.push_back(std::move(upload));
  }
  if (strcmp(list.child_value("IsTruncated"), "true") != 0) return page;
  page.next_key = list.child_value("NextKeyMarker");
  page.next_id = list.child_value("NextUploadIdMarker");
  return page;
}

std::string XmlElement(const std::string& document, const char* name) {
  pugi::xml_document xml;
  Parse(document, xml);  // elements before an error are kept
  const pugi::xml_node found =
      xml.find_node([name](const pugi::xml_node& node) { return strcmp(node.name(), name) == 0; });
  return found.child_value();
}

}  // namespace liquidblend::store
