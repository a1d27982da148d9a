#include "core/store/blobs/http_client.h"

#include <curl/curl.h>

#include <algorithm>
#include <new>

#include "absl/strings/ascii.h"
#include "absl/strings/str_cat.h"
#include "core/base/steady_cond_var.h"

namespace liquidblend::store {
namespace {

constexpr int kPollMs = 200;                           // between two checks for stalled exchanges
constexpr int kGraceFactor = 3;                        // of stall timeouts, before the rate counts
constexpr size_t kMaxHeaderBytes = size_t{256} << 10;  // of an answer, interim ones included
constexpr double kLeastRate = 16 << 10;                // bytes per second, of the whole exchange

struct FreeEasy {
  void operator()(CURL* easy) const { curl_easy_cleanup(easy); }
};
struct FreeList {
  void operator()(curl_slist* list) const { curl_slist_free_all(list); }
};

// One request on its way.
struct Exchange {
  std::unique_ptr<CURL, FreeEasy> easy;
  std::unique_ptr<curl_slist, FreeList> headers;
  int64_t max_answer_bytes = 0;
  size_t header_bytes = 0;  // so far
  bool is_too_long = false;
  bool is_out_of_memory = false;
  bool is_stalled = false;
  bool is_too_slow = false;
  bool is_stopped = false;
  const std::atomic<bool>* stop = nullptr;  // of the request
  absl::Duration stall_timeout;
  absl::Duration drip_limit;
  curl_off_t num_moved = 0;  // bytes, both ways
  const base::SteadyClock::time_point begin = base::SteadyClock::now();
  base::SteadyClock::time_point moved_at = begin;
  HttpAnswer answer;
  CURLcode code = CURLE_FAILED_INIT;
};

size_t TakeBody(char* bytes, size_t size, size_t count, void* exchange_pointer) {
  Exchange& exchange = *static_cast<Exchange*>(exchange_pointer);
  const size_t num_bytes = size * count;
  if (exchange.answer.body.size() + num_bytes > static_cast<size_t>(exchange.max_answer_bytes)) {
    exchange.is_too_long = true;
    return 0;
  }
  try {
    exchange.answer.body.append(bytes, num_bytes);
  } catch (const std::bad_alloc&) {
    exchange.is_out_of_memory = true;
    return 0;
  }
  return num_bytes;
}

// Nothing may be thrown through libcurl.
size_t TakeHeader(char* bytes, size_t size, size_t count, void* exchange_pointer) {
  Exchange& exchange = *static_cast<Exchange*>(exchange_pointer);
  const absl::string_view line(bytes, size * count);
  exchange.header_bytes += line.size();
  if (exchange.header_bytes > kMaxHeaderBytes) {
    exchange.is_too_long = true;
    return 0;
  }
  const size_t colon = line.find(':');
  if (colon == absl::string_view::npos) return line.size();
  try {
    exchange.answer.headers[absl::AsciiStrToLower(line.substr(0, colon))] =
        std::string(absl::StripAsciiWhitespace(line.substr(colon + 1)));
  } catch (const std::bad_alloc&) {
    exchange.is_out_of_memory = true;
    return 0;
  }
  return line.size();
}

// Whether an exchange drips: some bytes now and then, so that it would never stand still.
bool IsTooSlow(const Exchange& exchange) {
  const absl::Duration over = base::Since(exchange.begin) - exchange.drip_limit;
  return absl::ToDoubleSeconds(over) * kLeastRate > static_cast<double>(exchange.num_moved);
}

// Ends an exchange that stands still, drips or is not wanted any more. (CURLOPT_LOW_SPEED_TIME
// takes some five seconds longer.)
int WatchProgress(void* exchange_pointer, curl_off_t, curl_off_t num_received, curl_off_t,
                  curl_off_t num_sent) {
  Exchange& exchange = *static_cast<Exchange*>(exchange_pointer);
  if (num_received + num_sent != exchange.num_moved) {
    exchange.num_moved = num_received + num_sent;
    exchange.moved_at = base::SteadyClock::now();
  }
  exchange.is_stalled = base::Since(exchange.moved_at) > exchange.stall_timeout;
  exchange.is_too_slow = IsTooSlow(exchange);
  exchange.is_stopped = exchange.stop != nullptr && *exchange.stop;
  return exchange.is_stalled || exchange.is_too_slow || exchange.is_stopped ? 1 : 0;
}

void AddHeader(const std::string& line, Exchange& exchange) {
  curl_slist* const longer = curl_slist_append(exchange.headers.get(), line.c_str());
  if (longer == nullptr) throw std::bad_alloc();
  static_cast<void>(exchange.headers.release());
  exchange.headers.reset(longer);
}

void SetBody(const HttpRequest& request, CURL* easy) {
  if (request.method == "HEAD") {
    curl_easy_setopt(easy, CURLOPT_NOBODY, 1L);
  } else if (request.method != "GET") {
    curl_easy_setopt(easy, CURLOPT_POST, 1L);
    curl_easy_setopt(
        easy, CURLOPT_POSTFIELDS,
        request.body.empty() ? "" : reinterpret_cast<const char*>(request.body.data()));
    curl_easy_setopt(easy, CURLOPT_POSTFIELDSIZE_LARGE,
                     static_cast<curl_off_t>(request.body.size()));
    curl_easy_setopt(easy, CURLOPT_CUSTOMREQUEST, request.method.c_str());
  }
}

std::unique_ptr<Exchange> Prepare(const HttpRequest& request, const HttpOptions& options) {
  auto exchange = std::make_unique<Exchange>();
  exchange->easy.reset(curl_easy_init());
  CURL* const easy = exchange->easy.get();
  if (easy == nullptr) throw std::bad_alloc();
  exchange->max_answer_bytes = request.max_answer_bytes;
  curl_easy_setopt(easy, CURLOPT_URL, request.url.c_str());
  curl_easy_setopt(easy, CURLOPT_PROTOCOLS_STR, "http,https");
  curl_easy_setopt(easy, CURLOPT_PATH_AS_IS, 1L);  // it is signed as it is
  curl_easy_setopt(easy, CURLOPT_NOSIGNAL, 1L);
  curl_easy_setopt(easy, CURLOPT_CONNECTTIMEOUT_MS,
                   static_cast<long>(absl::ToInt64Milliseconds(options.connect_timeout)));
  exchange->stall_timeout = std::max(options.connect_timeout, options.stall_timeout);
  exchange->drip_limit = std::max(request.drip_limit, kGraceFactor * exchange->stall_timeout);
  curl_easy_setopt(easy, CURLOPT_NOPROGRESS, 0L);
  curl_easy_setopt(easy, CURLOPT_XFERINFOFUNCTION, WatchProgress);
  curl_easy_setopt(easy, CURLOPT_XFERINFODATA, exchange.get());
  if (!options.ca_file.empty()) curl_easy_setopt(easy, CURLOPT_CAINFO, options.ca_file.c_str());
  if (!options.is_proxied) curl_easy_setopt(easy, CURLOPT_NOPROXY, "*");
  exchange->stop = request.stop;
  // Otherwise the end waits for a name that is being looked up.
  if (request.stop != nullptr) curl_easy_setopt(easy, CURLOPT_QUICK_EXIT, 1L);
  SetBody(request, easy);
  for (const auto& [name, value] : request.headers) {
    AddHeader(absl::StrCat(name, ": ", value), *exchange);
  }
  // Removes headers that curl adds, which are neither signed nor needed.
  for (const char* name : {"Expect:", "Content-Type:", "Accept:"}) AddHeader(name, *exchange);
  curl_easy_setopt(easy, CURLOPT_HTTPHEADER, exchange->headers.get());
  curl_easy_setopt(easy, CURLOPT_WRITEFUNCTION, TakeBody);
  curl_easy_setopt(easy, CURLOPT_WRITEDATA, exchange.get());
  curl_easy_setopt(easy, CURLOPT_HEADERFUNCTION, TakeHeader);
  curl_easy_setopt(easy, CURLOPT_HEADERDATA, exchange.get());
  return exchange;
}

absl::StatusOr<HttpAnswer> AnswerOf(Exchange& exchange, const HttpRequest& request) {
  if (exchange.is_out_of_memory || exchange.code == CURLE_OUT_OF_MEMORY) throw std::bad_alloc();
  if (exchange.is_too_long) {
    return absl::ResourceExhaustedError(
        exchange.header_bytes > kMaxHeaderBytes
            ? absl::StrCat("headers of more than ", kMaxHeaderBytes, " bytes")
            : absl::StrCat("an answer of more than ", request.max_answer_bytes, " bytes"));
  }
  if (exchange.code == CURLE_URL_MALFORMAT || exchange.code == CURLE_UNSUPPORTED_PROTOCOL) {
    return absl::InvalidArgumentError(curl_easy_strerror(exchange.code));
  }
  if (exchange.is_stopped) return absl::UnavailableError("stopped");
  if (exchange.is_stalled) {
    return absl::UnavailableError(
        absl::StrCat("no progress for ", absl::FormatDuration(exchange.stall_timeout)));
  }
  if (exchange.is_too_slow) {
    return absl::UnavailableError(absl::StrCat(
        "too slow: ", exchange.num_moved, " bytes in ",
        absl::FormatDuration(absl::Trunc(base::Since(exchange.begin), absl::Milliseconds(1)))));
  }
  if (exchange.code != CURLE_OK) {
    return absl::UnavailableError(curl_easy_strerror(exchange.code));
  }
  long status = 0;
  curl_easy_getinfo(exchange.easy.get(), CURLINFO_RESPONSE_CODE, &status);
  exchange.answer.status = static_cast<int>(status);
  return std::move(exchange.answer);
}

}  // namespace

// Connections of one thread at a time.
class HttpClient::Connections {
 public:
  Connections() : multi_(curl_multi_init()) {
    if (multi_ == nullptr) throw std::bad_alloc();
  }
  ~Connections() { curl_multi_cleanup(multi_); }
  Connections(const Connections&) = delete;
  Connections& operator=(const Connections&) = delete;

