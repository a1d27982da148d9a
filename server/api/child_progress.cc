#include "server/api/child_progress.h"

#include <algorithm>

#include "core/store/catalog/catalog.h"

namespace liquidblend::server {
namespace {

using store::v1::JobRecord;

// The furthest behind of those that run, the first if there are several; null: none runs.
const JobRecord* SlowestOf(const std::vector<JobRecord>& children) {
  const JobRecord* slowest = nullptr;
  for (const JobRecord& child : children) {
    if (child.state() != JobRecord::RUNNING) continue;
    if (slowest == nullptr || child.progress().fraction() < slowest->progress().fraction()) {
      slowest = &child;
    }
  }
  return slowest;
}

// Until the last child ends, if those that run go on as they did and then take what is queued; 0 if
// one that runs does not know yet.
double SecondsLeft(const std::vector<JobRecord>& children) {
  int num_running = 0;
  double longest = 0.0, whole = 0.0, work = 0.0;  // seconds; work: in children
  for (const JobRecord& child : children) {
    work += 1.0 - child.progress().fraction();
    if (child.state() != JobRecord::RUNNING) continue;
    const double left = child.progress().seconds_left();
    if (left <= 0.0) return 0.0;
    ++num_running;
    whole += child.progress().seconds_elapsed() + left;
    longest = std::max(longest, left);
  }
  if (num_running == 0) return 0.0;
  const double mean = whole / num_running;
  return std::max(longest, work * mean / num_running);
}

// The child that is tried again first, if all that are not done wait for their next attempts; else
// null.
const JobRecord* NextToBeTried(const std::vector<JobRecord>& children) {
  const JobRecord* next = nullptr;
  for (const JobRecord& child : children) {
    if (child.state() == JobRecord::SUCCEEDED) continue;
    if (!child.has_next_attempt_time()) return nullptr;
    const bool is_sooner = next == nullptr || child.next_attempt_time().seconds() <
                                                  next->next_attempt_time().seconds();
    if (is_sooner) next = &child;
  }
  return next;
}

// Of all children together, and in vain the worst of those that are not done.
void AddHandedBack(const std::vector<JobRecord>& children, JobRecord& job) {
  for (const JobRecord& child : children) {
    job.set_handed_back(job.handed_back() + child.handed_back());
    if (child.state() == JobRecord::SUCCEEDED) continue;
    job.set_handed_back_in_vain(std::max(job.handed_back_in_vain(), child.handed_back_in_vain()));
  }
}

}  // namespace

JobRecord WithProgressOf(const std::vector<JobRecord>& children, JobRecord job) {
  if (children.empty() || !job.progress().stage().empty()) return job;
  double sum = 0.0, elapsed_s = 0.0;
  for (const JobRecord& child : children) {
    sum += child.progress().fraction();
    elapsed_s = std::max(elapsed_s, child.progress().seconds_elapsed());
  }
  if (const JobRecord* const slowest = SlowestOf(children)) {
    *job.mutable_progress() = slowest->progress();
    job.mutable_progress()->set_target_index(slowest->register_target().target_index());
    job.set_attempts(slowest->attempts());
    job.set_environment_failures(slowest->environment_failures());
    job.set_losses_after_progress(slowest->losses_after_progress());
    *job.mutable_failed_attempts() = slowest->failed_attempts();
    job.set_worker(slowest->worker());
  } else if (const JobRecord* const next = NextToBeTried(children)) {
    job.set_attempts(next->attempts());
    job.set_environment_failures(next->environment_failures());
    job.set_losses_after_progress(next->losses_after_progress());
    *job.mutable_next_attempt_time() = next->next_attempt_time();
    *job.mutable_failed_attempts() = next->failed_attempts();
  }
  AddHandedBack(children, job);
  job.mutable_progress()->set_fraction(store::kChildrenShare * sum /
                                       static_cast<double>(children.size()));
  job.mutable_progress()->set_seconds_elapsed(elapsed_s);
  job.mutable_progress()->set_seconds_left(SecondsLeft(children));
  return job;
}

}  // namespace liquidblend::server
