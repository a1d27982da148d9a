// Asks servers for frames without a pause until SIGTERM, and tells what became of each call:
//   steady_client HOST:PORT[,HOST:PORT..] FAMILY
// Two threads, the second with the addresses in the reverse order. Every answer to the same
// question must have the same bytes. Prints a line when it begins and one of JSON at the end; exit
// 1 if a call failed or bytes differed.
#include <liquidblend/client.h>
#include <signal.h>

#include <algorithm>
#include <atomic>
#include <cstdio>
#include <map>
#include <string>
#include <thread>
#include <vector>

#include "absl/strings/str_join.h"
#include "absl/strings/str_split.h"
#include "absl/synchronization/mutex.h"
#include "absl/time/clock.h"

namespace liquidblend::e2e {
namespace {

constexpr int kNumQuestions = 24;  // weights 0 to 1 in sixths, four times each
constexpr absl::Duration kPause = absl::Milliseconds(20);

struct Tally {
  int64_t num_calls = 0;
  int64_t num_failed = 0;
  int64_t num_different = 0;
  absl::Duration longest;
  std::string first_error;
};

FrameRequest QuestionOf(const std::string& family, int number) {
  FrameRequest request;
  request.family = family;
  request.weights = {number % 6 / 5.0};
  const int row = number / 6;
  request.time_s = row * 0.1;
  return request;
}

class SteadyClient {
 public:
  SteadyClient(std::string family, const std::atomic<bool>& stop)
      : family_(std::move(family)), stop_(stop) {}

  absl::Status Run(const std::string& servers) {
    ConnectOptions options;
    options.target = servers;
    options.connect_timeout = absl::Seconds(30);
    const auto client = Client::Connect(options);
    if (!client.ok()) return client.status();
    for (int number = 0; !stop_; number = (number + 1) % kNumQuestions) {
      const absl::Time begin = absl::Now();
      const absl::StatusOr<Frame> frame = (*client)->GetFrame(QuestionOf(family_, number));
      Note(number, frame, absl::Now() - begin);
      absl::SleepFor(kPause);
    }
    return absl::OkStatus();
  }

  Tally tally() {
    absl::MutexLock lock(&mutex_);
    return tally_;
  }

 private:
  void Note(int number, const absl::StatusOr<Frame>& frame, absl::Duration duration) {
    absl::MutexLock lock(&mutex_);
    ++tally_.num_calls;
    tally_.longest = std::max(tally_.longest, duration);
    if (!frame.ok()) {
      ++tally_.num_failed;
      if (tally_.first_error.empty()) tally_.first_error = frame.status().ToString();
    } else if (answers_.emplace(number, frame->data).first->second != frame->data) {
      ++tally_.num_different;
    }
  }

  const std::string family_;
  const std::atomic<bool>& stop_;
  absl::Mutex mutex_;
  Tally tally_ ABSL_GUARDED_BY(mutex_);
  std::map<int, std::string> answers_ ABSL_GUARDED_BY(mutex_);  // the first to each question
};

std::string Reversed(const std::string& servers) {
  std::vector<std::string> addresses = absl::StrSplit(servers, ',');
  std::reverse(addresses.begin(), addresses.end());
  return absl::StrJoin(addresses, ",");
}

int Main(const std::string& servers, const std::string& family, const sigset_t& signals) {
  std::atomic<bool> stop = false;
  SteadyClient client(family, stop);
  std::vector<absl::Status> ends(2);
  std::thread one([&] { ends[0] = client.Run(servers); });
  std::thread two([&] { ends[1] = client.Run(Reversed(servers)); });
  std::printf("asking %s for %s\n", servers.c_str(), family.c_str());
  std::fflush(stdout);
  int signal = 0;
  sigwait(&signals, &signal);
  stop = true;
  one.join();
  two.join();
  const Tally tally = client.tally();
  std::printf("{\"calls\": %ld, \"failed\": %ld, \"different\": %ld, \"longest_ms\": %.0f}\n",
              tally.num_calls, tally.num_failed, tally.num_different,
              absl::ToDoubleMilliseconds(tally.longest));
  if (!tally.first_error.empty()) std::fprintf(stderr, "%s\n", tally.first_error.c_str());
  for (const absl::Status& end : ends) {
    if (!end.ok()) std::fprintf(stderr, "%s\n", end.ToString().c_str());
  }
  const bool connected = ends[0].ok() && ends[1].ok();
  return connected && tally.num_calls > 0 && tally.num_failed + tally.num_different == 0 ? 0 : 1;
}

}  // namespace
}  // namespace liquidblend::e2e

int main(int argc, char** argv) {
  if (argc != 3) {
    std::fprintf(stderr, "usage: steady_client HOST:PORT[,HOST:PORT..] FAMILY\n");
    return 2;
  }
  sigset_t signals;
  sigemptyset(&signals);
  for (const int number : {SIGTERM, SIGINT}) sigaddset(&signals, number);
  pthread_sigmask(SIG_BLOCK, &signals, nullptr);
  return liquidblend::e2e::Main(argv[1], argv[2], signals);
}
