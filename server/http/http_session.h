// A connection of HTTP/1.1. Only for port.cc.
#pragma once

#include <sys/socket.h>

#include <cstdint>
#include <limits>
#include <memory>
#include <new>
#include <optional>
#include <string>
#include <utility>

#include "absl/strings/str_cat.h"
#include "absl/time/clock.h"
#include "server/base/errors.h"
#include "server/base/guarded.h"
#include "server/base/request_id.h"
#include "server/http/body_reader.h"
#include "server/http/core.h"
#include "server/http/exchange/replies.h"
#include "server/http/line_writer.h"
#include "server/http/request_of.h"
#include "server/http/web_socket_session.h"

namespace liquidblend::http {

// Requests and answers, one after the other. All but OnPhase() runs on its strand.
class HttpSession final : public Connection, public std::enable_shared_from_this<HttpSession> {
 public:
  HttpSession(std::shared_ptr<Core> core, Connections::Ticket ticket, tcp::socket socket,
              std::string peer)
      : core_(std::move(core)),
        ticket_(std::move(ticket)),
        stream_(std::move(socket)),
        peer_(std::move(peer)),
        buffer_(static_cast<size_t>(core_->options.max_header_bytes) + kReadAhead) {
    core_->api.metrics().AddConnections("http", 1);
  }

  ~HttpSession() override { core_->api.metrics().AddConnections("http", -1); }

  void Begin() {
    ticket_.Watch(shared_from_this());
    asio::dispatch(stream_.get_executor(), [self = shared_from_this()] { self->ReadHeader(); });
  }

  void OnPhase(Phase phase) override {
    asio::post(stream_.get_executor(), [self = shared_from_this(), phase] {
      if (self->lines_.has_value()) self->lines_->Stop();
      if (phase == Phase::kDraining) return;
      self->is_last_ = true;
      if (self->is_reading_ || phase == Phase::kAborting) self->stream_.close();
    });
  }

 private:
  static constexpr char kDateFormat[] = "%a, %d %b %E4Y %H:%M:%S GMT";
  static constexpr std::chrono::seconds kLinger{2};  // for a client to read its refusal
  static constexpr size_t kDiscarded = 4096;
  static constexpr size_t kReadAhead = 64 << 10;  // also the longest line between two chunks
  static constexpr char kContinue[] = "HTTP/1.1 100 Continue\r\n\r\n";

  void ReadHeader() {
    if (is_last_) return;
    if (reader_.has_value()) {
      reader_.reset();
      buffer_.shrink_to_fit();
    }
    parser_.emplace();
    parser_->header_limit(static_cast<uint32_t>(core_->options.max_header_bytes));
    parser_->body_limit(std::numeric_limits<uint64_t>::max());  // that is the exchange's
    stream_.expires_after(ChronoOf(core_->options.idle_timeout));
    is_reading_ = true;
    is_head_ = false;
    version_ = 11;
    bhttp::async_read_header(stream_, buffer_, *parser_,
                             [self = shared_from_this()](error_code error, size_t) {
                               self->is_reading_ = false;
                               error ? self->OnBadHeader(error) : self->OnHeader();
                             });
  }

  void OnHeader() {
    is_watched_ = false;
    const HttpRequest& message = parser_->get();
    const Request request = RequestOf(*parser_, peer_);
    if (message.version() > 0) version_ = message.version();
    // Until the body has been read, which need not happen.
    is_last_ |= request.has_body || !message.keep_alive();
    is_head_ = message.method() == bhttp::verb::head;
    // Transfer codings other than chunked do not say where the body ends.
    const bool is_coded = message.count(bhttp::field::transfer_encoding) > 0;
    if (is_coded && !parser_->chunked())
      return Refuse(request, "Transfer-Encoding is not chunked", 400);
    if (websocket::is_upgrade(message) && core_->router.IsStream(request)) return Upgrade(request);
    stream_.expires_never();
    exchange_ = core_->router.Answer(request, [self = shared_from_this()](Response response) {
      self->Take(std::move(response));
    });
    exchange_->body == nullptr ? WatchClient() : Attempt([this] { BeginBody(); });
  }

  // Takes an answer, on any thread. If there is no memory for that, the connection ends: its next
  // read sees the end of the socket, which only its own strand may close. A strand to which a post
  // fails stays locked for ever, so the answer gets there by way of a thread of the context.
  void Take(Response response) {
    try {
      asio::post(core_->io, [self = shared_from_this(), response = std::move(response)]() mutable {
        const auto strand = self->stream_.get_executor();
        asio::dispatch(strand, [self = std::move(self), response = std::move(response)]() mutable {
          self->WriteOrClose(std::move(response));
        });
      });
    } catch (const std::bad_alloc&) {
      shutdown(stream_.socket().native_handle(), SHUT_RDWR);
    }
  }

