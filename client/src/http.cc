#include "client/src/http.h"

#include <arpa/inet.h>
#include <curl/curl.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <cstdlib>
#include <cstring>
#include <utility>

#include "absl/strings/ascii.h"
#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "client/src/status_macros.h"

namespace liquidblend::client {

struct Http::Exchange {
  ~Exchange() { curl_slist_free_all(headers); }
  void AddHeader(const std::string& line) { headers = curl_slist_append(headers, line.c_str()); }

  CURL* easy = nullptr;
  curl_slist* headers = nullptr;
  const Source* source = nullptr;
  int64_t left = 0;  // of what it gives
  const Sink* sink = nullptr;
  HttpHosts hosts = HttpHosts::kAny;
  bool is_refused = false;  // its address
  HttpAnswer answer;
};

namespace {

constexpr size_t kMaxBody = 64 << 10;
constexpr long kConnectTimeoutMs = 5000;
constexpr long kStallSeconds = 30;
constexpr long kSlowestDownload = 1024;  // bytes a second

std::string WithoutQuery(const std::string& url) { return url.substr(0, url.find('?')); }

// "Name: value" as one line.  Errors: kDataLoss if it would be more, or the name is no token.
absl::StatusOr<std::string> HeaderLine(const std::string& name, const std::string& value) {
  const auto is_token = [](char c) {
    return absl::ascii_isalnum(static_cast<unsigned char>(c)) || absl::StrContains("-_.", c);
  };
  const auto is_control = [](char c) { return absl::ascii_iscntrl(static_cast<unsigned char>(c)); };
  if (name.empty() || !std::all_of(name.begin(), name.end(), is_token) ||
      std::any_of(value.begin(), value.end(), is_control)) {
    return absl::DataLossError("the server gives a header for the object store that is none");
  }
  return absl::StrCat(name, ": ", value);
}

bool IsOwnOrLinkLocal(const in_addr& address) {
  const uint32_t bits = ntohl(address.s_addr);
  return bits >> 24 == 127 || bits >> 24 == 0 || bits >> 16 == 0xa9fe;  // 169.254
}

// Whether it is of this machine, or of what only its own network reaches by link-local addresses,
// such as the metadata of cloud machines.
bool IsOwnOrLinkLocal(const sockaddr& address) {
  if (address.sa_family == AF_INET) {
    in_addr v4;
    std::memcpy(&v4, reinterpret_cast<const char*>(&address) + offsetof(sockaddr_in, sin_addr),
                sizeof(v4));
    return IsOwnOrLinkLocal(v4);
  }
  if (address.sa_family != AF_INET6) return true;
  in6_addr v6;
  std::memcpy(&v6, reinterpret_cast<const char*>(&address) + offsetof(sockaddr_in6, sin6_addr),
              sizeof(v6));
  if (IN6_IS_ADDR_V4MAPPED(&v6)) {
    in_addr v4;
    std::memcpy(&v4, &v6.s6_addr[12], sizeof(v4));
    return IsOwnOrLinkLocal(v4);
  }
  return IN6_IS_ADDR_LOOPBACK(&v6) || IN6_IS_ADDR_UNSPECIFIED(&v6) || IN6_IS_ADDR_LINKLOCAL(&v6);
}

// Whether a proxy of the environment may stand between: then its address says nothing of the host.
bool MayUseProxy() {
  for (const char* name : {"http_proxy", "https_proxy", "HTTPS_PROXY", "all_proxy", "ALL_PROXY"}) {
    const char* const value = std::getenv(name);
    if (value != nullptr && *value != '\0') return true;
  }
  return false;
}

}  // namespace

Http::Http(std::string ca_file, HttpHosts hosts)
    : ca_file_(std::move(ca_file)), hosts_(hosts), easy_(curl_easy_init()) {}

Http::~Http() { curl_easy_cleanup(static_cast<CURL*>(easy_)); }

absl::StatusOr<HttpAnswer> Http::Put(const std::string& url,
                                     const std::map<std::string, std::string>& headers,
                                     int64_t size, const Source& source) {
  Exchange exchange;
  exchange.source = &source;
  exchange.left = size;
  for (const auto& [name, value] : headers) {
    LBC_ASSIGN_OR_RETURN(const std::string line, HeaderLine(name, value));
    exchange.AddHeader(line);
  }
  CURL* const easy = static_cast<CURL*>(easy_);
  curl_easy_reset(easy);
  curl_easy_setopt(easy, CURLOPT_UPLOAD, 1L);
  curl_easy_setopt(easy, CURLOPT_INFILESIZE_LARGE, static_cast<curl_off_t>(size));
  const auto read = [](char* buffer, size_t width, size_t count, void* taken) -> size_t {
    Exchange& from = *static_cast<Exchange*>(taken);
    if (from.left == 0) return 0;
    const size_t got = (*from.source)(buffer, width * count);
    from.left -= static_cast<int64_t>(got);
    return got == 0 ? CURL_READFUNC_ABORT : got;
  };
  curl_easy_setopt(easy, CURLOPT_READFUNCTION, static_cast<curl_read_callback>(read));
  curl_easy_setopt(easy, CURLOPT_READDATA, &exchange);
  return Run(url, exchange);
}

absl::StatusOr<HttpAnswer> Http::Post(const std::string& url, const std::string& body) {
  Exchange exchange;
  CURL* const easy = static_cast<CURL*>(easy_);
  curl_easy_reset(easy);
  curl_easy_setopt(easy, CURLOPT_POST, 1L);
  curl_easy_setopt(easy, CURLOPT_POSTFIELDS, body.c_str());
  curl_easy_setopt(easy, CURLOPT_POSTFIELDSIZE_LARGE, static_cast<curl_off_t>(body.size()));
  return Run(url, exchange);
}

absl::StatusOr<HttpAnswer> Http::Get(const std::string& url, const Sink& sink) {
  Exchange exchange;
  exchange.sink = &sink;
  CURL* const easy = static_cast<CURL*>(easy_);
  curl_easy_reset(easy);
  curl_easy_setopt(easy, CURLOPT_LOW_SPEED_LIMIT, kSlowestDownload);
  return Run(url, exchange);
}

absl::StatusOr<HttpAnswer> Http::Run(const std::string& url, Exchange& exchange) {
  CURL* const easy = static_cast<CURL*>(easy_);
  exchange.easy = easy;
  curl_easy_setopt(easy, CURLOPT_URL, url.c_str());
  curl_easy_setopt(easy, CURLOPT_PROTOCOLS_STR, "http,https");
  curl_easy_setopt(easy, CURLOPT_PATH_AS_IS, 1L);  // it is signed as it is
  curl_easy_setopt(easy, CURLOPT_NOSIGNAL, 1L);
  curl_easy_setopt(easy, CURLOPT_CONNECTTIMEOUT_MS, kConnectTimeoutMs);
  if (exchange.sink == nullptr) curl_easy_setopt(easy, CURLOPT_LOW_SPEED_LIMIT, 1L);
  curl_easy_setopt(easy, CURLOPT_LOW_SPEED_TIME, kStallSeconds);
  if (!ca_file_.empty()) curl_easy_setopt(easy, CURLOPT_CAINFO, ca_file_.c_str());
  for (const char* name : {"Expect:", "Content-Type:"}) exchange.AddHeader(name);
  curl_easy_setopt(easy, CURLOPT_HTTPHEADER, exchange.headers);
  const auto take = [](char* bytes, size_t width, size_t count, void* taken) -> size_t {
    Exchange& to = *static_cast<Exchange*>(taken);
    const absl::string_view text(bytes, width * count);
    long status = 0;
    curl_easy_getinfo(to.easy, CURLINFO_RESPONSE_CODE, &status);
    if (to.sink != nullptr && status == 200) return (*to.sink)(text) ? text.size() : 0;
    absl::StrAppend(&to.answer.body,
                    text.substr(0, kMaxBody - std::min(kMaxBody, to.answer.body.size())));
    return text.size();
  };
  curl_easy_setopt(easy, CURLOPT_WRITEFUNCTION, static_cast<curl_write_callback>(take));
  curl_easy_setopt(easy, CURLOPT_WRITEDATA, &exchange);
  const auto note = [](char* bytes, size_t width, size_t count, void* taken) -> size_t {
    const absl::string_view line(bytes, width * count);
    if (absl::StartsWithIgnoreCase(line, "etag:")) {
      static_cast<Exchange*>(taken)->answer.etag =
          std::string(absl::StripAsciiWhitespace(line.substr(5)));
    }
    return line.size();
  };
  curl_easy_setopt(easy, CURLOPT_HEADERFUNCTION, static_cast<curl_write_callback>(note));
  curl_easy_setopt(easy, CURLOPT_HEADERDATA, &exchange);
  exchange.hosts = hosts_;
  const auto open = [](void* taken, curlsocktype, curl_sockaddr* address) -> curl_socket_t {
    Exchange& to = *static_cast<Exchange*>(taken);
    to.is_refused = to.hosts == HttpHosts::kElsewhere && IsOwnOrLinkLocal(address->addr);
    if (to.is_refused) return CURL_SOCKET_BAD;
    return socket(address->family, address->socktype | SOCK_CLOEXEC, address->protocol);
  };
  if (!MayUseProxy()) {
    curl_easy_setopt(easy, CURLOPT_OPENSOCKETFUNCTION, static_cast<curl_opensocket_callback>(open));
    curl_easy_setopt(easy, CURLOPT_OPENSOCKETDATA, &exchange);
  }
  const CURLcode code = curl_easy_perform(easy);
  long status = 0;
  curl_easy_getinfo(easy, CURLINFO_RESPONSE_CODE, &status);
  exchange.answer.status = static_cast<int>(status);
  // A server may refuse a request and close the connection before it has read the body.
  if (code == CURLE_OK || status >= 400) return std::move(exchange.answer);
  if (exchange.is_refused) {
    return absl::UnavailableError(absl::StrCat(
        WithoutQuery(url), ": is on this machine or a link-local address, and the server is not"));
  }
  return absl::UnavailableError(absl::StrCat(WithoutQuery(url), ": ", curl_easy_strerror(code)));
}

absl::Status StatusOf(const HttpAnswer& answer) {
  const int status = answer.status;
  if (status >= 200 && status < 300) return absl::OkStatus();
  const std::string message = absl::StrCat("HTTP status ", status, " of the object store");
  if (status == 403) {
    return absl::PermissionDeniedError(absl::StrCat(message, "; the url may have expired"));
  }
  if (status == 404) return absl::NotFoundError(message);
  if (status == 408 || status == 429 || status >= 500) return absl::UnavailableError(message);
  return absl::InternalError(message);
}

}  // namespace liquidblend::client
