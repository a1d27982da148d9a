// A small client of HTTP/1.1 and WebSockets on a plain socket, so that tests may also send what no
// library would.
#pragma once

#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <map>
#include <string>
#include <string_view>
#include <utility>

#include "absl/strings/ascii.h"
#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/string_view.h"

namespace liquidblend::http {

struct HttpReply {
  int code = 0;                                // 0: the connection ended before
  std::map<std::string, std::string> headers;  // by lower-case name
  std::string body;
};

struct WebSocketMessage {
  int opcode = -1;  // 1 text, 2 binary, 8 close, 9 ping, 10 pong; -1: the connection ended
  std::string payload;
  int close_code() const {
    if (opcode != 8 || payload.size() < 2) return 0;
    return 256 * static_cast<unsigned char>(payload[0]) + static_cast<unsigned char>(payload[1]);
  }
  std::string close_reason() const { return payload.substr(std::min<size_t>(2, payload.size())); }
};

// Reads wait for ten seconds at most.  Threads: one at a time.
class HttpClient {
 public:
  explicit HttpClient(int port) : socket_(socket(AF_INET, SOCK_STREAM, 0)) {
    const timeval patience = {10, 0};
    setsockopt(socket_, SOL_SOCKET, SO_RCVTIMEO, &patience, sizeof(patience));
    sockaddr_in address = {};
    address.sin_family = AF_INET;
    address.sin_port = htons(static_cast<uint16_t>(port));
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    is_connected_ = connect(socket_, reinterpret_cast<sockaddr*>(&address), sizeof(address)) == 0;
  }
  ~HttpClient() { Close(); }
  HttpClient(const HttpClient&) = delete;
  HttpClient& operator=(const HttpClient&) = delete;

  void Close() {
    if (socket_ >= 0) close(std::exchange(socket_, -1));
  }

  bool is_connected() const { return is_connected_; }

  bool Send(std::string_view bytes) {
    while (!bytes.empty()) {
      const ssize_t sent = send(socket_, bytes.data(), bytes.size(), MSG_NOSIGNAL);
      if (sent <= 0) return false;
      bytes.remove_prefix(static_cast<size_t>(sent));
    }
    return true;
  }

  // One request and its answer. `headers`: whole lines.
  HttpReply Request(const std::string& method, const std::string& target,
                    const std::string& headers = "") {
    Send(absl::StrCat(method, " ", target, " HTTP/1.1\r\nHost: localhost\r\n", headers, "\r\n"));
    return ReadReply(method == "HEAD");
  }
  HttpReply Get(const std::string& target, const std::string& headers = "") {
    return Request("GET", target, headers);
  }

  HttpReply ReadReply(bool is_head = false) {
    HttpReply reply;
    size_t end = 0;
    while ((end = inbox_.find("\r\n\r\n")) == std::string::npos) {
      if (!Receive()) return reply;
    }
    const std::string header = Take(end + 4);
    if (!absl::SimpleAtoi(header.substr(9, 3), &reply.code)) return reply;
    for (size_t line = header.find("\r\n") + 2; line + 2 < header.size();) {
      const size_t line_end = header.find("\r\n", line);
      const size_t colon = header.find(": ", line);
      reply.headers[absl::AsciiStrToLower(header.substr(line, colon - line))] =
          header.substr(colon + 2, line_end - colon - 2);
      line = line_end + 2;
    }
    size_t size = 0;
    const auto length = reply.headers.find("content-length");
    if (is_head || length == reply.headers.end()) return reply;
    if (!absl::SimpleAtoi(length->second, &size)) return reply;
    while (inbox_.size() < size && Receive()) {
    }
    reply.body = Take(size);
    return reply;
  }

  // The status of an answer of which nothing else is read; 0: the connection ended before.
  int ReadCode() {
    char bytes[12];  // "HTTP/1.1 200"
    const ssize_t received = recv(socket_, bytes, sizeof(bytes), MSG_WAITALL);
    int code = 0;
    const bool is_whole = received == static_cast<ssize_t>(sizeof(bytes));
    return is_whole && absl::SimpleAtoi(absl::string_view(bytes + 9, 3), &code) ? code : 0;
  }

  // The next chunk of an answer whose header has been read; empty: it was the last one, or the
  // connection ended.
  std::string ReadChunk() {
    size_t end = 0;
    while ((end = inbox_.find("\r\n")) == std::string::npos) {
      if (!Receive()) return "";
    }
    size_t size = 0;
    if (!absl::SimpleHexAtoi(inbox_.substr(0, end), &size) || !Await(end + size + 4)) return "";
    return Take(end + size + 4).substr(end + 2, size);
  }

  // All until the connection ends.
  std::string ReadRest() {
    while (Receive()) {
    }
    return Take(inbox_.size());
  }

  // Whether the server closes the connection (within the time that reads wait).
  bool IsClosed() {
    while (true) {
      char bytes[4096];
      const ssize_t received = recv(socket_, bytes, sizeof(bytes), 0);
      if (received == 0) return true;
      if (received < 0) return errno == ECONNRESET;
    }
  }

  HttpReply Upgrade(const std::string& headers = "") {
    return Get("/v1/stream", absl::StrCat("Connection: Upgrade\r\nUpgrade: websocket\r\n"
                                          "Sec-WebSocket-Version: 13\r\n"
                                          "Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n",
                                          headers));
  }

  // Masked, as a client's must be. Payloads below 64 KiB.
  bool SendMessage(int opcode, const std::string& payload) {
    std::string bytes(1, static_cast<char>(0x80 | opcode));
    if (payload.size() < 126) {
      bytes.push_back(static_cast<char>(0x80 | payload.size()));
    } else {
      bytes.push_back(static_cast<char>(0x80 | 126));
      bytes.push_back(static_cast<char>(payload.size() >> 8));
      bytes.push_back(static_cast<char>(payload.size() & 0xFF));
    }
    const std::string mask = "\x12\x34\x56\x78";
    bytes += mask;
    for (size_t i = 0; i < payload.size(); ++i) {
      bytes.push_back(static_cast<char>(payload[i] ^ mask[i % 4]));
    }
    return Send(bytes);
  }

  // The next message in one piece.
  WebSocketMessage ReadMessage() {
    WebSocketMessage message;
    if (!Await(2)) return message;
    const int opcode = inbox_[0] & 0x0F;
    uint64_t size = inbox_[1] & 0x7F;
    size_t header = 2;
    if (size >= 126) {
      const size_t num_bytes = size == 126 ? 2 : 8;
      if (!Await(2 + num_bytes)) return message;
      size = 0;
      for (size_t i = 0; i < num_bytes; ++i) {
        size = 256 * size + static_cast<unsigned char>(inbox_[2 + i]);
      }
      header += num_bytes;
    }
    if (!Await(header + size)) return message;
    Take(header);
    message.payload = Take(size);
    message.opcode = opcode;
    return message;
  }

 private:
  bool Receive() {
    char bytes[1 << 16];
    const ssize_t received = recv(socket_, bytes, sizeof(bytes), 0);
    if (received <= 0) return false;
    inbox_.append(bytes, static_cast<size_t>(received));
    return true;
  }

  bool Await(size_t size) {
    while (inbox_.size() < size) {
      if (!Receive()) return false;
    }
    return true;
  }

  std::string Take(size_t size) {
    std::string taken = inbox_.substr(0, size);
    inbox_.erase(0, size);
    return taken;
  }

  int socket_;
  bool is_connected_ = false;
  std::string inbox_;
};

}  // namespace liquidblend::http
