#include "core/parallel/arena.h"

#include <gtest/gtest.h>

#include <atomic>
#include <bit>
#include <cmath>
#include <cstdint>
#include <thread>
#include <vector>

namespace liquidblend::parallel {
namespace {

constexpr int kThreadCounts[] = {1, 2, 8};

TEST(Arena, HasTheThreadsItIsAskedFor) {
  EXPECT_EQ(Arena(3).num_threads(), 3);
  EXPECT_GE(Arena().num_threads(), 1);
}

TEST(Arena, RunsEachTaskOnce) {
  for (const int num_threads : kThreadCounts) {
    const Arena arena(num_threads);
    for (const int64_t num_tasks : {0, 1, 2, 1000}) {
      std::vector<std::atomic<int>> count(num_tasks);
      arena.Run(num_tasks, [&](int64_t k) { ++count[k]; });
      for (const std::atomic<int>& c : count) EXPECT_EQ(c, 1);
    }
  }
}

TEST(Arena, CutsChunksOfTheSameSizeAtAnyThreadCount) {
  for (const int num_threads : kThreadCounts) {
    const Arena arena(num_threads);
    std::vector<int64_t> begins(4, -1);
    std::vector<int64_t> ends(4, -1);
    arena.ForChunks(35, 10, [&](int64_t chunk, int64_t begin, int64_t end) {
      begins[chunk] = begin;
      ends[chunk] = end;
    });
    EXPECT_EQ(begins, (std::vector<int64_t>{0, 10, 20, 30}));
    EXPECT_EQ(ends, (std::vector<int64_t>{10, 20, 30, 35}));
  }
}

TEST(Arena, ForVisitsEachIndexOnce) {
  for (const int num_threads : kThreadCounts) {
    const Arena arena(num_threads);
    for (const int64_t count : {0, 1, 511, 512, 513, 5000}) {
      std::vector<int> visits(count, 0);
      arena.For(count, [&](int64_t i) { ++visits[i]; });
      EXPECT_EQ(visits, std::vector<int>(count, 1));
    }
  }
}

TEST(Arena, SumHasTheSameBytesAtAnyThreadCount) {
  constexpr int64_t kCount = 300000;
  // Terms of very different size: any other order of additions gives other bytes.
  const auto value = [](int64_t i) {
    return std::sin(static_cast<double>(i * i % 10007)) *
           std::pow(10.0, static_cast<double>(i % 13));
  };
  const auto expected = std::bit_cast<uint64_t>(Arena(1).Sum(kCount, value));
  double plain = 0.0;
  for (int64_t i = kCount - 1; i >= 0; --i) plain += value(i);
  EXPECT_NE(std::bit_cast<uint64_t>(plain), expected) << "the terms do not test the order";
  for (const int num_threads : kThreadCounts) {
    const Arena arena(num_threads);
    for (int round = 0; round < 10; ++round) {
      EXPECT_EQ(std::bit_cast<uint64_t>(arena.Sum(kCount, value)), expected) << num_threads;
    }
  }
}

TEST(Arena, SumOfNothingIsZero) {
  EXPECT_EQ(Arena(2).Sum(0, [](int64_t) { return 1.0; }), 0.0);
  EXPECT_EQ(Arena(2).Sum(10000, [](int64_t) { return 1.0; }), 10000.0);
}

TEST(Arena, RunsWorkInsideOfWork) {
  const Arena arena(2);
  std::vector<double> sums(50);
  arena.For(
      50, [&](int64_t i) { sums[i] = arena.Sum(i, [](int64_t j) { return double(j); }); }, 1);
  for (int i = 0; i < 50; ++i) EXPECT_EQ(sums[i], i * (i - 1) / 2);
}

TEST(Arena, ServesSeveralCallersAtATime) {
  const Arena arena(2);
  std::vector<double> sums(4);
  {
    std::vector<std::jthread> callers;
    for (double& sum : sums) {
      callers.emplace_back([&] { sum = arena.Sum(100000, [](int64_t) { return 0.5; }); });
    }
  }
  EXPECT_EQ(sums, std::vector<double>(4, 50000.0));
}

}  // namespace
}  // namespace liquidblend::parallel
