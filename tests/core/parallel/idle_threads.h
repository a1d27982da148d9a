// Helpers for tests: so many threads that have nothing else to do.
#pragma once

#include <algorithm>
#include <thread>
#include <vector>

#include "core/parallel/helpers.h"

namespace liquidblend::parallel {

// Every task gets a thread of its own.
class IdleThreads : public Helpers {
 public:
  explicit IdleThreads(int num_idle) : num_idle_(num_idle) {}
  int num_idle() const override { return num_idle_; }
  void Run(int num_tasks, absl::FunctionRef<void(int)> task) override {
    most_tasks = std::max(most_tasks, num_tasks);
    std::vector<std::thread> threads;
    for (int k = 0; k < num_tasks; ++k) threads.emplace_back([&task, k] { task(k); });
    for (std::thread& thread : threads) thread.join();
  }
  int most_tasks = 0;

 private:
  const int num_idle_;
};

}  // namespace liquidblend::parallel
