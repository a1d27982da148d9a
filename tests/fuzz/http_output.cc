#include "tests/fuzz/http_output.h"

#include <algorithm>
#include <cstdint>
#include <string>

#include "absl/strings/match.h"
#include "absl/strings/numbers.h"
#include "liquidblend/v1/liquidblend.pb.h"
#include "tests/fuzz/require.h"

namespace liquidblend::fuzz {
namespace {

constexpr char kProtocol[] = "HTTP/1.";
constexpr size_t kMaxClosePayload = 125;

absl::string_view ToAbsl(std::string_view text) { return {text.data(), text.size()}; }

bool IsPrintable(std::string_view text) {
  return std::all_of(text.begin(), text.end(),
                     [](char c) { return static_cast<unsigned char>(c) >= 0x20 && c != 0x7F; });
}

// The code of a status line.
int CodeOf(std::string_view line) {
  int code = 0;
  Require(line.size() >= 12 && line.substr(0, 7) == kProtocol && line[8] == ' ' &&
              absl::SimpleAtoi(ToAbsl(line.substr(9, 3)), &code),
          "an answer begins with a status line");
  Require(code == 100 || code == 101 || (code >= 200 && code < 600),
          "an answer's code is one of HTTP");
  Require(code != 500, "no request causes an internal error");
  return code;
}

struct Body {
  size_t length = 0;
  bool is_chunked = false;
};

// Takes the lines of one answer's header.
Body CheckHeader(std::string_view header) {
  Body body;
  for (size_t begin = 0; begin < header.size();) {
    const size_t end = std::min(header.find("\r\n", begin), header.size());
    const std::string_view line = header.substr(begin, end - begin);
    begin = end + 2;
    Require(IsPrintable(line), "a header's line has no control characters");
    const size_t colon = line.find(": ");
    Require(colon != std::string_view::npos && colon > 0, "a header's line is a name and a value");
    const absl::string_view name = ToAbsl(line.substr(0, colon));
    if (absl::EqualsIgnoreCase(name, "Transfer-Encoding")) body.is_chunked = true;
    if (!absl::EqualsIgnoreCase(name, "Content-Length")) continue;
    Require(absl::SimpleAtoi(ToAbsl(line.substr(colon + 2)), &body.length), "a body has a length");
  }
  return body;
}

// Takes the chunks of a body off the output, as far as they have come: lines of JSON.
void TakeChunks(std::string_view& output) {
  while (true) {
    const size_t end = output.find("\r\n");
    size_t size = 0;
    if (end == std::string_view::npos) return;
    Require(absl::SimpleHexAtoi(ToAbsl(output.substr(0, end)), &size), "a chunk has a size");
    if (output.size() < end + size + 4) return;
    Require(size == 0 || output[end + 1 + size] == '\n', "a chunk is a line");
    output.remove_prefix(end + size + 4);
    if (size == 0) return;
  }
}

struct Frame {
  int opcode = 0;
  std::string_view payload;
};

// Takes one frame off the output. False: there is no whole one.
bool TakeFrame(std::string_view& output, Frame& frame) {
  if (output.size() < 2) return false;
  const auto byte = [&](size_t i) { return static_cast<uint8_t>(output[i]); };
  Require((byte(0) & 0xF0) == 0x80, "the server's messages are whole frames");
  Require((byte(1) & 0x80) == 0, "the server masks nothing");
  uint64_t size = byte(1) & 0x7F;
  const size_t num_bytes = size < 126 ? 0 : size == 126 ? 2 : 8;
  if (output.size() < 2 + num_bytes) return false;
  if (num_bytes > 0) size = 0;
  for (size_t i = 0; i < num_bytes; ++i) size = size << 8 | byte(2 + i);
  if (output.size() - 2 - num_bytes < size) return false;
  frame = {byte(0) & 0x0F, output.substr(2 + num_bytes, size)};
  output.remove_prefix(2 + num_bytes + size);
  return true;
}

void CheckClose(std::string_view payload) {
  Require(payload.size() != 1 && payload.size() <= kMaxClosePayload, "a close frame is small");
  if (payload.empty()) return;
  const int code = static_cast<uint8_t>(payload[0]) << 8 | static_cast<uint8_t>(payload[1]);
  // Boost.Beast sends the client's own code back, those above 4999 too.
  Require(code >= 1000 && code != 1005 && code != 1006, "a close code may be sent");
}

}  // namespace

void CheckHttpOutput(std::string_view output) {
  while (!output.empty()) {
    const size_t end = output.find("\r\n\r\n");
    if (end == std::string_view::npos) return;
    const std::string_view header = output.substr(0, end);
    const size_t line = std::min(header.find("\r\n"), header.size());
    const int code = CodeOf(header.substr(0, line));
    const Body body = CheckHeader(header.substr(std::min(line + 2, header.size())));
    output.remove_prefix(end + 4);
    if (code == 101) return CheckWebSocketOutput(output);
    // The answer to HEAD tells the length of a body that does not come.
    if (output.substr(0, sizeof(kProtocol) - 1) == kProtocol) continue;
    output.remove_prefix(std::min(body.length, output.size()));
    if (body.is_chunked) TakeChunks(output);
  }
}

void CheckWebSocketOutput(std::string_view output) {
  int64_t num_frames = 0;
  bool is_closed = false;
  for (Frame frame; TakeFrame(output, frame);) {
    Require(!is_closed, "nothing follows a close frame");
    if (frame.opcode == 2) {
      v1::StreamFramesResponse response;
      Require(response.ParseFromArray(frame.payload.data(), static_cast<int>(frame.payload.size())),
              "a message is a StreamFramesResponse");
      Require(response.frame_index() == num_frames++, "frames are numbered");
    } else if (frame.opcode == 8) {
      CheckClose(frame.payload);
      is_closed = true;
    } else {
      Require(frame.opcode == 9 || frame.opcode == 10, "frames are messages or control frames");
    }
  }
}

}  // namespace liquidblend::fuzz
