#include "core/trace/exporter.h"

#include <algorithm>
#include <cstddef>
#include <exception>
#include <span>
#include <utility>

#include "absl/strings/str_cat.h"
#include "core/trace/otlp.h"

namespace liquidblend::trace {
namespace {

constexpr absl::Duration kReportInterval = absl::Minutes(1);
constexpr absl::Duration kFirstPause = absl::Seconds(1);  // between two attempts; doubles
constexpr absl::Duration kConnectTimeout = absl::Seconds(5);
constexpr int64_t kMaxAnswerBytes = int64_t{64} << 10;

store::HttpOptions HttpOptionsOf(const TracerOptions& options) {
  store::HttpOptions http;
  http.ca_file = options.ca_file;
  http.connect_timeout = std::min(options.timeout, kConnectTimeout);
  http.stall_timeout = options.timeout;
  return http;
}

// Without what may be a credential: user, password and query.
std::string ShownUrl(const std::string& url) {
  const size_t host = url.find("//") + 2;
  const size_t end = std::min(url.find_first_of("/?#", host), url.size());
  const size_t at = url.substr(host, end - host).rfind('@');
  const size_t begin = at == std::string::npos ? host : host + at + 1;
  return url.substr(0, host) + url.substr(begin, url.find_first_of("?#", begin) - begin);
}

absl::Status StatusOf(const store::HttpAnswer& answer) {
  const int status = answer.status;
  if (status >= 200 && status < 300) return absl::OkStatus();
  const std::string message = absl::StrCat("HTTP status ", status);
  const bool is_transient = status == 429 || status == 502 || status == 503 || status == 504;
  return is_transient ? absl::UnavailableError(message) : absl::InternalError(message);
}

}  // namespace

Exporter::Exporter(TracerOptions options, std::shared_ptr<SpanQueue> queue, Report report)
    : options_(std::move(options)),
      shown_url_(ShownUrl(options_.url)),
      queue_(std::move(queue)),
      report_(std::move(report)),
      http_(HttpOptionsOf(options_)),
      reported_at_(base::SteadyClock::now() - absl::ToChronoNanoseconds(kReportInterval)),
      thread_([this] { Run(); }) {}

Exporter::~Exporter() { Stop(absl::ZeroDuration()); }

void Exporter::Stop(absl::Duration patience) {
  queue_->Close();
  {
    absl::MutexLock lock(&mutex_);
    const auto has_ended = [this] {
      mutex_.AssertHeld();
      return has_ended_;
    };
    ended_.Await(&mutex_, has_ended, patience);
  }
  is_given_up_ = true;
  if (thread_.joinable()) thread_.join();
}

void Exporter::Run() {
  bool is_last = false;
  while (!is_last) {
    const bool is_closed = queue_->is_closed();
    std::vector<SpanRecord> spans;
    try {
      spans = queue_->Take(options_.batch_spans, options_.delay);
      if (!spans.empty()) Export(spans);
      ReportDropped(queue_->stats());
    } catch (const std::exception&) {  // no memory: the job that has used it up is about to end
      queue_->CountRefused(static_cast<int64_t>(spans.size()));
    }
    is_last = is_closed && (queue_->empty() || is_given_up_);
  }
  absl::MutexLock lock(&mutex_);
  has_ended_ = true;
  ended_.SignalAll();
}

void Exporter::Export(const std::vector<SpanRecord>& spans) {
  const auto num_spans = static_cast<int64_t>(spans.size());
  const std::string body = ToOtlpJson(options_.resource, spans);
  absl::Status status = absl::UnavailableError("the program has ended");
  for (int attempt = 0; attempt < kAttempts && !is_given_up_; ++attempt) {
    if (attempt > 0) queue_->Pause(kFirstPause * (1 << (attempt - 1)));
    status = Send(body, num_spans);
    if (!absl::IsUnavailable(status) || queue_->is_closed()) break;
  }
  if (status.ok()) return;
  last_error_ = status;
  queue_->CountRefused(num_spans);
}

absl::Status Exporter::Send(const std::string& body, int64_t num_spans) {
  store::HttpRequest request;
  request.method = "POST";
  request.url = options_.url;
  request.headers = options_.headers;
  request.headers.emplace_back("Content-Type", "application/json");
  request.body = std::as_bytes(std::span(body));
  request.max_answer_bytes = kMaxAnswerBytes;
  request.stop = &is_given_up_;
  const std::vector<absl::StatusOr<store::HttpAnswer>> answers = http_.Run({&request, 1});
  if (!answers[0].ok()) return answers[0].status();
  const absl::Status status = StatusOf(*answers[0]);
  if (!status.ok()) return status;
  const int64_t num_rejected = std::min(NumRejected(answers[0]->body), num_spans);
  queue_->CountRefused(num_rejected);
  queue_->CountExported(num_spans - num_rejected);
  if (num_rejected > 0) last_error_ = absl::InternalError("the collector did not take them");
  return absl::OkStatus();
}

void Exporter::ReportDropped(const SpanStats& stats) {
  const int64_t num_new = stats.num_dropped() - num_reported_;
  if (num_new == 0 || base::Since(reported_at_) < kReportInterval) return;
  num_reported_ = stats.num_dropped();
  reported_at_ = base::SteadyClock::now();
  std::string line =
      absl::StrCat("traces: ", num_new, " spans dropped; since the start ", stats.num_over_rate,
                   " beyond the rate, ", stats.num_over_queue, " beyond the queue, ",
                   stats.num_refused, " not taken by ", shown_url_);
  if (!last_error_.ok()) absl::StrAppend(&line, ": ", last_error_.message());
  report_(line);
}

}  // namespace liquidblend::trace
