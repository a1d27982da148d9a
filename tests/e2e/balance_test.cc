// Replicas that come and go while clients are busy: calls spread over them, and nobody notices.
// With LIQUIDBLEND_BALANCE_SECONDS in the environment (tests/balance.sh) it measures: with the
// server's defaults, that long, and what depends on the machine is asserted, too.
#include <signal.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "absl/synchronization/mutex.h"
#include "absl/time/clock.h"
#include "client/player/player.h"
#include "client/player/server_source.h"
#include "client/src/http.h"
#include "liquidblend/client.h"
#include "tests/e2e/e2e_testing.h"
#include "tests/e2e/fake_dns.h"

namespace liquidblend::e2e {
namespace {

constexpr int kCallsPerSecond = 50;
constexpr int kNumPlayers = 8;
constexpr int kNumStreams = 2;
constexpr int kNumFrames = 6;  // of the family
constexpr double kPlayerFramesPerSecond = 30.0;
constexpr absl::Duration kPollInterval = absl::Milliseconds(10);
constexpr double kAimedShare = 0.25;
constexpr absl::Duration kAimedTime = absl::Seconds(60);
constexpr absl::Duration kAimedGap = absl::Milliseconds(200);

// 0: this is a test, not a measurement.
int MeasuredSeconds() {
  const char* const seconds = std::getenv("LIQUIDBLEND_BALANCE_SECONDS");
  int number = 0;
  return seconds != nullptr && absl::SimpleAtoi(seconds, &number) ? number : 0;
}

// What the callers, players and streams of a test saw.
struct Tally {
  std::atomic<int64_t> num_calls = 0;
  std::atomic<int64_t> num_failed = 0;
  std::atomic<int64_t> num_frames = 0;        // of streams
  std::atomic<int64_t> num_out_of_order = 0;  // of these
  std::atomic<int64_t> num_shown = 0;         // frames of players
  std::atomic<int64_t> num_missed = 0;

  void Fail(const absl::Status& status) {
    ++num_failed;
    const absl::MutexLock lock(&mutex_);
    if (first_error_.ok()) first_error_ = status;
  }
  absl::Status first_error() {
    const absl::MutexLock lock(&mutex_);
    return first_error_;
  }
  void NoteGap(absl::Duration& longest, absl::Duration gap) {
    const absl::MutexLock lock(&mutex_);
    longest = std::max(longest, gap);
  }

  absl::Duration longest_call, player_gap, stream_gap;

 private:
  absl::Mutex mutex_;
  absl::Status first_error_ ABSL_GUARDED_BY(mutex_);
};

ConnectOptions OptionsFor(const std::string& target) {
  ConnectOptions options;
  options.target = target;
  options.connect_timeout = absl::FromChrono(Patience());
  return options;
}

// Calls at a steady pace, each for another frame, until the stop.
void CallSteadily(const std::string& target, const std::stop_token& stop, Tally& tally) {
  const auto client = Client::Connect(OptionsFor(target));
  if (!client.ok()) return tally.Fail(client.status());
  const absl::Time begin = absl::Now();
  for (int k = 0; !stop.stop_requested(); ++k) {
    absl::SleepFor(begin + k * absl::Seconds(1) / kCallsPerSecond - absl::Now());
    FrameRequest request;
    request.family = "balls";
    request.weights = {k % 1000 * 0.001};
    const absl::Time asked = absl::Now();
    const absl::Status status = (*client)->GetFrame(request).status();
    tally.NoteGap(tally.longest_call, absl::Now() - asked);
    ++tally.num_calls;
    if (!status.ok()) tally.Fail(status);
  }
}

// A loop that draws: it polls a player, and notes how long the same frame stays.
void Play(const std::string& target, const std::stop_token& stop, Tally& tally) {
  auto source = player::ServerSource::Open(OptionsFor(target), "balls", 0);
  if (!source.ok()) return tally.Fail(source.status());
  player::PlayerOptions options;
  options.schedule.frames_per_second = kPlayerFramesPerSecond;
  options.adapts_detail = false;
  options.num_threads = 2;
  player::Player player(*std::move(source), options);
  player::BlendSpec half;
  half.weights = {0.5};
  player.SetBlend(half, 0.0);
  player.SetLoop(true);
  player.SetPlaying(true);
  player::FramePtr shown;
  absl::Time since = absl::InfiniteFuture();
  for (const absl::Time begin = absl::Now(); !stop.stop_requested();) {
    const absl::Time now = absl::Now();
    const player::PolledFrame polled = player.Poll(absl::ToDoubleSeconds(now - begin));
    if (polled.frame != shown) {
      tally.NoteGap(tally.player_gap, now - since);
      shown = polled.frame;
      since = now;
    }
    absl::SleepFor(kPollInterval);
  }
  tally.num_shown += player.statistics().counts.num_shown;
  tally.num_missed += player.statistics().counts.num_missed;
}

// Reads a stream that loops at its own pace, and checks that no frame is missing.
void ReadStream(const std::string& target, const std::stop_token& stop, Tally& tally) {
  const auto client = Client::Connect(OptionsFor(target));
  if (!client.ok()) return tally.Fail(client.status());
  StreamSettings settings;
  settings.family = "balls";
  settings.weights = {0.5};
  settings.loop = true;
  const auto stream = (*client)->StreamFrames(settings);
  if (!stream.ok()) return tally.Fail(stream.status());
  absl::Time before = absl::InfiniteFuture();
  for (int64_t k = 0; !stop.stop_requested(); ++k) {
    const auto streamed = (*stream)->Read();
    if (!streamed.ok()) return tally.Fail(streamed.status());
    if (!streamed->has_value()) return tally.Fail(absl::InternalError("the loop has ended"));
    tally.NoteGap(tally.stream_gap, absl::Now() - before);
    before = absl::Now();
    const auto frame = static_cast<double>((k + (*streamed)->num_dropped) % kNumFrames);
    const bool is_next =
        (*streamed)->frame_index == k && std::abs((*streamed)->frame.time_s - frame / 24.0) < 1e-6;
    if (!is_next) ++tally.num_out_of_order;
    ++tally.num_frames;
  }
}

class BalanceTest : public E2eTest {
 protected:
  // On a store with the family balls.
  BalanceTest() {
    const Process server = StartServer(1);
    ExpectSuccess(AwaitDone(ImportBall("a", 1.0).name()));
    ExpectSuccess(AwaitDone(ImportBall("b", 2.0).name()));
    Operation registration;
    EXPECT_TRUE(Register(1, registration).ok());
    ExpectSuccess(AwaitDone(registration.name()));
  }

