#include "server/http/answers/page.h"

#include <zlib.h>

#include <algorithm>

#include "absl/status/status.h"
#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "server/http/exchange/replies.h"

namespace liquidblend::http {
namespace {

constexpr char kIndex[] = "/";
constexpr int kGzip = 16 + MAX_WBITS;  // of inflateInit2()
constexpr char kContentSecurityPolicy[] =
    "default-src 'none'; script-src 'self' 'wasm-unsafe-eval'; worker-src 'self'; "
    "style-src 'self'; img-src 'self' blob: data:; connect-src 'self'; font-src 'self'; "
    "base-uri 'none'; form-action 'none'; frame-ancestors 'none'";

// Requires: bytes that pack_page.py has compressed.
std::string Unpacked(std::string_view gzip) {
  z_stream stream = {};
  if (inflateInit2(&stream, kGzip) != Z_OK) return "";
  stream.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(gzip.data()));
  stream.avail_in = static_cast<uInt>(gzip.size());
  std::string bytes;
  char chunk[1 << 14];
  int result = Z_OK;
  while (result == Z_OK) {
    stream.next_out = reinterpret_cast<Bytef*>(chunk);
    stream.avail_out = sizeof(chunk);
    result = inflate(&stream, Z_NO_FLUSH);
    bytes.append(chunk, sizeof(chunk) - stream.avail_out);
  }
  inflateEnd(&stream);
  return bytes;
}

Response NoFile(PageFiles files) {
  if (!files.empty()) return ErrorReply(absl::NotFoundError("the page has no such file"));
  return ErrorReply(
      absl::NotFoundError("the page was left out of this program: it needs npm when it is built; "
                          "the API is below /v1"));
}

}  // namespace

Response PageReply(PageFiles files, std::string_view path, const Request& request) {
  const auto file = std::find_if(files.begin(), files.end(),
                                 [&](const PageFile& one) { return one.path == path; });
  if (file == files.end()) return NoFile(files);
  const bool is_index = path == kIndex;
  Response response;
  response.headers = {
      {"Content-Type", std::string(file->type)},
      {"Cache-Control", is_index ? "no-cache" : "public, immutable, max-age=31536000"},
      {"ETag", std::string(file->tag)},
      {"Vary", "Accept-Encoding"},
      {"Content-Security-Policy", kContentSecurityPolicy},
      {"Referrer-Policy", "no-referrer"},
      {"Cross-Origin-Opener-Policy", "same-origin"}};
  if (HasTag(request.if_none_match, std::string(file->tag))) {
    response.code = 304;
    return response;
  }
  const bool takes_gzip = absl::StrContains(request.accept_encoding, "gzip");
  if (takes_gzip) response.headers.emplace_back("Content-Encoding", "gzip");
  response.body = takes_gzip ? std::string(file->gzip) : Unpacked(file->gzip);
  return response;
}

}  // namespace liquidblend::http
