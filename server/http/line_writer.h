// Writer of an answer that grows line by line. Only for port.cc.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <utility>

#include "absl/functional/any_invocable.h"
#include "server/http/core.h"
#include "server/http/exchange/line_source.h"

namespace liquidblend::http {

// Asks for a line once the one before has gone out.  Threads: its stream's strand.
class LineWriter {
 public:
  //   is_chunked  as HTTP/1.1 has it; otherwise the end of the connection ends the answer
  //   limit       until a line must have gone out
  LineWriter(beast::tcp_stream& stream, std::shared_ptr<LineSource> lines, bool is_chunked,
             absl::Duration limit)
      : stream_(stream), lines_(std::move(lines)), is_chunked_(is_chunked), limit_(limit) {}

  // Calls done(error) after the last line.
  //   owner  of this and the stream; it is kept until then
  void Run(std::shared_ptr<void> owner, absl::AnyInvocable<void(error_code)> done) {
    owner_ = std::move(owner);
    done_ = std::move(done);
    Ask();
  }

  void Stop() { lines_->Stop(); }

 private:
  void Ask() {
    stream_.expires_never();
    // The thread that gives the line needs the stream after the line has been posted.
    lines_->Next([this, owner = owner_](std::optional<std::string> line) {
      asio::post(stream_.get_executor(), [this, line = std::move(line)]() mutable {
        line.has_value() ? Write(*std::move(line)) : WriteEnd();
      });
    });
  }

  void Write(std::string line) {
    line_ = std::move(line);
    stream_.expires_after(ChronoOf(limit_));
    const auto written = [this](error_code error, size_t) { error ? Finish(error) : Ask(); };
    const auto bytes = asio::buffer(line_);
    is_chunked_ ? asio::async_write(stream_, bhttp::make_chunk(bytes), written)
                : asio::async_write(stream_, bytes, written);
  }

  void WriteEnd() {
    if (!is_chunked_) return Finish({});
    stream_.expires_after(ChronoOf(limit_));
    asio::async_write(stream_, bhttp::make_chunk_last(),
                      [this](error_code error, size_t) { Finish(error); });
  }

  void Finish(error_code error) {
    const std::shared_ptr<void> owner = std::exchange(owner_, nullptr);
    auto done = std::exchange(done_, nullptr);
    done(error);
  }

  beast::tcp_stream& stream_;
  const std::shared_ptr<LineSource> lines_;
  const bool is_chunked_;
  const absl::Duration limit_;
  std::string line_;  // the write under way
  std::shared_ptr<void> owner_;
  absl::AnyInvocable<void(error_code)> done_;
};

}  // namespace liquidblend::http
