#include <cstdint>
#include <string>
#include <vector>

#include "liquidblend/v1/liquidblend.pb.h"
#include "tests/fuzz/corpus.h"

namespace liquidblend::fuzz {
namespace {

void AddText(const Corpus& corpus, const std::string& fuzzer, const std::string& name,
             const std::string& text) {
  corpus.Add(fuzzer, name, std::as_bytes(std::span(text)));
}

// ---- http: options, size of pieces, requests

std::string Options(int options, int piece) {
  return {static_cast<char>(options), static_cast<char>(piece)};
}

std::string Get(const std::string& target, const std::string& headers = "",
                const std::string& method = "GET") {
  return method + " " + target + " HTTP/1.1\r\nHost: localhost\r\n" + headers + "\r\n";
}

constexpr char kFrame[] = "/v1/families/drops/frame.drc?weights=0.5,0.25&time=0.1&version=1";
constexpr char kUpgradeHeaders[] =
    "Connection: Upgrade\r\nUpgrade: websocket\r\nSec-WebSocket-Version: 13\r\n"
    "Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n";

void AddHttp(const Corpus& corpus) {
  const auto add = [&](const std::string& name, int options, int piece, const std::string& text) {
    AddText(corpus, "http", name, Options(options, piece) + text);
  };
  const std::string paths = Get("/healthz") + Get("/readyz") + Get("/metrics") +
                            Get("/v1/families") + Get("/v1/families/drops") + Get("/none");
  add("paths", 0, 0, paths);
  add("paths_in_pieces", 0x0A, 7, paths);
  add("frame", 0, 0,
      Get(kFrame, "If-None-Match: \"x\", *\r\nX-Request-Id: shot-17\r\n") + Get(kFrame));
  add("frame_of_deferred_source", 0x92, 40, Get(kFrame) + Get(kFrame));
  add("token", 0x01, 0, Get(kFrame) + Get(kFrame, "Authorization: Bearer good\r\n"));
  add("errors", 0x04, 0, paths + Get(kFrame));
  add("methods", 0x08, 0,
      Get(kFrame, "", "HEAD") + Get("/readyz", "Origin: https://example.org\r\n", "OPTIONS") +
          Get(kFrame, "", "DELETE"));
  add("bodies", 0, 0, Get("/healthz", "Content-Length: 3\r\n", "POST") + "abc" + Get("/healthz"));
  add("chunked", 0, 0,
      Get("/healthz", "Transfer-Encoding: chunked\r\n", "PUT") + "3\r\nabc\r\n0\r\n\r\n");
  add("old", 0, 0, "GET http://localhost/healthz?x=1 HTTP/1.0\r\nConnection: keep-alive\r\n\r\n");
  add("long_header", 0, 0, Get("/healthz", "X: " + std::string(1200, 'a') + "\r\n"));
  add("no_request", 0, 3, "PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n");
  add("upgrade", 0x20, 50, Get("/v1/stream", kUpgradeHeaders) + std::string("\x88\x80\0\0\0\0", 6));
  add("upgrade_of_page", 0x08, 0,
      Get("/v1/stream", std::string("Origin: https://evil.example\r\n") + kUpgradeHeaders));
}

std::string Post(const std::string& target, const std::string& body,
                 const std::string& type = "application/json") {
  return Get(target,
             "Content-Type: " + type + "\r\nContent-Length: " + std::to_string(body.size()) +
                 "\r\n",
             "POST") +
         body;
}

// An empty file's header, and the end of the archive.
std::string TinyArchive() {
  std::string block(512, '\0');
  block.replace(0, 6, "f1.ply");
  block.replace(100, 7, "0000644");
  block.replace(124, 11, "00000000000");
  block[156] = '0';
  block.replace(257, 5, "ustar");
  block.replace(263, 2, "00");
  block.replace(148, 8, 8, ' ');
  int sum = 0;
  for (const char c : block) sum += static_cast<unsigned char>(c);
  std::string digits(6, '0');
  for (int k = 5; k >= 0; --k, sum /= 8)
    digits[static_cast<size_t>(k)] += static_cast<char>(sum % 8);
  block.replace(148, 6, digits);
  block[154] = '\0';
  return block + std::string(1024, '\0');
}

void AddBodies(const Corpus& corpus) {
  const auto add = [&](const std::string& name, int options, int piece, const std::string& text) {
    AddText(corpus, "http", name, Options(options, piece) + text);
  };
  const std::string family =
      R"({"familyId": "f", "source": "a", "targets": ["b"], "options": {"seed": "1"}})";
  add("json", 0, 0, Post("/v1/families", family) + Post("/v1/families/f:rollback", "{}"));
  add("json_in_pieces", 0x02, 9, Post("/v1/families", family));
  add("json_nested", 0, 0, Post("/v1/families", std::string(400, '[')));
  add("json_wrong", 0, 0,
      Post("/v1/families", R"({"options": {"seeds": 1e999}, "x": "\u0000"})") +
          Post("/v1/operations/1:wait", R"({"timeout": "1.5s"})"));
  add("json_in_chunks", 0, 0,
      Get("/v1/families",
          "Content-Type: application/json\r\nTransfer-Encoding: chunked\r\n"
          "Expect: 100-continue\r\n",
          "POST") +
          "1\r\n{\r\n1;x=y\r\n}\r\n0\r\nT: 1\r\n\r\n" + Get("/healthz"));
  add("queries", 0, 0,
      Get("/v1/operations?pageSize=3&page_token=x") + Get("/v1/families/f?version=1") +
          Get("/v1/animations/a/frame.ply?timeS=1&encoding.preset=fastest&attributes=NORMALS"));
  add("watch", 0, 0, Get("/v1/operations/1:watch") + Get("/healthz"));
  add("watch_deferred", 0x22, 5, Get("/v1/operations/1:watch"));
  add("tar", 0, 0,
      Post("/v1/animations:upload?header.animationId=a", TinyArchive(), "application/x-tar"));
  add("tar_damaged", 0, 100,
      Post("/v1/animations:upload?header.animationId=a", std::string(600, 'x'),
           "application/x-tar"));
  add("page", 0, 0, Get("/?family=x", "Accept-Encoding: gzip\r\n") + Get("/page/x.js"));
}

// ---- streams

v1::StreamFramesRequest Request() {
  v1::StreamFramesRequest request;
  request.set_family("families/drops");
  request.add_weights(0.5);
  request.add_weights(0.25);
  return request;
}

v1::StreamFramesRequest Lossless() {
  v1::StreamFramesRequest request = Request();
  request.set_lossless(true);
  return request;
}

v1::StreamFramesRequest Endless(double frames_per_second) {
  v1::StreamFramesRequest request = Request();
  request.set_loop(true);
  request.set_frames_per_second(frames_per_second);
  request.set_adapt_level_of_detail(true);
  return request;
}

v1::StreamFramesRequest AtPoint() {
  v1::StreamFramesRequest request;
  request.set_family("families/drops");
  for (const char* name : {"width", "height"}) {
    v1::Parameter& parameter = *request.add_parameters();
    parameter.set_name(name);
    parameter.set_value(0.25);
  }
  request.set_extrapolate(true);
  request.mutable_encoding()->set_preset(v1::Encoding::SMALLEST);
  request.mutable_encoding()->set_position_step_m(0.01);
  request.mutable_surface()->set_level_of_detail(1);
  request.mutable_surface()->set_smoothing_passes(2);
  request.mutable_surface()->set_temporal_smoothing(0.5);
  request.mutable_surface()->add_attributes(v1::SurfaceOptions::NORMALS);
  request.mutable_surface()->add_attributes(v1::SurfaceOptions::VELOCITIES);
  return request;
}

v1::StreamFramesRequest Pace(double rate, double time_s) {
  v1::StreamFramesRequest request;
  request.set_rate(rate);
  request.set_time_s(time_s);
  return request;
}

// A message with a field that this version does not know.
std::string WithUnknownField() {
  std::string bytes = Request().SerializeAsString();
  bytes += std::string("\xFA\x7F\x20", 3) + std::string(32, 'u');  // field 2047, 32 bytes
  return bytes;
}

std::string Sized(const std::string& bytes) {
  return std::string{static_cast<char>(bytes.size() >> 8), static_cast<char>(bytes.size())} + bytes;
}

// Events of stream_entry.cc.
std::string Message(const std::string& bytes) { return '\x00' + Sized(bytes); }
std::string Message(const v1::StreamFramesRequest& request) {
  return Message(request.SerializeAsString());
}
constexpr char kAgain = 4, kFound = 5, kAway = 7, kMade = 8, kBusy = 10, kTaken = 11, kTime = 13,
               kHalfClosed = 14, kStopped = 15, kDefer = 16;
std::string PassTime(int log2_us) { return {kTime, static_cast<char>(log2_us)}; }

std::string Repeat(const std::string& events, int count) {
  std::string all;
  for (int k = 0; k < count; ++k) all += events;
  return all;
}

void AddStreams(const Corpus& corpus) {
  const auto add = [&](const std::string& name, int options, const std::string& events) {
    AddText(corpus, "stream", name, static_cast<char>(options) + events);
  };
  const std::string frame = {kMade, kTaken};
  add("lossless", 1, Message(Lossless()) + kHalfClosed + kFound + Repeat(frame, 8));
  add("in_memory", 5, Message(Lossless()) + Repeat({kTaken}, 8));
  add("endless", 0, Message(Endless(24)) + kFound + Repeat(frame + PassTime(15), 10));
  add("late", 0, Message(Endless(240)) + kFound + Repeat(frame + PassTime(24), 6));
  add("parameters", 3, Message(AtPoint()) + kFound + Repeat(frame + PassTime(16), 4));
  add("changes", 0,
      Message(Endless(60)) + kFound + frame + Message(Pace(-2, 0.1)) + PassTime(14) + frame +
          Message(Pace(0, 0)) + PassTime(16) + frame + Message(Request()) + kFound + frame);
  add("slow_and_fast", 4,
      Repeat(Message(Endless(1e-3)) + kTaken + Message(Endless(240)) + kTaken + PassTime(13), 8));
  add("again", 4, Message(Endless(60)) + kTaken + kAgain);
  add("unknown_field", 0, Message(WithUnknownField()) + kFound + Repeat(frame + PassTime(15), 4));
  add("unknown_family", 0, Message(Pace(1, 0)) + kFound);
  add("errors", 0, Message(Request()) + kAway + kFound);
  add("busy", 0, Message(Request()) + kFound + kBusy);
  add("stopped", 0,
      Message(Request()) + kFound + static_cast<char>(kMade | kDefer) + kStopped + kTaken);
}

// ---- websocket

// A client's frame whose mask is 0, so that a fuzzer can change what is in it.
std::string Frame(int first_byte, const std::string& payload) {
  std::string bytes(1, static_cast<char>(first_byte));
  if (payload.size() < 126) {
    bytes.push_back(static_cast<char>(0x80 | payload.size()));
  } else {
    bytes.push_back(static_cast<char>(0x80 | 126));
    bytes.push_back(static_cast<char>(payload.size() >> 8));
    bytes.push_back(static_cast<char>(payload.size()));
  }
  return bytes + std::string(4, '\0') + payload;
}

void AddWebSockets(const Corpus& corpus) {
  const auto add = [&](const std::string& name, int options, int piece, const std::string& text) {
    AddText(corpus, "websocket", name, Options(options, piece) + text);
  };
  const std::string message = Request().SerializeAsString();
  add("lossless", 0, 0, Frame(0x82, Lossless().SerializeAsString()));
  add("endless", 0, 20,
      Frame(0x82, Endless(100).SerializeAsString()) +
          Repeat(Frame(0x82, Pace(2, 0.1).SerializeAsString()), 6));
  add("fragments", 0, 9,
      Frame(0x02, message.substr(0, 5)) + Frame(0x89, "ping") + Frame(0x80, message.substr(5)));
  add("control", 0, 0,
      Frame(0x89, "a") + Frame(0x8A, "b") + Frame(0x88, std::string("\x03\xE8") + "end"));
  add("text", 0, 0, Frame(0x81, "hello"));
  add("no_message", 0, 0, Frame(0x82, "\x0A\xFF"));
  add("unmasked", 0, 0, std::string("\x82\x03") + "abc");
  add("reserved", 0, 0, Frame(0xF2, "abc"));
  add("huge", 0, 0, std::string("\x82\xFF\x7F\xFF\xFF\xFF\xFF\xFF\xFF\xFF", 10));
  add("reads_late", 0x10, 30, Frame(0x82, Lossless().SerializeAsString()) + Frame(0x89, "a"));
  add("drained", 0x20, 10, Frame(0x82, Endless(100).SerializeAsString()) + Frame(0x89, "a"));
  add("aborted", 0xC0, 0, Frame(0x82, Endless(100).SerializeAsString()));
}

// ---- requests

std::string Upload(const v1::UploadAnimationRequest& message) {
  return Sized(message.SerializeAsString());
}

std::string Header() {
  v1::UploadAnimationRequest message;
  message.mutable_header()->set_animation_id("a");
  message.mutable_header()->mutable_options()->set_frames_per_second(24);
  message.mutable_header()->mutable_options()->add_frame_times(0);
  return Upload(message);
}

std::string File(const std::string& name, int64_t size, const std::string& blob = "") {
  v1::UploadAnimationRequest message;
  message.mutable_file()->set_name(name);
  message.mutable_file()->set_size_bytes(size);
  message.mutable_file()->set_blob(blob);
  return Upload(message);
}

std::string Chunk(const std::string& bytes) {
  v1::UploadAnimationRequest message;
  message.set_chunk(bytes);
  return Upload(message);
}

void AddRequests(const Corpus& corpus) {
  AddText(corpus, "upload", "whole",
          Header() + File("f_1.ply", 6) + Chunk("abc") + Chunk("def") + File("f_2.ply", 0));
  AddText(corpus, "upload", "broken_off", Header() + File("f_1.ply", 6) + Chunk("abc"));
  AddText(corpus, "upload", "too_large",
          Header() + File("f", 400) + Chunk(std::string(400, 'a')) + File("g", 1601));
  AddText(corpus, "upload", "sent_directly",
          Header() + File("f", 4, "xxh3-" + std::string(32, '0') + "-" + std::string(32, '1')));
  AddText(corpus, "pages", "first", std::string("\0\2", 2));
  AddText(corpus, "pages", "next", std::string("\0\2", 2) + "a1");
  AddText(corpus, "pages", "jobs", std::string("\2\xFF", 2) + "1:2:3");
  const std::string hash(64, 'a');
  AddText(corpus, "tokens", "all",
          R"({"principals": [{"name": "studio", "token_sha256": [")" + hash +
              R"("], "certificate_subject": "CN=render-1", "scopes": ["frames", "write"],
 "limits": {"max_upload_bytes": 1000, "max_streams": 2, "requests_per_second": 0.5,
 "max_stored_bytes": 5000000000000, "max_queued_jobs": 7}}],
 "anonymous": {"scopes": ["frames"]}})");
  AddText(corpus, "tokens", "anonymous", R"({"anonymous": {"scopes": []}})");
  AddText(corpus, "tokens", "broken", R"({"principals": [{"name": ""}]})");
}

}  // namespace

void AddPeerSeeds(const Corpus& corpus) {
  AddHttp(corpus);
  AddBodies(corpus);
  AddStreams(corpus);
  AddWebSockets(corpus);
  AddRequests(corpus);
}

}  // namespace liquidblend::fuzz