  struct Replica {
    Process process;
    std::string address;  // of gRPC
    std::string http;
  };

  // At HOST:PORT, with an HTTP port; of defaults if that is measured, else quick to renew
  // connections.
  Replica StartReplica(const std::string& listen) {
    std::vector<std::string> arguments = StoreArguments();
    arguments.insert(arguments.end(),
                     {"--listen", listen, "--workers", "0", "--http", "127.0.0.1:0"});
    if (MeasuredSeconds() == 0) arguments.insert(arguments.end(), {"--connection-age", "1s"});
    Replica replica;
    replica.process = Process("liquidblend-server", arguments, WithStore());
    replica.address = WordAfter("listening on ", replica.process);
    replica.http = WordAfter("http on ", replica.process);
    return replica;
  }

  static std::string Get(const Replica& replica, const std::string& path) {
    client::Http http("", client::HttpHosts::kAny);
    std::string body;
    const auto answer =
        http.Get(absl::StrCat("http://", replica.http, path), [&](absl::string_view bytes) {
          body.append(bytes.data(), bytes.size());
          return true;
        });
    return answer.ok() && answer->status == 200 ? body : "";
  }

  // GetFrame calls that it has answered.
  static int64_t NumAnswered(const Replica& replica) {
    const std::string text = Get(replica, "/metrics");
    const std::string name =
        R"(liquidblend_requests_total{code="OK",method="GetFrame",protocol="grpc"} )";
    const size_t at = text.find(name);
    double number = 0.0;
    if (at == std::string::npos) return 0;
    const size_t begin = at + name.size();
    EXPECT_TRUE(absl::SimpleAtod(text.substr(begin, text.find('\n', begin) - begin), &number));
    return static_cast<int64_t>(number);
  }

