#include "client/src/http.h"

#include <curl/curl.h>
#include <sys/socket.h>

#include <algorithm>
#include <utility>

#include "absl/strings/ascii.h"
#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "absl/time/clock.h"
#include "client/src/connection/own_address.h"
#include "client/src/status_macros.h"

namespace liquidblend::client {

namespace {

constexpr size_t kMaxBody = 64 << 10;
constexpr size_t kMaxHeaderBytes = 256 << 10;
constexpr long kConnectTimeoutMs = 5000;
constexpr long kStallSeconds = 30;
constexpr long kSlowest = 1024;  // bytes a second, of a file

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

}  // namespace

// One request and its answer. The static functions are callbacks of libcurl with the Exchange as
// their last argument, or their first.
struct Http::Exchange {
  ~Exchange() { curl_slist_free_all(headers); }
  void AddHeader(const std::string& line) { headers = curl_slist_append(headers, line.c_str()); }

  static size_t GiveBody(char* buffer, size_t width, size_t count, void* taken) {
    Exchange& from = *static_cast<Exchange*>(taken);
    from.last_sent = absl::Now();
    if (from.left == 0) return 0;
    const size_t got = (*from.source)(buffer, width * count);
    from.left -= static_cast<int64_t>(got);
    return got == 0 ? CURL_READFUNC_ABORT : got;
  }

  static size_t TakeBody(char* bytes, size_t width, size_t count, void* taken) {
    Exchange& to = *static_cast<Exchange*>(taken);
    const absl::string_view text(bytes, width * count);
    long status = 0;
    curl_easy_getinfo(to.easy, CURLINFO_RESPONSE_CODE, &status);
    if (to.sink != nullptr && status == 200) return (*to.sink)(text) ? text.size() : 0;
    const absl::string_view kept = text.substr(0, kMaxBody - to.answer.body.size());
    absl::StrAppend(&to.answer.body, kept);
    if (kept.size() < text.size()) to.why_ended = "the answer is longer than 64 KiB";
    return kept.size();
  }

  static size_t TakeHeader(char* bytes, size_t width, size_t count, void* taken) {
    Exchange& to = *static_cast<Exchange*>(taken);
    const absl::string_view line(bytes, width * count);
    to.num_header_bytes += line.size();
    if (to.num_header_bytes > kMaxHeaderBytes) {
      to.why_ended = "the answer's headers are longer than 256 KiB";
      return 0;
    }
    if (absl::StartsWithIgnoreCase(line, "etag:")) {
      to.answer.etag = std::string(absl::StripAsciiWhitespace(line.substr(5)));
    }
    return line.size();
  }

  static curl_socket_t OpenSocket(void* taken, curlsocktype, curl_sockaddr* address) {
    Exchange& to = *static_cast<Exchange*>(taken);
    if (to.hosts == HttpHosts::kElsewhere && IsOwnOrLinkLocal(address->addr) &&
        !IsProxyOfEnvironment(address->addr)) {
      to.why_ended = "is on this machine or a link-local address, where the server's is not";
      return CURL_SOCKET_BAD;
    }
    to.why_ended = "";  // a host may have several addresses
    return socket(address->family, address->socktype | SOCK_CLOEXEC, address->protocol);
  }

  // Called at least once a second; what is not 0 ends the exchange.
  static int LookAtTime(void* taken, curl_off_t, curl_off_t received, curl_off_t, curl_off_t sent) {
    Exchange& to = *static_cast<Exchange*>(taken);
    const absl::Time now = absl::Now();
    if (received + sent != to.num_moved) to.last_moved = now;
    to.num_moved = received + sent;
    if (now - to.last_moved > absl::Seconds(kStallSeconds)) {
      to.why_ended = "nothing has come for 30 s";
    } else if (to.sink == nullptr && now - to.last_sent > to.answer_timeout) {
      to.why_ended = "the answer does not end";
    } else {
      return 0;
    }
    return 1;
  }