  void Run(std::span<const std::unique_ptr<Exchange>> exchanges) {
    for (const auto& exchange : exchanges) {
      curl_easy_setopt(exchange->easy.get(), CURLOPT_PRIVATE, exchange.get());
      curl_multi_add_handle(multi_, exchange->easy.get());
    }
    int num_running = 1;
    while (num_running > 0 && curl_multi_perform(multi_, &num_running) == CURLM_OK) {
      if (num_running > 0) curl_multi_poll(multi_, nullptr, 0, kPollMs, nullptr);
    }
    int num_left = 0;
    while (const CURLMsg* message = curl_multi_info_read(multi_, &num_left)) {
      void* exchange = nullptr;
      curl_easy_getinfo(message->easy_handle, CURLINFO_PRIVATE, &exchange);
      static_cast<Exchange*>(exchange)->code = message->data.result;
    }
    for (const auto& exchange : exchanges) curl_multi_remove_handle(multi_, exchange->easy.get());
  }

 private:
  CURLM* multi_;
};

HttpClient::HttpClient(HttpOptions options) : options_(std::move(options)) {
  static const CURLcode initialised = curl_global_init(CURL_GLOBAL_ALL);
  static_cast<void>(initialised);
}

HttpClient::~HttpClient() = default;

std::vector<absl::StatusOr<HttpAnswer>> HttpClient::Run(std::span<const HttpRequest> requests) {
  std::vector<std::unique_ptr<Exchange>> exchanges;
  for (const HttpRequest& request : requests) exchanges.push_back(Prepare(request, options_));
  std::unique_ptr<Connections> connections;
  {
    const absl::MutexLock lock(&mutex_);
    if (!idle_.empty()) {
      connections = std::move(idle_.back());
      idle_.pop_back();
    }
  }
  if (connections == nullptr) connections = std::make_unique<Connections>();
  connections->Run(exchanges);
  std::vector<absl::StatusOr<HttpAnswer>> answers;
  for (size_t k = 0; k < requests.size(); ++k) {
    answers.push_back(AnswerOf(*exchanges[k], requests[k]));
  }
  const absl::MutexLock lock(&mutex_);
  idle_.push_back(std::move(connections));
  return answers;
}

}  // namespace liquidblend::store
