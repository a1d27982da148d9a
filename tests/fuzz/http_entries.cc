// The fuzzers `http` and `websocket`: the bytes of one connection to the HTTP port, which a fake
// source answers. The connection is a pair of sockets whose two ends are served by one thread, so
// the same bytes give the same run.
//
// Input: uint8 options (Options), uint8 size of the pieces that the client sends (0: all at once),
// then what it sends; for `websocket` after an upgrade.
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <memory>
#include <string>
#include <utility>

#include "absl/time/clock.h"
#include "core/base/log.h"
#include "server/http/http_session.h"
#include "tests/fuzz/entries.h"
#include "tests/fuzz/fuzz_api.h"
#include "tests/fuzz/http_output.h"
#include "tests/fuzz/input.h"
#include "tests/fuzz/require.h"

namespace liquidblend::fuzz {
namespace {

constexpr char kUpgrade[] =
    "GET /v1/stream HTTP/1.1\r\nHost: localhost\r\nConnection: Upgrade\r\nUpgrade: websocket\r\n"
    "Sec-WebSocket-Version: 13\r\nSec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n\r\n";
constexpr size_t kMaxPieces = 64;
constexpr int kMaxHandlers = 100'000;  // of one connection
constexpr size_t kMaxOutput = size_t{64} << 20;
constexpr int kMaxRounds = 64;  // of Settle(): a looping stream would go on
// On the machine's clock: longer than a run, so that only a close that hangs meets it.
constexpr absl::Duration kCloseTimeout = absl::Milliseconds(500);
constexpr absl::Duration kPatience = absl::Seconds(5);
constexpr absl::Duration kBetweenPieces = absl::Milliseconds(20);

struct Options {
  explicit Options(uint8_t bits)
      : needs_token(bits & 1),
        is_deferred(bits & 2),
        fails(bits & 4),
        has_origin(bits & 8),
        reads_late(bits & 16),
        is_drained(bits & 32),
        is_aborted(bits & 64),
        closes_early(bits & 128) {}
  bool needs_token;
  bool is_deferred;   // the source answers between two pieces
  bool fails;         // the source answers with errors
  bool has_origin;    // scripts of one origin may read
  bool reads_late;    // the client reads nothing before it has sent all
  bool is_drained;    // the port begins to stop after the first half
  bool is_aborted;    // and ends all after the last piece
  bool closes_early;  // the client closes its end while answers are on their way
};

http::PortOptions PortOptionsOf(const Options& options) {
  http::PortOptions port;
  port.max_header_bytes = 1024;
  port.max_message_bytes = 4096;
  port.close_timeout = kCloseTimeout;
  if (options.has_origin) port.router.allowed_origin = "https://example.org";
  return port;
}

// Both ends of a connection.
class Connection {
 public:
  explicit Connection(const Options& options)
      : options_(options),
        api_({options.needs_token, options.is_deferred, options.fails}),
        core_(std::make_shared<http::Core>(api_, PortOptionsOf(options))) {
    int ends[2] = {-1, -1};
    Require(socketpair(AF_UNIX, SOCK_STREAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0, ends) == 0,
            "there are sockets");
    client_ = ends[0];
    http::tcp::socket server(http::asio::make_strand(core_->io));
    server.assign(http::tcp::v4(), ends[1]);
    std::make_shared<http::HttpSession>(core_, *core_->connections->Enter(1), std::move(server),
                                        "127.0.0.1:1")
        ->Begin();
    RunServer();
  }

  ~Connection() {
    if (client_ >= 0) close(client_);
  }

  // What does not fit into the connection is lost, as of a client that gives up.
  void Send(std::string_view bytes) {
    while (!bytes.empty()) {
      const ssize_t sent = send(client_, bytes.data(), bytes.size(), MSG_NOSIGNAL);
      if (sent <= 0) return;
      bytes.remove_prefix(static_cast<size_t>(sent));
      RunServer();
    }
  }