  void BeginBody() {
    const HttpRequest& message = parser_->get();
    keeps_alive_ = message.keep_alive();
    const bool waits = beast::iequals(message[bhttp::field::expect], "100-continue");
    reader_.emplace(stream_, buffer_, std::move(*parser_), core_->options.idle_timeout);
    if (!waits) return ReadBody();
    stream_.expires_after(ChronoOf(core_->options.write_timeout));
    asio::async_write(stream_, asio::buffer(kContinue, sizeof(kContinue) - 1),
                      [self = shared_from_this()](error_code error, size_t) {
                        error ? self->OnLostBody() : self->ReadBody();
                      });
  }

  void ReadBody() {
    reader_->Read([self = shared_from_this()](error_code error) {
      error ? self->OnLostBody() : self->Attempt([&] { self->OnPiece(); });
    });
  }

  // Runs a step of reading; an exception ends the call and the connection.
  template <typename Step>
  void Attempt(Step&& step) {
    const ExchangePtr exchange = exchange_;
    const absl::Status status = server::Guarded([&] {
      step();
      return absl::OkStatus();
    });
    if (status.ok()) return;
    is_last_ = true;
    exchange->Fail(status);
  }

  void OnPiece() {
    const bool is_last = reader_->is_last();
    if (is_last) is_last_ = !keeps_alive_ || core_->connections->phase() >= Phase::kStopping;
    exchange_->body->Take(reader_->piece(), is_last, [self = shared_from_this()] {
      asio::post(self->stream_.get_executor(), [self] { self->ReadBody(); });
    });
    if (is_last) WatchClient();
  }

  // The client has gone, or was too slow, or has sent what is no body.
  void OnLostBody() {
    stream_.close();
    exchange_->Cancel();
    exchange_->Fail(absl::CancelledError("the request's body did not arrive"));
  }

  // Watches the client while its answer is being made, which is cancelled if the client goes away.
  void WatchClient() {
    is_watched_ = true;
    if (std::exchange(is_waiting_, true)) return;
    const auto look = [self = shared_from_this()](error_code error) {
      self->is_waiting_ = false;
      if (!self->is_watched_ || self->exchange_ == nullptr) return;
      error ? self->OnGone() : self->OnReadable();
    };
    stream_.socket().async_wait(tcp::socket::wait_read, look);
  }

  // Either the client has closed the connection, or it sends its next requests already. Those for
  // which there is no room get no answer, as only reading on tells whether the client is there.
  void OnReadable() {
    const size_t limit = static_cast<size_t>(core_->options.max_header_bytes);
    if (buffer_.size() >= limit) {
      is_last_ = true;
      buffer_.clear();
    }
    error_code error;
    const auto room = buffer_.prepare(limit - buffer_.size());
    buffer_.commit(stream_.socket().read_some(room, error));
    error&& error != asio::error::would_block ? OnGone() : WatchClient();
  }

  void OnGone() {
    is_last_ = true;
    stream_.close();
    std::exchange(exchange_, nullptr)->Cancel();
  }

  // A client that has gone, or was too slow, gets no answer.
  void OnBadHeader(error_code error) {
    const bool is_malformed = error.category() == error_code(bhttp::error::bad_method).category() &&
                              error != bhttp::error::end_of_stream &&
                              error != bhttp::error::partial_message;
    if (!is_malformed) return;
    const bool is_long = error == bhttp::error::header_limit;
    Request request;
    request.peer = peer_;
    Refuse(request,
           is_long ? absl::StrCat("the request's header is longer than ",
                                  core_->options.max_header_bytes, " bytes")
                   : absl::StrCat("not an HTTP/1.1 request: ", error.message()),
           is_long ? 431 : 400);
  }

  // Answers a request that does not reach the router, and ends the connection.
  void Refuse(const Request& request, const std::string& why, int code) {
    is_last_ = true;
    Write(core_->router.Refused(request, CallerOf(request),
                                ErrorReply(absl::InvalidArgumentError(why), code)));
  }

  void Upgrade(const Request& request) {
    StreamVisit visit = {CallerOf(request), {}, {}};
    absl::Status verdict = server::ShuttingDown();
    if (core_->connections->phase() == Phase::kServing) {
      verdict = core_->router.AdmitStream(request, visit);
    }
    if (!verdict.ok()) {
      is_last_ = true;
      return Write(core_->router.Refused(request, visit.caller, ErrorReply(verdict)));
    }
    const auto session = std::make_shared<WebSocketSession>(core_, std::move(ticket_),
                                                            std::move(stream_), std::move(visit));
    session->Begin(parser_->get());
  }

