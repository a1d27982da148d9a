#include "server/http/answers/page.h"

#include <zlib.h>

#include <algorithm>
#include <new>
#include <string>

#include "absl/status/status.h"
#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "server/http/exchange/replies.h"

namespace liquidblend::http {
namespace {

constexpr char kIndex[] = "/";
constexpr int kGzip = 16 + MAX_WBITS;  // of inflateInit2()
constexpr size_t kSizeBytes = 4;
constexpr char kContentSecurityPolicy[] =
    "default-src 'none'; script-src 'self' 'wasm-unsafe-eval'; worker-src 'self'; "
    "style-src 'self'; img-src 'self' blob: data:; connect-src 'self'; font-src 'self'; "
    "base-uri 'none'; form-action 'none'; frame-ancestors 'none'";

// The last bytes of what gzip writes, lowest first. Requires: it is a single member below 4 GiB.
size_t UnpackedSize(std::string_view gzip) {
  if (gzip.size() < kSizeBytes) return 0;
  size_t size = 0;
  for (size_t k = 1; k <= kSizeBytes; ++k) {
    size = 256 * size + static_cast<unsigned char>(gzip[gzip.size() - k]);
  }
  return size;
}

std::string Unpacked(std::string_view gzip) {
  std::string bytes(UnpackedSize(gzip), '\0');
  z_stream stream = {};
  if (inflateInit2(&stream, kGzip) != Z_OK) throw std::bad_alloc();
  stream.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(gzip.data()));
  stream.avail_in = static_cast<uInt>(gzip.size());
  stream.next_out = reinterpret_cast<Bytef*>(bytes.data());
  stream.avail_out = static_cast<uInt>(bytes.size());
  const int result = inflate(&stream, Z_FINISH);
  inflateEnd(&stream);
  if (result == Z_MEM_ERROR) throw std::bad_alloc();
  return bytes;
}

Response NoFile(PageFiles files) {
  if (!files.empty()) return ErrorReply(absl::NotFoundError("the page has no such file"));
  return ErrorReply(
      absl::NotFoundError("the page was left out of this program: it needs npm when it is built; "
                          "the API is below /v1"));
}

}  // namespace

Response Page::Reply(std::string_view path, const Request& request) const {
  const auto file = std::find_if(files_.begin(), files_.end(),
                                 [&](const PageFile& one) { return one.path == path; });
  if (file == files_.end()) return NoFile(files_);
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
  if (request.method == "HEAD") {
    response.left_out_bytes = takes_gzip ? file->gzip.size() : UnpackedSize(file->gzip);
  } else if (takes_gzip) {
    response.body = file->gzip;
  } else {
    const server::LazyText& unpacked = unpacked_[static_cast<size_t>(file - files_.begin())];
    response.body = unpacked.Of([&] { return Unpacked(file->gzip); });
  }
  return response;
}

}  // namespace liquidblend::http