 private:
  static std::string WordAfter(const std::string& words, Process& process) {
    const std::string line = process.ReadLine();
    EXPECT_EQ(line.substr(0, words.size()), words);
    return line.substr(std::min(line.size(), words.size()));
  }
};

int PortOf(const std::string& address) {
  int port = 0;
  EXPECT_TRUE(absl::SimpleAtoi(address.substr(address.rfind(':') + 1), &port));
  return port;
}

// The client knows a name; the new replica is one address more of it.
TEST_F(BalanceTest, ANewReplicaTakesItsShareOfTheCalls) {
  Replica first = StartReplica("127.0.0.1:0");
  const int port = PortOf(first.address);
  FakeDns dns({"127.0.0.1"});
  Tally tally;
  std::jthread caller([&](const std::stop_token& stop) {
    CallSteadily(dns.Target("replicas.test", port), stop, tally);
  });
  Await([&] { return NumAnswered(first) > kCallsPerSecond; });

  Replica second = StartReplica(absl::StrCat("127.0.0.2:", port));
  dns.SetAddresses({"127.0.0.1", "127.0.0.2"});
  const absl::Time added = absl::Now();
  absl::Duration until_share = absl::InfiniteDuration();
  double share = 0.0;
  Await([&] {
    const int64_t before = NumAnswered(first), other = NumAnswered(second);
    absl::SleepFor(absl::Seconds(1));
    const auto num_first = static_cast<double>(NumAnswered(first) - before);
    const auto num_second = static_cast<double>(NumAnswered(second) - other);
    share = num_second / std::max(1.0, num_first + num_second);
    if (share < kAimedShare) return false;
    until_share = absl::Now() - added;
    return true;
  });
  caller.request_stop();
  caller.join();
  std::printf("a new replica: %.0f %% of the calls after %.1f s; %ld calls, %ld failed\n",
              100.0 * share, absl::ToDoubleSeconds(until_share), tally.num_calls.load(),
              tally.num_failed.load());
  EXPECT_EQ(tally.num_failed, 0) << tally.first_error();
  if (MeasuredSeconds() > 0) {
    EXPECT_LE(until_share, kAimedTime);
  }
}

TEST_F(BalanceTest, AReplicaIsDrainedUnderLoadAndNobodyNotices) {
  std::vector<Replica> replicas;
  for (int k = 0; k < 2; ++k) replicas.push_back(StartReplica("127.0.0.1:0"));
  const std::string target = absl::StrCat(replicas[0].address, ",", replicas[1].address);
  Tally tally;
  std::vector<std::jthread> clients;
  const auto start = [&](auto run) {
    clients.emplace_back([&, run](const std::stop_token& stop) { run(target, stop, tally); });
  };
  start(CallSteadily);
  for (int k = 0; k < kNumPlayers; ++k) start(Play);
  for (int k = 0; k < kNumStreams; ++k) start(ReadStream);
  const auto are_all_busy = [&] {
    return tally.num_calls > kCallsPerSecond && tally.num_frames > kNumStreams * 24;
  };
  Await(are_all_busy);

  // One after the other goes, and comes again at its place.
  const absl::Time end = absl::Now() + absl::Seconds(MeasuredSeconds());
  int num_drained = 0;
  do {
    Replica& replica = replicas[static_cast<size_t>(num_drained++ % 2)];
    replica.process.Signal(SIGTERM);
    EXPECT_EQ(replica.process.Wait(), 0);
    const int64_t num_frames = tally.num_frames, num_calls = tally.num_calls;
    Await([&] {
      return tally.num_calls > num_calls + kCallsPerSecond &&
             tally.num_frames > num_frames + kNumStreams * 24;
    });
    replica = StartReplica(replica.address);
    Await([&] { return NumAnswered(replica) > 0; });
  } while (absl::Now() < end || num_drained < 2);
  for (std::jthread& client : clients) client.request_stop();
  clients.clear();

  std::printf(
      "%d drained: %ld calls, %ld failed, the longest %.0f ms; %d players: %ld frames shown, %ld "
      "missed, longest gap %.0f ms; %d streams: %ld frames, %ld out of order, longest gap %.0f "
      "ms\n",
      num_drained, tally.num_calls.load(), tally.num_failed.load(),
      absl::ToDoubleMilliseconds(tally.longest_call), kNumPlayers, tally.num_shown.load(),
      tally.num_missed.load(), absl::ToDoubleMilliseconds(tally.player_gap), kNumStreams,
      tally.num_frames.load(), tally.num_out_of_order.load(),
      absl::ToDoubleMilliseconds(tally.stream_gap));
  EXPECT_EQ(tally.num_failed, 0) << tally.first_error();
  EXPECT_EQ(tally.num_out_of_order, 0);
  EXPECT_GT(tally.num_shown, 0);
  if (MeasuredSeconds() > 0) {
    EXPECT_LT(tally.player_gap, kAimedGap);
  }
}

TEST_F(BalanceTest, ANewReplicaIsReadyOnceItHasWhatIsAskedFor) {
  Replica first = StartReplica("127.0.0.1:0");
  Connect(first.address);
  grpc::ClientContext context;
  v1::GetFrameRequest request;
  request.set_family("families/balls");
  request.add_weights(0.5);
  v1::Frame frame;
  ASSERT_TRUE(stub_->GetFrame(&context, request, &frame).ok());
  first.process.Signal(SIGTERM);  // what was asked for is recorded
  EXPECT_EQ(first.process.Wait(), 0);

  Replica second = StartReplica("127.0.0.1:0");
  Await([&] { return Get(second, "/readyz") == "ok\n"; });
  EXPECT_NE(Get(second, "/metrics").find("liquidblend_families_loaded 1"), std::string::npos);
  EXPECT_EQ(NumAnswered(second), 0);
}

}  // namespace
}  // namespace liquidblend::e2e
