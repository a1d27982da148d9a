// Elements of the XML documents that S3 answers with.
#pragma once

#include <string>

namespace liquidblend::store {

// The content of the first <tag> at or after `position`, which moves behind it; empty if there is
// none. Entities are left as they are.
std::string NextXmlElement(const std::string& xml, const std::string& tag, size_t& position);

// The text of the first <tag>, without entities; empty if there is none.
std::string XmlElement(const std::string& xml, const std::string& tag);

}  // namespace liquidblend::store
