// lb_hostile: eight honest clients of a server, alone and beside hostile ones, and what the attack
// costs them and the server. The attackers are a process of their own at the lowest priority, as
// they would be other machines: their work must not take cores from the server or its clients.
#include <sys/resource.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <chrono>
#include <cstdio>
#include <memory>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/synchronization/mutex.h"
#include "core/base/status_macros.h"
#include "tests/bench/attackers.h"
#include "tests/bench/load_clients.h"
#include "tests/bench/load_family.h"
#include "tests/bench/load_report.h"
#include "tests/bench/load_server.h"
#include "tests/bench/process_usage.h"
#include "tests/core/store/store_testing.h"
#include "tests/e2e/process.h"

namespace liquidblend::bench {
namespace {

struct Flags {
  double seconds = 60.0;
  double alone_seconds = 0.0;  // 0: a quarter of `seconds`
  int vertices = 20'000;
  double warp = 10.0;
  int threads = 2;
  double frame_cache_mb = 32.0;
  double max_ratio = 1.5;
  double max_growth_mb = 100.0;
  // The attacking process.
  bool attacks = false;
  std::string address;
  int http_port = 0;
  std::string family = kLoadFamily;
  int num_weights = 1;
};

// ---- the attacking process

double OwnCpuSeconds() {
  rusage usage = {};
  getrusage(RUSAGE_SELF, &usage);
  const auto seconds = [](const timeval& time) {
    return static_cast<double>(time.tv_sec) + 1e-6 * static_cast<double>(time.tv_usec);
  };
  return seconds(usage.ru_utime) + seconds(usage.ru_stime);
}

// Fails on a wrong answer, and if an attacker did not get to attack.
int Attack(const Flags& flags) {
  constexpr int kLowestPriority = 19;
  constexpr double kLeastShare = 0.5;  // of the attempts that the rates allow
  setpriority(PRIO_PROCESS, 0, kLowestPriority);
  const AttackTarget target = {{flags.address, flags.family, flags.num_weights, 0.0},
                               flags.http_port};
  const std::vector<Attacker> attackers = AllAttackers();
  std::vector<AttackReport> reports(attackers.size());
  {
    std::vector<std::jthread> threads;
    for (size_t k = 0; k < attackers.size(); ++k) {
      threads.emplace_back(
          [&, k](const std::stop_token& stop) { reports[k] = attackers[k].run(target, stop); });
    }
    std::this_thread::sleep_for(std::chrono::duration<double>(flags.seconds));
    for (std::jthread& thread : threads) thread.request_stop();
  }
  std::printf("| attack | limit | attempts | wrong answers |\n| --- | --- | --- | --- |\n");
  bool is_attack = true;
  int64_t num_wrong = 0;
  for (size_t k = 0; k < attackers.size(); ++k) {
    std::printf("| %s | %s | %ld | %ld |\n", attackers[k].name.c_str(), attackers[k].rate.c_str(),
                reports[k].num_attempts, reports[k].num_wrong);
    num_wrong += reports[k].num_wrong;
    is_attack &= static_cast<double>(reports[k].num_attempts) >=
                 kLeastShare * attackers[k].per_second * flags.seconds;
  }
  if (!is_attack) std::printf("An attacker made less than half of its attempts.\n");
  std::printf("The attackers took %.2f cores.\n", OwnCpuSeconds() / flags.seconds);
  return is_attack && num_wrong == 0 ? 0 : 1;
}

e2e::Process StartAttack(const LoadServer& server, const LoadTarget& target, double seconds) {
  return e2e::Process("lb_hostile",
                      {"--attacks", "--seconds", absl::StrCat(seconds), "--address", target.address,
                       "--http-port", absl::StrCat(server.http_port()), "--family", target.family,
                       "--num-weights", absl::StrCat(target.num_weights)});
}

// Prints what it says. Returns whether all attackers made their attempts and no answer was wrong.
bool EndAttack(e2e::Process attack) {
  for (std::string line = attack.ReadLine(); !line.empty(); line = attack.ReadLine()) {
    std::printf("%s\n", line.c_str());
  }
  return attack.Wait() == 0;
}

// ---- the honest clients

std::vector<Group> HonestClients(const LoadTarget& target) {
  const auto callers = [&](const char* name, int count, Frames frames, double per_second) {
    return Repeat(name, count, [=](int) {
      return [=](const std::stop_token& stop) {
        return CallFrames(target, {.frames = frames, .per_second = per_second}, stop);
      };
    });
  };
  return {callers("calls, uncached, 4/s each", 3, Frames::kDifferent, 4.0),
          callers("calls, cached, 20/s each", 3, Frames::kRepeated, 20.0),
          Repeat("streams, 24 frames/s, new weights each", 2, [=](int) {
            return [=](const std::stop_token& stop) { return WatchStream(target, 24.0, stop); };
          })};
}

// What the groups saw, and below it all of them together.
struct Phase {
  std::vector<Group> groups;
  double seconds = 0.0;
  double server_cpu_s = 0.0;
};

absl::StatusOr<Phase> RunPhase(const LoadServer& server, const LoadTarget& target, double seconds) {
  Phase phase = {HonestClients(target), seconds, 0.0};
  LB_ASSIGN_OR_RETURN(const ProcessUsage before, UsageOf(server.pid()));
  Run(phase.groups, seconds);
  LB_ASSIGN_OR_RETURN(const ProcessUsage after, UsageOf(server.pid()));
  phase.server_cpu_s = after.cpu_s - before.cpu_s;
  Group all{"all eight", {}, {}};
  for (const Group& group : phase.groups) {
    all.clients.insert(all.clients.end(), group.clients.begin(), group.clients.end());
    AddUp(group.report, all.report);
  }
  Sort(all.report);
  phase.groups.push_back(std::move(all));
  return phase;
}

void AddPhase(const Phase& more, Phase& all) {
  for (size_t g = 0; g < all.groups.size(); ++g) {
    AddUp(more.groups[g].report, all.groups[g].report);
    Sort(all.groups[g].report);
  }
  all.seconds += more.seconds;
  all.server_cpu_s += more.server_cpu_s;
}

void PrintPhase(const std::string& title, Phase& phase) {
  PrintTitle(absl::StrCat(title, ", ", phase.seconds, " s"));
  for (Group& group : phase.groups) Print(group, phase.seconds);
}

// ---- the verdict

double P99(const Group& group) { return Percentile(group.report.latencies_ms, 0.99); }

// The last group is all clients together: what counts. The ratios of the others are for the reader,
// because cached calls take less than a time slice of the machine.
double PrintRatios(const Phase& alone, const Phase& attacked) {
  std::printf(
      "\n| honest clients | p50 ratio | p95 ratio | p99 ratio |\n| --- | --- | --- | --- |\n");
  for (size_t g = 0; g < alone.groups.size(); ++g) {
    const auto ratio = [&](double share) {
      const double base_ms = Percentile(alone.groups[g].report.latencies_ms, share);
      return Percentile(attacked.groups[g].report.latencies_ms, share) / std::max(base_ms, 1e-3);
    };
    std::printf("| %s | %.2f | %.2f | %.2f |\n", alone.groups[g].name.c_str(), ratio(0.5),
                ratio(0.95), ratio(0.99));
  }
  return P99(attacked.groups.back()) / std::max(P99(alone.groups.back()), 1e-3);
}

struct MemoryOfRun {
  double start_mb = 0.0;    // before the attack, with caches that are full
  double largest_mb = 0.0;  // from then on
  double end_mb = 0.0;      // after the attack
};

// Prints whether the target is met. Returns that.
bool Judge(const char* target, double value, double limit, const char* unit) {
  const bool is_met = value <= limit;
  std::printf("%s: %s is %.2f%s, at most %.2f%s wanted\n", is_met ? "met" : "MISSED", target, value,
              unit, limit, unit);
  return is_met;
}

bool PrintVerdict(const Flags& flags, Phase& alone, Phase& attacked, const MemoryOfRun& memory) {
  PrintHeader();
  PrintPhase("alone, before and after", alone);
  PrintPhase("under attack", attacked);
  const double ratio = PrintRatios(alone, attacked);
  std::printf("\nThe server took %.2f cores alone, %.2f under attack.\n",
              alone.server_cpu_s / alone.seconds, attacked.server_cpu_s / attacked.seconds);
  std::printf("Its resident memory: %.1f MB at the start, %.1f MB at most, %.1f MB at the end.\n\n",
              memory.start_mb, memory.largest_mb, memory.end_mb);
  const auto num_errors = static_cast<double>(attacked.groups.back().report.num_errors +
                                              alone.groups.back().report.num_errors);
  const double growth_mb = std::max(memory.largest_mb, memory.end_mb) - memory.start_mb;
  bool is_met = Judge("p99 under attack by p99 alone", ratio, flags.max_ratio, "");
  is_met &= Judge("growth of resident memory", growth_mb, flags.max_growth_mb, " MB");
  is_met &= Judge("honest calls that failed", num_errors, 0, "");
  return is_met;
}

// Whether all targets are met.
absl::StatusOr<bool> RunAll(const Flags& flags) {
  constexpr double kHeadStart = 2.0;  // seconds of attack before it is measured, and after it
  const double alone_s =
      (flags.alone_seconds > 0 ? flags.alone_seconds : flags.seconds / 4) / 2;  // on either side
  const store::TemporaryFolder folder;
  LB_RETURN_IF_ERROR(MakeLoadFamily(folder.path(), flags.vertices, flags.warp).status());
  LB_ASSIGN_OR_RETURN(const std::unique_ptr<LoadServer> server,
                      LoadServer::Start({.data = folder.path(),
                                         .num_threads = flags.threads,
                                         .frame_cache_mb = flags.frame_cache_mb}));
  LB_ASSIGN_OR_RETURN(const LoadTarget target, server->Target(flags.family));
  // Not measured: it fills the cache of frames, which is no growth under attack.
  LB_RETURN_IF_ERROR(RunPhase(*server, target, alone_s).status());
  LB_ASSIGN_OR_RETURN(Phase alone, RunPhase(*server, target, alone_s));
  LB_ASSIGN_OR_RETURN(const ProcessUsage start, UsageOf(server->pid()));
  MemoryWatch memory(server->pid());
  e2e::Process attack = StartAttack(*server, target, flags.seconds + 2 * kHeadStart);
  std::this_thread::sleep_for(std::chrono::duration<double>(kHeadStart));
  LB_ASSIGN_OR_RETURN(Phase attacked, RunPhase(*server, target, flags.seconds));
  const bool is_attack_right = EndAttack(std::move(attack));
  LB_ASSIGN_OR_RETURN(const Phase after, RunPhase(*server, target, alone_s));
  LB_ASSIGN_OR_RETURN(const ProcessUsage end, UsageOf(server->pid()));
  AddPhase(after, alone);
  const bool is_met =
      PrintVerdict(flags, alone, attacked, {start.resident_mb, memory.Stop(), end.resident_mb});
  if (!is_attack_right) std::printf("MISSED: a wrong answer, or too few attempts\n");
  return is_met && is_attack_right;
}

void AddFlags(CLI::App& app, Flags& flags) {
  app.add_option("--seconds", flags.seconds, "Of the attack")->capture_default_str();
  app.add_option("--alone-seconds", flags.alone_seconds,
                 "Of the honest clients alone, half before and half after the attack; default: a "
                 "quarter of --seconds");
  app.add_option("--vertices", flags.vertices, "Of a frame, on average")->capture_default_str();
  app.add_option("--warp", flags.warp, "Largest time warp at weight 1, frames")
      ->capture_default_str();
  app.add_option("--threads", flags.threads, "Of the server, for frames")->capture_default_str();
  app.add_option("--frame-cache", flags.frame_cache_mb, "Of the server, MB")->capture_default_str();
  app.add_option("--max-ratio", flags.max_ratio, "Target: p99 under attack by p99 alone")
      ->capture_default_str();
  app.add_option("--max-growth", flags.max_growth_mb, "Target: growth of resident memory, MB")
      ->capture_default_str();
  app.add_flag("--attacks", flags.attacks, "Is the attacking process")->group("");
  app.add_option("--address", flags.address)->group("");
  app.add_option("--http-port", flags.http_port)->group("");
  app.add_option("--family", flags.family)->group("");
  app.add_option("--num-weights", flags.num_weights)->group("");
}

}  // namespace
}  // namespace liquidblend::bench

int main(int argc, char** argv) {
  CLI::App app(
      "Eight honest clients of a server on this machine, alone and beside hostile ones. Prints "
      "what the attack costs; exits with 1 if a target is missed.");
  liquidblend::bench::Flags flags;
  liquidblend::bench::AddFlags(app, flags);
  CLI11_PARSE(app, argc, argv);
  // As the server does: clients share its machine.
  absl::SetMutexDeadlockDetectionMode(absl::OnDeadlockCycle::kIgnore);
  if (flags.attacks) return liquidblend::bench::Attack(flags);
  const absl::StatusOr<bool> is_met = liquidblend::bench::RunAll(flags);
  if (is_met.ok()) return *is_met ? 0 : 1;
  std::fprintf(stderr, "lb_hostile: %s\n", is_met.status().ToString().c_str());
  return 1;
}
