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

absl::StatusOr<S3Object> ParseObject(const pugi::xml_node& contents, const std::string& prefix) {
  absl::string_view key = contents.child_value("Key");
  S3Object object;
  std::string error;
  if (!absl::ConsumePrefix(&key, prefix) ||
      !absl::SimpleAtoi(contents.child_value("Size"), &object.size_bytes) ||
      object.size_bytes < 0 ||
      !absl::ParseTime(absl::RFC3339_full, contents.child_value("LastModified"), &object.modified,
                       &error)) {
    return absl::InternalError("a list with an object without key, size or time");
  }
  object.key = std::string(key);
  return object;
}

}  // namespace

absl::StatusOr<S3Page> ParseS3Page(const std::string& document, const std::string& prefix) {
  pugi::xml_document xml;
  const pugi::xml_parse_result parsed = Parse(document, xml);
  const pugi::xml_node list = xml.child("ListBucketResult");
  if (!parsed || !list) {
    return absl::InternalError(absl::StrCat("not a list of objects: ", parsed.description()));
  }
  S3Page page;
  for (const pugi::xml_node& contents : list.children("Contents")) {
    LB_ASSIGN_OR_RETURN(S3Object object, ParseObject(contents, prefix));
    page.objects.push_back(std::move(object));
  }
  page.next_token = list.child_value("NextContinuationToken");
  return page;
}

std::string XmlElement(const std::string& document, const char* name) {
  pugi::xml_document xml;
  Parse(document, xml);  // what stands before an error is there
  const pugi::xml_node found =
      xml.find_node([name](const pugi::xml_node& node) { return strcmp(node.name(), name) == 0; });
  return found.child_value();
}

}  // namespace liquidblend::store
