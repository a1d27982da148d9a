// lb_http_load: asks servers, or a cache in front of them, for frames over HTTP, some more often
// than others, and prints a row: how many frames, how long they took. Or compares the answers of
// all addresses.
#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <map>
#include <random>
#include <string>
#include <vector>

#include "absl/strings/str_cat.h"
#include "client/src/http.h"
#include "core/base/status_macros.h"
#include "tests/bench/load_report.h"
#include "tests/bench/machine_stops.h"
#include "tests/bench/pace.h"

namespace liquidblend::bench {
namespace {

constexpr int kWeightsPerTime = 101;  // 0 to 1 in hundredths

struct Flags {
  std::vector<std::string> bases;
  std::string family;
  int64_t version = 1;
  double duration_s = 1.0;
  int frames = 5'000;
  double exponent = 1.0;
  int clients = 8;
  double per_second = 20.0;
  double seconds = 10.0;
  unsigned seed = 1;
  bool compare = false;
  std::string name = "frames";
};

// Frame k of the family's version: a weight, and one of as many times as that takes.
std::string PathOf(const Flags& flags, int k) {
  const int num_times = (flags.frames + kWeightsPerTime - 1) / kWeightsPerTime;
  const int row = k / kWeightsPerTime;
  const double time_s = flags.duration_s * row / std::max(1, num_times - 1);
  return absl::StrCat("/v1/families/", flags.family,
                      "/frame.drc?weights=", 0.01 * (k % kWeightsPerTime), "&time=", time_s,
                      "&version=", flags.version);
}

// Numbers of frames by Zipf's law: the n-th most popular is asked for as 1 / n^exponent. Which one
// that is, is shuffled, the same way for every client.
class Popularity {
 public:
  explicit Popularity(const Flags& flags) : frames_(static_cast<size_t>(flags.frames)) {
    std::vector<double> shares;
    for (int n = 1; n <= flags.frames; ++n) shares.push_back(std::pow(n, -flags.exponent));
    ranks_ = std::discrete_distribution<int>(shares.begin(), shares.end());
    for (int k = 0; k < flags.frames; ++k) frames_[static_cast<size_t>(k)] = k;
    std::shuffle(frames_.begin(), frames_.end(), std::minstd_rand(1));
  }

  int Draw(std::minstd_rand& random) { return frames_[static_cast<size_t>(ranks_(random))]; }

 private:
  std::discrete_distribution<int> ranks_;
  std::vector<int> frames_;
};

struct Got {
  std::string bytes;
  std::string etag;
};

absl::StatusOr<Got> Get(client::Http& http, const std::string& url) {
  Got got;
  LB_ASSIGN_OR_RETURN(const client::HttpAnswer answer, http.Get(url, [&](absl::string_view bytes) {
    got.bytes.append(bytes.data(), bytes.size());
    return true;
  }));
  LB_RETURN_IF_ERROR(client::StatusOf(answer));
  got.etag = answer.etag;
  return got;
}

ClientReport Call(const Flags& flags, int client, const std::stop_token& stop) {
  ClientReport report;
  client::Http http("", client::HttpHosts::kAny);
  Popularity popularity(flags);
  std::minstd_rand random(flags.seed * 1000 + static_cast<unsigned>(client));
  Turns turns(flags.per_second, stop);
  for (size_t k = static_cast<size_t>(client); turns.Next(); ++k) {
    const std::string& base = flags.bases[k % flags.bases.size()];
    const Clock::time_point start = Clock::now();
    const auto got = Get(http, absl::StrCat(base, PathOf(flags, popularity.Draw(random))));
    report.latencies_ms.push_back(
        std::chrono::duration<double, std::milli>(Clock::now() - start).count());
    if (!got.ok() && ++report.num_errors == 1) {
      std::fprintf(stderr, "lb_http_load: %s\n", got.status().ToString().c_str());
    }
    if (got.ok()) report.num_bytes += static_cast<int64_t>(got->bytes.size());
  }
  return report;
}

// Whether the load went without an error.
bool Load(const Flags& flags) {
  std::vector<Group> groups = {Repeat(flags.name, flags.clients, [&flags](int client) {
    return [&flags, client](const std::stop_token& stop) { return Call(flags, client, stop); };
  })};
  Run(groups, flags.seconds);
  const ClientReport& report = groups[0].report;
  const std::vector<double>& ms = report.latencies_ms;
  std::printf("| %s | %d | %zu | %ld | %.0f | %.2f | %.2f | %.2f |\n", flags.name.c_str(),
              flags.clients, ms.size(), report.num_errors,
              static_cast<double>(ms.size()) / flags.seconds, Percentile(ms, 0.5),
              Percentile(ms, 0.99), ms.empty() ? 0.0 : ms.back());
  return report.num_errors == 0 && !ms.empty();
}

// Whether all addresses give the same bytes and tags. Each is asked twice: a cache has the frame
// then.
absl::StatusOr<bool> Compare(const Flags& flags) {
  client::Http http("", client::HttpHosts::kAny);
  int num_different = 0;
  for (int k = 0; k < flags.frames; ++k) {
    std::map<std::string, int> answers;
    for (size_t turn = 0; turn < 2 * flags.bases.size(); ++turn) {
      const std::string& base = flags.bases[turn % flags.bases.size()];
      LB_ASSIGN_OR_RETURN(const Got got, Get(http, absl::StrCat(base, PathOf(flags, k))));
      if (got.bytes.empty() || got.etag.empty()) ++num_different;
      ++answers[absl::StrCat(got.etag, "\n", got.bytes)];
    }
    if (answers.size() > 1) ++num_different;
  }
  std::printf("%d frames of %zu addresses, twice each: %d differ\n", flags.frames,
              flags.bases.size(), num_different);
  return num_different == 0;
}

int Main(const Flags& flags) {
  if (!flags.compare) return Load(flags) ? 0 : 1;
  const absl::StatusOr<bool> same = Compare(flags);
  if (!same.ok()) std::fprintf(stderr, "lb_http_load: %s\n", same.status().ToString().c_str());
  return same.ok() && *same ? 0 : 1;
}

}  // namespace
}  // namespace liquidblend::bench

int main(int argc, char** argv) {
  CLI::App app("Asks for frames over HTTP");
  liquidblend::bench::Flags flags;
  app.add_option("--base", flags.bases, "http://HOST:PORT; repeatable: by turns")->required();
  app.add_option("--family", flags.family, "Its id")->required();
  app.add_option("--version-of-family", flags.version, "That is asked for")->capture_default_str();
  app.add_option("--duration", flags.duration_s, "Of the family, seconds")->capture_default_str();
  app.add_option("--frames", flags.frames, "Different ones")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  app.add_option("--exponent", flags.exponent, "How much more the popular ones are asked for")
      ->capture_default_str();
  app.add_option("--clients", flags.clients, "Side by side")->capture_default_str();
  app.add_option("--per-second", flags.per_second, "Calls of each client")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  app.add_option("--seconds", flags.seconds, "How long")->capture_default_str();
  app.add_option("--seed", flags.seed, "Of the frames that are drawn")->capture_default_str();
  app.add_option("--name", flags.name, "Of the row")->capture_default_str();
  app.add_flag("--compare", flags.compare, "Compare the answers of all addresses instead");
  CLI11_PARSE(app, argc, argv);
  return liquidblend::bench::Main(flags);
}