  CURL* easy = nullptr;
  curl_slist* headers = nullptr;
  const Source* source = nullptr;
  int64_t left = 0;                     // of what it gives
  absl::Time last_sent = absl::Now();   // of the body
  absl::Time last_moved = absl::Now();  // a byte of either body
  curl_off_t num_moved = 0;
  absl::Duration answer_timeout;
  const Sink* sink = nullptr;
  HttpHosts hosts = HttpHosts::kAny;
  size_t num_header_bytes = 0;
  const char* why_ended = "";  // by a callback; "": by none
  HttpAnswer answer;
};

Http::Http(std::string ca_file, HttpHosts hosts, absl::Duration answer_timeout)
    : ca_file_(std::move(ca_file)),
      hosts_(hosts),
      answer_timeout_(answer_timeout),
      easy_(curl_easy_init()) {}

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
  Prepare(url, exchange);
  curl_easy_setopt(exchange.easy, CURLOPT_UPLOAD, 1L);
  curl_easy_setopt(exchange.easy, CURLOPT_INFILESIZE_LARGE, static_cast<curl_off_t>(size));
  curl_easy_setopt(exchange.easy, CURLOPT_READFUNCTION, &Exchange::GiveBody);
  curl_easy_setopt(exchange.easy, CURLOPT_READDATA, &exchange);
  return Run(url, exchange);
}

absl::StatusOr<HttpAnswer> Http::Post(const std::string& url, const std::string& body) {
  Exchange exchange;
  Prepare(url, exchange);
  curl_easy_setopt(exchange.easy, CURLOPT_POST, 1L);
  curl_easy_setopt(exchange.easy, CURLOPT_POSTFIELDS, body.c_str());
  curl_easy_setopt(exchange.easy, CURLOPT_POSTFIELDSIZE_LARGE,
                   static_cast<curl_off_t>(body.size()));
  // S3 sends a space every ten seconds or so while it joins parts.
  curl_easy_setopt(exchange.easy, CURLOPT_LOW_SPEED_LIMIT, 0L);
  return Run(url, exchange);
}

absl::StatusOr<HttpAnswer> Http::Get(const std::string& url, const Sink& sink) {
  Exchange exchange;
  exchange.sink = &sink;
  Prepare(url, exchange);
  return Run(url, exchange);
}

void Http::Prepare(const std::string& url, Exchange& exchange) {
  CURL* const easy = static_cast<CURL*>(easy_);
  exchange.easy = easy;
  exchange.hosts = hosts_;
  exchange.answer_timeout = answer_timeout_;
  curl_easy_reset(easy);
  curl_easy_setopt(easy, CURLOPT_URL, url.c_str());
  curl_easy_setopt(easy, CURLOPT_PROTOCOLS_STR, "http,https");
  curl_easy_setopt(easy, CURLOPT_PATH_AS_IS, 1L);  // it is signed as it is
  curl_easy_setopt(easy, CURLOPT_NOSIGNAL, 1L);
  curl_easy_setopt(easy, CURLOPT_CONNECTTIMEOUT_MS, kConnectTimeoutMs);
  curl_easy_setopt(easy, CURLOPT_LOW_SPEED_LIMIT, kSlowest);
  curl_easy_setopt(easy, CURLOPT_LOW_SPEED_TIME, kStallSeconds);
  if (!ca_file_.empty()) curl_easy_setopt(easy, CURLOPT_CAINFO, ca_file_.c_str());
  for (const char* name : {"Expect:", "Content-Type:"}) exchange.AddHeader(name);
  curl_easy_setopt(easy, CURLOPT_HTTPHEADER, exchange.headers);
  curl_easy_setopt(easy, CURLOPT_WRITEFUNCTION, &Exchange::TakeBody);
  curl_easy_setopt(easy, CURLOPT_WRITEDATA, &exchange);
  curl_easy_setopt(easy, CURLOPT_HEADERFUNCTION, &Exchange::TakeHeader);
  curl_easy_setopt(easy, CURLOPT_HEADERDATA, &exchange);
  curl_easy_setopt(easy, CURLOPT_OPENSOCKETFUNCTION, &Exchange::OpenSocket);
  curl_easy_setopt(easy, CURLOPT_OPENSOCKETDATA, &exchange);
  curl_easy_setopt(easy, CURLOPT_NOPROGRESS, 0L);
  curl_easy_setopt(easy, CURLOPT_XFERINFOFUNCTION, &Exchange::LookAtTime);
  curl_easy_setopt(easy, CURLOPT_XFERINFODATA, &exchange);
}

absl::StatusOr<HttpAnswer> Http::Run(const std::string& url, Exchange& exchange) {
  const CURLcode code = curl_easy_perform(exchange.easy);
  long status = 0;
  curl_easy_getinfo(exchange.easy, CURLINFO_RESPONSE_CODE, &status);
  exchange.answer.status = static_cast<int>(status);
  // A server may refuse a request and close the connection before it has read the body.
  if (code == CURLE_OK || status >= 400) return std::move(exchange.answer);
  const absl::string_view why = exchange.why_ended;
  return absl::UnavailableError(
      absl::StrCat(WithoutQuery(url), ": ", why.empty() ? curl_easy_strerror(code) : why));
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