  // A client whose answer cannot be written, for lack of memory, would wait for it.
  void WriteOrClose(Response response) {
    try {
      Write(std::move(response));
    } catch (...) {
      stream_.close();
      throw;  // Port::Impl::Run() tells of it
    }
  }

  void Write(Response response) {
    SetHeader(response);
    const bool has_lines = response.lines != nullptr && !is_head_;
    if (!has_lines) exchange_ = nullptr;
    response_.body() = std::move(response.body);
    memory_ = std::move(response.memory);
    span_ = std::move(response.span);
    if (span_.is_recording()) write_began_ = absl::Now();
    if (response.lines != nullptr) {
      is_last_ |= version_ < 11;
      response_.chunked(version_ >= 11);
    } else if (response.left_out_bytes.has_value()) {
      response_.content_length(*response.left_out_bytes);
    } else if (response.code != 204 && response.code != 304) {
      response_.prepare_payload();
    }
    serializer_.emplace(response_);
    stream_.expires_after(ChronoOf(core_->options.write_timeout));
    is_frame_ = response.is_frame;
    write_.Lap();
    if (has_lines) return WriteLines(std::move(response.lines));
    const auto written = [self = shared_from_this()](error_code error, size_t) {
      if (!error) self->OnWritten();
    };
    is_head_ ? bhttp::async_write_header(stream_, *serializer_, written)
             : bhttp::async_write(stream_, *serializer_, written);
  }

  void SetHeader(const Response& response) {
    response_ = HttpResponse(static_cast<bhttp::status>(response.code), version_);
    response_.set(bhttp::field::server, kServerName);
    response_.set(bhttp::field::date,
                  absl::FormatTime(kDateFormat, absl::Now(), absl::UTCTimeZone()));
    for (const auto& [name, value] : response.headers) response_.set(name, value);
    response_.keep_alive(!is_last_);
  }

  // The client goes on being watched meanwhile.
  void WriteLines(std::shared_ptr<LineSource> lines) {
    lines_.emplace(stream_, std::move(lines), version_ >= 11, core_->options.write_timeout);
    if (core_->connections->phase() != Phase::kServing) lines_->Stop();
    bhttp::async_write_header(
        stream_, *serializer_, [self = shared_from_this()](error_code error, size_t) {
          if (error) return self->OnLinesWritten(error);
          HttpSession& session = *self;
          session.lines_->Run(self, [&session](error_code late) { session.OnLinesWritten(late); });
        });
  }

  void OnLinesWritten(error_code error) {
    lines_.reset();
    if (exchange_ != nullptr && error) exchange_->Cancel();
    exchange_ = nullptr;
    if (!error) OnWritten();
  }

  void OnWritten() {
    response_ = {};
    memory_ = nullptr;
    if (is_frame_) core_->api.metrics().ObserveStage(metrics::Stage::kWrite, write_.Lap());
    if (is_frame_ && span_.is_recording()) span_.RecordChild("write", write_began_, absl::Now());
    span_.End();
    span_ = {};
    is_last_ ? Linger() : ReadHeader();
  }

  // Closing with unread bytes would take the answer away from the client.
  void Linger() {
    error_code ignored;
    stream_.socket().shutdown(tcp::socket::shutdown_send, ignored);
    stream_.expires_after(kLinger);
    Discard();
  }

  void Discard() {
    buffer_.clear();
    stream_.async_read_some(buffer_.prepare(kDiscarded),
                            [self = shared_from_this()](error_code error, size_t) {
                              if (!error) self->Discard();
                            });
  }

  const std::shared_ptr<Core> core_;  // destroyed last
  Connections::Ticket ticket_;
  beast::tcp_stream stream_;
  const std::string peer_;
  beast::flat_buffer buffer_;  // may hold requests that follow
  std::optional<bhttp::request_parser<bhttp::empty_body>> parser_;
  HttpResponse response_;
  std::shared_ptr<void> memory_;  // of its body
  trace::Span span_;              // of its call, which ends when it has been written
  absl::Time write_began_;
  std::optional<bhttp::response_serializer<bhttp::string_body>> serializer_;
  ExchangePtr exchange_;              // while its answer is being made
  std::optional<BodyReader> reader_;  // of the request's body, if it has one
  std::optional<LineWriter> lines_;   // of the answer, while they are written
  unsigned version_ = 11;             // of the request: 10 or 11
  bool keeps_alive_ = false;          // so says the client
  bool is_reading_ = false;
  bool is_waiting_ = false;  // for what the client does, since WatchClient()
  bool is_watched_ = false;  // while its answer is being made; not while its request is read
  bool is_head_ = false;
  bool is_frame_ = false;
  bool is_last_ = false;  // the connection ends after this answer
  metrics::StopWatch write_;
};

}  // namespace liquidblend::http
