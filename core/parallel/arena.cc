#include "core/parallel/arena.h"

#include <atomic>
#include <thread>

#ifndef LIQUIDBLEND_PARALLEL_JTHREAD
#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>
#endif

#include "core/base/cores.h"

namespace liquidblend::parallel {
namespace {

int NumThreadsOf(int asked_for) { return asked_for > 0 ? asked_for : base::NumCores(); }

}  // namespace

#ifdef LIQUIDBLEND_PARALLEL_JTHREAD

struct Arena::Impl {
  int num_threads;
};

Arena::Arena(int num_threads) : impl_(new Impl{NumThreadsOf(num_threads)}) {}

int Arena::num_threads() const { return impl_->num_threads; }

void Arena::Run(int64_t num_tasks, absl::FunctionRef<void(int64_t)> task) const {
  std::atomic<int64_t> next{0};
  const auto work = [&] {
    for (int64_t k = next++; k < num_tasks; k = next++) task(k);
  };
  std::vector<std::jthread> threads;
  const int64_t num_helpers = std::min<int64_t>(impl_->num_threads, num_tasks) - 1;
  for (int64_t i = 0; i < num_helpers; ++i) threads.emplace_back(work);
  work();
}

#else

struct Arena::Impl {
  explicit Impl(int num_threads) : arena(num_threads) {}
  tbb::task_arena arena;
};

Arena::Arena(int num_threads) : impl_(new Impl(NumThreadsOf(num_threads))) {}

int Arena::num_threads() const { return impl_->arena.max_concurrency(); }

void Arena::Run(int64_t num_tasks, absl::FunctionRef<void(int64_t)> task) const {
  if (num_threads() == 1 || num_tasks <= 1) {
    for (int64_t k = 0; k < num_tasks; ++k) task(k);
    return;
  }
  impl_->arena.execute([&] {
    tbb::parallel_for(
        int64_t{0}, num_tasks, [&](int64_t k) { task(k); }, tbb::simple_partitioner());
  });
}

#endif

Arena::~Arena() = default;

}  // namespace liquidblend::parallel