  // Lets the source answer and the server work until nothing is left to do. The client reads.
  void Settle() {
    for (int k = 0; k < kMaxRounds; ++k) {
      size_t num_done = RunServer() + static_cast<size_t>(api_.host().RunReady());
      if (api_.AnswerNext() || api_.host().AnswerSearch() || api_.host().AnswerOrder()) {
        ++num_done;
      }
      if (!options_.reads_late) num_done += Receive();
      if (num_done == 0) return;
    }
  }

  size_t Receive() {
    char bytes[1 << 14];
    size_t num_read = 0;
    for (ssize_t size = 0; (size = recv(client_, bytes, sizeof(bytes), 0)) > 0;) {
      output_.append(bytes, static_cast<size_t>(size));
      num_read += static_cast<size_t>(size);
    }
    Require(output_.size() <= kMaxOutput, "a connection's answers are bounded");
    return num_read;
  }

  void PassTime(absl::Duration span) {
    api_.host().Advance(span);
    api_.host().RunReady();
  }

  void Advance(http::Phase phase) {
    core_->router.SetDraining();
    core_->connections->Advance(phase);
  }

  // The client goes away; then nothing may be left of the connection.
  void Finish() {
    close(std::exchange(client_, -1));
    for (int k = 0; k < 4; ++k) {
      RunServer();
      api_.host().RunReady();
      while (api_.AnswerNext() || api_.host().AnswerSearch() || api_.host().AnswerOrder()) {
      }
    }
    RunServer();
    const absl::Time give_up = absl::Now() + kPatience;
    while (!HasEnded() && absl::Now() < give_up) {  // a close that is to time out
      core_->io.restart();
      core_->io.run_one_for(http::ChronoOf(kPatience));
    }
    Require(HasEnded(), "a connection ends when its client has gone");
    api_.host().Clear();
    Require(core_.use_count() == 1, "nothing is left of a connection");
  }

  const std::string& output() const { return output_; }

 private:
  bool HasEnded() const { return core_->connections->AwaitNone(absl::ZeroDuration()); }

  size_t RunServer() {
    core_->io.restart();
    const size_t num_run = core_->io.poll();
    num_handlers_ += static_cast<int>(num_run);
    Require(num_handlers_ <= kMaxHandlers, "a connection costs a bounded number of steps");
    return num_run;
  }

  const Options options_;
  FuzzApi api_;
  std::shared_ptr<http::Core> core_;
  int client_ = -1;
  int num_handlers_ = 0;
  std::string output_;
};

void Quieten() {
  static const bool once = [] {
    base::StartLog("fuzz", base::LogLevel::kError, base::LogFormat::kText);
    return true;
  }();
  (void)once;
}

void SendPieces(const Options& options, size_t piece, std::string_view bytes,
                Connection& connection) {
  if (piece == 0) piece = bytes.size();
  piece = std::max({piece, bytes.size() / kMaxPieces, size_t{1}});
  for (size_t begin = 0; begin < bytes.size(); begin += piece) {
    connection.Send(bytes.substr(begin, piece));
    connection.Settle();
    connection.PassTime(kBetweenPieces);
    const bool is_middle = begin < bytes.size() / 2 && begin + piece >= bytes.size() / 2;
    if (is_middle && options.is_drained) connection.Advance(http::Phase::kDraining);
  }
}

void Run(Input input, std::string_view before, void (*check)(std::string_view)) {
  Quieten();
  const Options options(input.Byte());
  const size_t piece = input.Byte();
  Connection connection(options);
  if (!before.empty()) {
    connection.Send(before);
    connection.Settle();
  }
  SendPieces(options, piece, input.Rest(), connection);
  if (options.is_aborted) connection.Advance(http::Phase::kAborting);
  if (!options.closes_early) {
    connection.Settle();
    connection.Receive();
  }
  check(connection.output());
  connection.Finish();
}

}  // namespace

void RunHttp(std::span<const std::byte> bytes) { Run(Input(bytes), "", CheckHttpOutput); }

void RunWebSocket(std::span<const std::byte> bytes) {
  Run(Input(bytes), kUpgrade, CheckHttpOutput);
}

}  // namespace liquidblend::fuzz
