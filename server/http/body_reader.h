// Reader of the body of a request. Only for port.cc.
#pragma once

#include <algorithm>
#include <string>
#include <string_view>
#include <utility>

#include "absl/time/clock.h"
#include "absl/time/time.h"
#include "server/http/core.h"

namespace liquidblend::http {

// Reads piece by piece, and waits for no client that sends next to nothing: within the time limit
// it has to send kMinProgress bytes, or the rest. Time in which nobody reads does not count.
// Threads: one at a time.
class BodyReader {
 public:
  static constexpr size_t kPiece = 32 << 10;
  static constexpr size_t kMinProgress = 64 << 10;

  // The stream and its buffer outlive this.
  BodyReader(beast::tcp_stream& stream, beast::flat_buffer& buffer,
             bhttp::request_parser<bhttp::empty_body>&& header, absl::Duration limit)
      : stream_(stream),
        buffer_(buffer),
        parser_(std::move(header)),
        limit_(limit),
        left_(limit),
        piece_(kPiece, '\0') {
    buffer_.reserve(kPiece);  // otherwise 512 bytes are read at a time
  }

  // Reads the next piece, then calls done(error); beast::error::timeout: it took too long, and the
  // stream is closed. The caller keeps this until then.
  template <typename Done>
  void Read(Done done) {
    auto& body = parser_.get().body();
    body.data = piece_.data();
    body.size = piece_.size();
    body.more = true;
    stream_.expires_after(ChronoOf(left_));
    const absl::Time begin = absl::Now();
    bhttp::async_read_some(stream_, buffer_, parser_,
                           [this, begin, done = std::move(done)](error_code error, size_t) mutable {
                             stream_.expires_never();
                             if (error == bhttp::error::need_buffer) error = {};
                             OnRead(absl::Now() - begin);
                             done(error);
                           });
  }

  std::string_view piece() const { return std::string_view(piece_).substr(0, size_); }
  bool is_last() const { return parser_.is_done(); }

 private:
  void OnRead(absl::Duration took) {
    size_ = piece_.size() - parser_.get().body().size;
    progress_ += size_;
    left_ = std::max(left_ - took, absl::Milliseconds(1));
    if (progress_ < kMinProgress) return;
    progress_ = 0;
    left_ = limit_;
  }

  beast::tcp_stream& stream_;
  beast::flat_buffer& buffer_;
  bhttp::request_parser<bhttp::buffer_body> parser_;
  const absl::Duration limit_;
  absl::Duration left_;
  std::string piece_;
  size_t size_ = 0;      // of the piece
  size_t progress_ = 0;  // since the time began anew
};

}  // namespace liquidblend::http
