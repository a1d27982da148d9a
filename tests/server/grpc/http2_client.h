// A client of HTTP/2 on a plain socket, so that tests may send what no gRPC library would: messages
// that never end, and compressed ones that are nothing but zeros.
#pragma once

#include <arpa/inet.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cstdint>
#include <map>
#include <set>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace liquidblend::server {

// The five bytes before a message of gRPC.
inline std::string MessagePrefix(uint32_t size_bytes, bool is_compressed = false) {
  std::string prefix(1, is_compressed ? '\1' : '\0');
  for (int shift = 24; shift >= 0; shift -= 8) {
    prefix.push_back(static_cast<char>(size_bytes >> shift & 0xFF));
  }
  return prefix;
}

// Whether a client gives the server a window to send messages in.
enum class Reads { kAll, kNothing };

// Keeps to the server's windows, gives back its own, and answers settings and pings.  Threads: one
// at a time.
class Http2Client {
 public:
  using Header = std::pair<std::string, std::string>;

  // On the loopback interface.
  explicit Http2Client(int port, Reads reads = Reads::kAll)
      : socket_(socket(AF_INET, SOCK_STREAM, 0)) {
    const int at_once = 1;
    setsockopt(socket_, IPPROTO_TCP, TCP_NODELAY, &at_once, sizeof(at_once));
    sockaddr_in address = {};
    address.sin_family = AF_INET;
    address.sin_port = htons(static_cast<uint16_t>(port));
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    is_open_ = connect(socket_, reinterpret_cast<sockaddr*>(&address), sizeof(address)) == 0;
    SendRaw("PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n");
    const std::string no_window = Number(kInitialWindow, 2) + Number(0, 4);
    SendFrame(kSettings, 0, 0, reads == Reads::kNothing ? no_window : "");
  }
  ~Http2Client() { close(socket_); }
  Http2Client(const Http2Client&) = delete;
  Http2Client& operator=(const Http2Client&) = delete;

  bool is_open() const { return is_open_; }
  bool has_ended(int stream) const { return !is_open_ || ended_.contains(stream); }
  // Whether the server itself ended the stream: with an answer, or by resetting it.
  bool is_answered(int stream) const { return ended_.contains(stream); }
  // Whether the server has said that it takes no more streams here (GOAWAY), as it does on idle
  // connections when its memory for buffers runs out. Clients call again in another connection.
  bool is_told_to_leave() const { return is_told_to_leave_; }

  // Begins a call of gRPC. Returns its stream.
  int Open(const std::string& path, const std::vector<Header>& headers = {}) {
    constexpr char kPost = '\x83';  // in HPACK's static table
    constexpr char kHttp = '\x86';
    std::string block = {kPost, kHttp};
    block += '\x04' + Text(path) + '\x01' + Text("localhost");
    const auto add = [&](const Header& header) {
      block += '\0' + Text(header.first) + Text(header.second);
    };
    add({"te", "trailers"});
    add({"content-type", "application/grpc"});
    for (const Header& header : headers) add(header);
    const int stream = std::exchange(next_stream_, next_stream_ + 2);
    windows_[stream] = initial_window_;
    SendFrame(kHeaders, kEndHeaders, stream, block);
    return stream;
  }

  // As many of the bytes as the server takes before that much time has passed without a window, or
  // the stream ends. Returns their number.
  size_t Send(int stream, std::string_view bytes, std::chrono::milliseconds patience) {
    size_t num_sent = 0;
    auto give_up = std::chrono::steady_clock::now() + patience;
    while (num_sent < bytes.size() && !has_ended(stream)) {
      const int64_t window = std::min({connection_window_, windows_[stream], kMaxFrame});
      if (window <= 0) {
        if (std::chrono::steady_clock::now() > give_up) break;
        Receive(std::chrono::milliseconds(10));
        continue;
      }
      const std::string_view part = bytes.substr(num_sent, static_cast<size_t>(window));
      SendFrame(kData, 0, stream, part);
      num_sent += part.size();
      connection_window_ -= static_cast<int64_t>(part.size());
      windows_[stream] -= static_cast<int64_t>(part.size());
      Receive(std::chrono::milliseconds(0));
      give_up = std::chrono::steady_clock::now() + patience;
    }
    return num_sent;
  }

  void HalfClose(int stream) { SendFrame(kData, kEndStream, stream, ""); }

  // Whether the stream ends in time.
  bool AwaitEnd(int stream, std::chrono::milliseconds patience) {
    const auto give_up = std::chrono::steady_clock::now() + patience;
    while (!has_ended(stream) && std::chrono::steady_clock::now() < give_up) {
      Receive(std::chrono::milliseconds(10));
    }
    return has_ended(stream);
  }

  // Whether the server has told its limits in time.
  bool AwaitSettings(std::chrono::milliseconds patience) {
    const auto give_up = std::chrono::steady_clock::now() + patience;
    while (is_open_ && !has_settings_ && std::chrono::steady_clock::now() < give_up) {
      Receive(std::chrono::milliseconds(10));
    }
    return has_settings_;
  }

