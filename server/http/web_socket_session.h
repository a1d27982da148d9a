// A WebSocket that carries a stream of frames. Only for port.cc.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <utility>

#include "absl/strings/string_view.h"
#include "server/base/guarded.h"
#include "server/base/request_id.h"
#include "server/http/core.h"
#include "server/http/exchange/replies.h"

namespace liquidblend::http {

// A stream of frames over a WebSocket. All but OnPhase() runs on its strand. A read is always under
// way, and its failure ends the session; from its close on, Boost.Beast's close reads by itself.
class WebSocketSession final : public Connection,
                               public server::StreamSession::Sink,
                               public std::enable_shared_from_this<WebSocketSession> {
 public:
  WebSocketSession(std::shared_ptr<Core> core, Connections::Ticket ticket, beast::tcp_stream stream,
                   StreamVisit visit)
      : core_(std::move(core)),
        ticket_(std::move(ticket)),
        visit_(std::move(visit)),
        ws_(std::move(stream)),
        executor_(ws_->get_executor()),
        close_timer_(executor_) {
    metrics().AddConnections("websocket", 1);
  }

  ~WebSocketSession() override {
    server::RunGuarded("the end of a WebSocket", [this] {
      if (frames_ != nullptr) frames_->Stop();
    });
    metrics().AddConnections("websocket", -1);
    core_->router.NoteStream(visit_.caller, EndCode(), EndReason(), watch_.Lap());
  }

  void Begin(const HttpRequest& request) {
    ticket_.Watch(shared_from_this());
    beast::get_lowest_layer(*ws_).expires_never();
    const std::chrono::nanoseconds close = ChronoOf(core_->options.close_timeout);
    const std::chrono::nanoseconds idle = ChronoOf(core_->options.idle_timeout);
    ws_->set_option(websocket::stream_base::timeout{close, idle, /*keep_alive_pings=*/true});
    const std::string request_id = visit_.caller.request_id;
    ws_->set_option(websocket::stream_base::decorator(
        [request_id, has_protocol = visit_.protocols.has_ours](websocket::response_type& response) {
          if (has_protocol) response.set(bhttp::field::sec_websocket_protocol, kStreamProtocol);
          response.set(bhttp::field::server, kServerName);
          response.set(server::kRequestIdHeader, request_id);
        }));
    ws_->read_message_max(static_cast<size_t>(core_->options.max_message_bytes));
    ws_->auto_fragment(false);
    ws_->binary(true);
    ws_->async_accept(request, [self = shared_from_this()](error_code error) {
      if (!error) self->OnAccepted();
    });
  }

  void OnPhase(Phase phase) override {
    asio::post(executor_, [self = shared_from_this(), phase] {
      if (phase == Phase::kAborting) return self->Abort();
      self->Close(websocket::close_code::going_away, "the server is shutting down");
    });
  }

  void Send(const server::StreamedFrame& streamed) override {
    asio::post(executor_, [self = shared_from_this(), streamed] { self->Write(streamed); });
  }

  std::string account() const override { return visit_.caller.principal.key; }

  // The write under way ends with the connection.
  void GiveUp() override {
    asio::post(executor_, [self = shared_from_this()] { self->Abort(); });
  }

  void End(const absl::Status& status) override {
    asio::post(executor_, [self = shared_from_this(), status] {
      self->Close(static_cast<uint16_t>(CloseCode(status)), CloseReason(status));
    });
  }

 private:
  static constexpr std::chrono::milliseconds kAbortDelay{100};

  metrics::Metrics& metrics() { return core_->api.metrics(); }

  void OnAccepted() {
    is_open_ = true;
    frames_ =
        core_->api.OpenStream(visit_.caller.principal.key, weak_from_this(), visit_.caller.span);
    if (close_.has_value()) return Finish();
    Read();
  }

  void Read() {
    ws_->async_read(inbox_,
                    [self = shared_from_this()](error_code error, size_t) { self->OnRead(error); });
  }

  void OnRead(error_code error) {
    if (error || !ws_.has_value()) return frames_->Stop();
    v1::StreamFramesRequest request;
    const bool is_read =
        request.ParseFromArray(inbox_.data().data(), static_cast<int>(inbox_.size()));
    inbox_.consume(inbox_.size());
    if (!ws_->got_binary()) {
      Close(websocket::close_code::unknown_data, "messages are binary StreamFramesRequest");
    } else if (!is_read) {
      Close(websocket::close_code::bad_payload, "the message is not a StreamFramesRequest");
    } else if (!close_.has_value()) {
      frames_->OnRequest(request);
    }
    if (!has_close_begun_) Read();
  }

  // Writes the cached bytes of the frame.
  void Write(const server::StreamedFrame& streamed) {
    if (close_.has_value() || !ws_.has_value()) return;
    prefix_ = server::ResponsePrefix(streamed);
    frame_ = streamed.frame;
    is_writing_ = true;
    write_.Lap();
    const std::array<asio::const_buffer, 2> message = {asio::buffer(prefix_),
                                                       asio::buffer(*frame_)};
    ws_->async_write(
        message, [self = shared_from_this()](error_code error, size_t) { self->OnWritten(error); });
  }

  void OnWritten(error_code error) {
    is_writing_ = false;
    frame_ = nullptr;
    if (error || !ws_.has_value()) return frames_->Stop();
    metrics().ObserveStage(metrics::Stage::kWrite, write_.Lap());
    close_.has_value() ? Finish() : frames_->OnWritten();
  }

  // Only the first end counts. The close frame follows the frame that is being written.
  void Close(uint16_t code, const std::string& reason) {
    if (close_.has_value()) return;
    close_ = websocket::close_reason(static_cast<websocket::close_code>(code), reason);
    if (is_open_ && !is_writing_) Finish();
  }

  void Finish() {
    frames_->Stop();
    if (!ws_.has_value()) return;
    has_close_begun_ = true;
    ws_->async_close(*close_, [self = shared_from_this()](error_code) {});
    // If a read under way finds a malformed frame before the close frame is written, Boost.Beast
    // 1.74 deadlocks: read and close wait for each other, and its timeout only closes the socket.
    After(ChronoOf(core_->options.close_timeout), &WebSocketSession::Abort);
  }

  void Abort() {
    if (frames_ != nullptr) frames_->Stop();
    if (!ws_.has_value()) return;
    beast::get_lowest_layer(*ws_).close();
    After(kAbortDelay, &WebSocketSession::Release);
  }

  // Drops operations that wait for each other, which hold the session. Those that waited for the
  // socket, and refer to it, have ended when it was closed.
  void Release() {
    client_close_ = ws_->reason();
    ws_.reset();
  }

  // Runs `step` after the delay, unless the session has ended by then, or After() is called again.
  void After(std::chrono::nanoseconds delay, void (WebSocketSession::*step)()) {
    close_timer_.expires_after(delay);
    close_timer_.async_wait([weak = weak_from_this(), step](error_code error) {
      const std::shared_ptr<WebSocketSession> self = weak.lock();
      if (!error && self != nullptr) ((*self).*step)();
    });
  }

  // What the client's close frame says; empty if none came.
  const websocket::close_reason& client_close() const {
    return ws_.has_value() ? ws_->reason() : client_close_;
  }

  int EndCode() const {
    return close_.has_value() ? close_->code : ClientCloseCode(client_close().code);
  }

  absl::string_view EndReason() const {
    const websocket::close_reason& reason = close_.has_value() ? *close_ : client_close();
    return {reason.reason.data(), reason.reason.size()};
  }

  const std::shared_ptr<Core> core_;  // destroyed last
  Connections::Ticket ticket_;
  const StreamVisit visit_;
  // Empty after Release().
  std::optional<websocket::stream<beast::tcp_stream>> ws_;
  const asio::any_io_executor executor_;
  asio::steady_timer close_timer_;
  beast::flat_buffer inbox_;
  std::string prefix_;  // of the write under way
  server::FramePtr frame_;
  std::shared_ptr<server::StreamSession> frames_;
  std::optional<websocket::close_reason> close_;  // this server's, once it is decided
  websocket::close_reason client_close_;          // after Release()
  bool is_open_ = false;
  bool is_writing_ = false;
  bool has_close_begun_ = false;  // no read may begin: see Finish()
  metrics::StopWatch watch_;
  metrics::StopWatch write_;
};

}  // namespace liquidblend::http
