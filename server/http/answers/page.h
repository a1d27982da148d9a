// The page, whose files are part of the program (pack_page.py).
#pragma once

#include <span>
#include <string>
#include <string_view>

#include "server/http/exchange/messages.h"

namespace liquidblend::http {

struct PageFile {
  std::string_view path;  // "/", or "/page/.."
  std::string_view type;  // its Content-Type
  std::string_view gzip;  // its bytes, compressed
  std::string_view tag;   // its ETag
};
using PageFiles = std::span<const PageFile>;

// The files that this program was built with; none if the page was left out.
PageFiles EmbeddedPage();

// The file of that path, or 304 if the client has it; 404 if there is none. Files below /page/ have
// names that change with their content, so they may be kept for a year. Scripts of this server's
// only run in it (Content-Security-Policy).
Response PageReply(PageFiles files, std::string_view path, const Request& request);

}  // namespace liquidblend::http