  // What has arrived, or arrives within that time.
  void Receive(std::chrono::milliseconds patience) {
    pollfd ready = {socket_, POLLIN, 0};
    while (is_open_ && poll(&ready, 1, static_cast<int>(patience.count())) > 0) {
      char bytes[16384];
      const ssize_t received = recv(socket_, bytes, sizeof(bytes), 0);
      if (received <= 0) is_open_ = false;
      if (received > 0) inbox_.append(bytes, static_cast<size_t>(received));
      TakeFrames();
      patience = std::chrono::milliseconds(0);
    }
  }

 private:
  enum Type { kData, kHeaders, kPriority, kReset, kSettings, kPush, kPing, kGoAway, kWindow };
  static constexpr int kEndStream = 1, kAck = 1, kEndHeaders = 4;
  static constexpr int64_t kMaxFrame = 16384;
  static constexpr int64_t kInitialWindow = 4;  // the setting
  static constexpr size_t kFrameHeader = 9;

  static std::string Number(uint64_t value, int num_bytes) {
    std::string bytes;
    for (int k = num_bytes - 1; k >= 0; --k) {
      bytes.push_back(static_cast<char>(value >> (8 * k) & 0xFF));
    }
    return bytes;
  }
  static int64_t NumberAt(std::string_view bytes, size_t at, size_t num_bytes) {
    int64_t value = 0;
    for (const char byte : bytes.substr(at, num_bytes)) {
      value = value << 8 | static_cast<unsigned char>(byte);
    }
    return value;
  }
  // A string of HPACK; up to 126 bytes.
  static std::string Text(const std::string& text) { return Number(text.size(), 1) + text; }

  // If that fails, the next Receive() reads what the server said before, and sees that it is gone.
  void SendRaw(std::string_view bytes) {
    while (is_open_ && !bytes.empty()) {
      const ssize_t sent = send(socket_, bytes.data(), bytes.size(), MSG_NOSIGNAL);
      if (sent <= 0) return;
      bytes.remove_prefix(static_cast<size_t>(sent));
    }
  }
  void SendFrame(Type type, int flags, int stream, std::string_view payload) {
    SendRaw(Number(payload.size(), 3) + Number(type, 1) + Number(flags, 1) + Number(stream, 4) +
            std::string(payload));
  }

  void TakeFrames() {
    while (inbox_.size() >= kFrameHeader) {
      const auto size = static_cast<size_t>(NumberAt(inbox_, 0, 3));
      if (inbox_.size() < kFrameHeader + size) return;
      OnFrame(static_cast<Type>(inbox_[3]), inbox_[4],
              static_cast<int>(NumberAt(inbox_, 5, 4) & 0x7FFFFFFF),
              std::string_view(inbox_).substr(kFrameHeader, size));
      inbox_.erase(0, kFrameHeader + size);
    }
  }

  void OnFrame(Type type, int flags, int stream, std::string_view payload) {
    if (type == kSettings && (flags & kAck) == 0) OnSettings(payload);
    if (type == kPing && (flags & kAck) == 0) SendFrame(kPing, kAck, 0, payload);
    if (type == kWindow) OnWindow(stream, NumberAt(payload, 0, 4));
    if (type == kGoAway) is_told_to_leave_ = true;
    const bool is_last = (type == kHeaders || type == kData) && (flags & kEndStream) != 0;
    if (type == kData && !payload.empty()) GiveBack(is_last ? 0 : stream, payload.size());
    if (type == kReset || is_last) ended_.insert(stream);
  }
  // Bytes that have arrived, to the server's windows of the connection and, but for 0, the stream.
  void GiveBack(int stream, size_t bytes) {
    SendFrame(kWindow, 0, 0, Number(bytes, 4));
    if (stream != 0) SendFrame(kWindow, 0, stream, Number(bytes, 4));
  }
  void OnWindow(int stream, int64_t bytes) {
    if (stream == 0) connection_window_ += bytes;
    if (stream != 0) windows_[stream] += bytes;
  }
  void OnSettings(std::string_view payload) {
    for (size_t at = 0; at + 6 <= payload.size(); at += 6) {
      if (NumberAt(payload, at, 2) != kInitialWindow) continue;
      const int64_t value = NumberAt(payload, at + 2, 4);
      for (auto& [stream, window] : windows_) window += value - initial_window_;
      initial_window_ = value;
    }
    has_settings_ = true;
    SendFrame(kSettings, kAck, 0, "");
  }

  const int socket_;
  bool is_open_ = false;
  bool has_settings_ = false;
  bool is_told_to_leave_ = false;
  std::string inbox_;
  int next_stream_ = 1;
  int64_t connection_window_ = 65535;
  int64_t initial_window_ = 65535;
  std::map<int, int64_t> windows_;  // by stream
  std::set<int> ended_;             // streams
};

}  // namespace liquidblend::server
