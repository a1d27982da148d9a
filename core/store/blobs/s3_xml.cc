#include "core/store/blobs/s3_xml.h"

#include "absl/strings/str_cat.h"
#include "absl/strings/str_replace.h"

namespace liquidblend::store {

std::string NextXmlElement(const std::string& xml, const std::string& tag, size_t& position) {
  const std::string open = absl::StrCat("<", tag, ">");
  const size_t begin = xml.find(open, position);
  const size_t end =
      begin == std::string::npos ? begin : xml.find(absl::StrCat("</", tag, ">"), begin);
  if (end == std::string::npos) {
    position = xml.size();
    return "";
  }
  position = end;
  return xml.substr(begin + open.size(), end - begin - open.size());
}

std::string XmlElement(const std::string& xml, const std::string& tag) {
  size_t position = 0;
  return absl::StrReplaceAll(NextXmlElement(xml, tag, position), {{"&lt;", "<"},
                                                                  {"&gt;", ">"},
                                                                  {"&quot;", "\""},
                                                                  {"&#34;", "\""},
                                                                  {"&apos;", "'"},
                                                                  {"&amp;", "&"}});
}

}  // namespace liquidblend::store
