// The page, whose files are part of the program (pack_page.py).
#pragma once

#include <span>
#include <string_view>
#include <vector>

#include "server/base/lazy_text.h"
#include "server/http/exchange/messages.h"

namespace liquidblend::http {

struct PageFile {
  std::string_view path;  // "/", or "/page/.."
  std::string_view type;  // its Content-Type
  std::string_view gzip;  // its bytes, compressed by pack_page.py
  std::string_view tag;   // its ETag
};
using PageFiles = std::span<const PageFile>;

// The files that this program was built with; none if the page was left out.
PageFiles EmbeddedPage();

// Answers for the page's files. A file is unpacked when the first client that does not take gzip
// asks for it, and kept: so this takes at most the memory of all files unpacked.  Threads: safe.
class Page {
 public:
  explicit Page(PageFiles files) : files_(files), unpacked_(files.size()) {}

  // The file of that path, or 304 if the client has it; 404 if there is none. Files below /page/
  // have names that change with their content, so they may be kept for a year. Scripts of this
  // server's only run in it (Content-Security-Policy). The answer to HEAD has the size of the body
  // alone.
  Response Reply(std::string_view path, const Request& request) const;

 private:
  const PageFiles files_;
  const std::vector<server::LazyText> unpacked_;  // of each file
};

}  // namespace liquidblend::http
