#include "core/slice/cluster_kernel.h"

#include <gtest/gtest.h>
#include <hwy/targets.h>

#include <algorithm>
#include <random>
#include <vector>

namespace liquidblend::slice {
namespace {

bool IsSet(const VertexBits& bits, int v) { return (bits[v / 8] >> v % 8 & 1) != 0; }

// Runs a test on every kind of machine that this one can stand in for.
class ClusterKernel : public testing::TestWithParam<int64_t> {
 protected:
  void SetUp() override { hwy::SetSupportedTargetsForTest(GetParam()); }
  void TearDown() override { hwy::SetSupportedTargetsForTest(0); }
};

std::vector<int64_t> Targets() {
  std::vector<int64_t> targets;
  for (int64_t left = hwy::SupportedTargets(); left != 0; left &= left - 1) {
    targets.push_back(left & -left);
  }
  return targets;
}

INSTANTIATE_TEST_SUITE_P(AllTargets, ClusterKernel, testing::ValuesIn(Targets()),
                         [](const auto& test) {
                           std::string name = hwy::TargetName(test.param);
                           std::replace(name.begin(), name.end(), '-', '_');
                           return name;
                         });

TEST_P(ClusterKernel, FindsTheLaterVerticesAsAddedUpOneByOne) {
  std::mt19937 random(1);
  std::uniform_real_distribution<float> number(-8.0F, 8.0F);
  for (int num_vertices = 1; num_vertices <= 128; ++num_vertices) {
    std::vector<float> times(4 * num_vertices + kKernelOverrun / sizeof(float));
    for (float& time : times) time = number(random);
    const std::vector<TimeTerm> terms = {{0.3F, 2}, {-1.7F, 3}, {0.1F, 1}};
    const float first_later = times[num_vertices / 2] + terms[0].factor * times[2 * num_vertices];
    VertexBits later;
    FindLater(times.data(), num_vertices, terms, first_later, later);
    for (int v = 0; v < 128; ++v) {
      bool expected = false;
      if (v < num_vertices) {
        volatile float sum = times[v];  // rounded after each step
        for (const TimeTerm& term : terms) {
          const volatile float product = term.factor * times[term.field * num_vertices + v];
          sum = sum + product;
        }
        expected = sum >= first_later;
      }
      ASSERT_EQ(IsSet(later, v), expected) << v << " of " << num_vertices;
    }
  }
}

TEST_P(ClusterKernel, ATimeThatIsTheSlicesIsLater) {
  std::vector<float> times(128, 3.0F);
  VertexBits later;
  FindLater(times.data(), 100, {}, 3.0F, later);
  EXPECT_TRUE(IsSet(later, 0) && IsSet(later, 99));
  FindLater(times.data(), 100, {}, std::nextafter(3.0F, 4.0F), later);
  EXPECT_EQ(later, VertexBits{});
}

TEST_P(ClusterKernel, FindsEachCellsCode) {
  std::mt19937 random(2);
  for (const int num_corners : {4, 5, 6, 8}) {
    for (int num_cells = 1; num_cells <= 64; ++num_cells) {
      VertexBits later;
      for (uint8_t& bits : later) bits = static_cast<uint8_t>(random());
      std::vector<uint8_t> corners(num_corners * num_cells + kKernelOverrun, 255);
      for (int i = 0; i < num_corners * num_cells; ++i) corners[i] = random() % 128;
      std::vector<uint8_t> codes(num_cells + kKernelOverrun);
      const uint64_t cut = FindCodes(later, corners.data(), num_corners, num_cells, codes.data());
      uint64_t expected_cut = 0;
      for (int c = 0; c < num_cells; ++c) {
        int expected = 0;
        for (int k = 0; k < num_corners; ++k) {
          expected |= static_cast<int>(IsSet(later, corners[k * num_cells + c])) << k;
        }
        ASSERT_EQ(codes[c], expected) << "cell " << c << " of " << num_cells;
        const bool is_cut = expected != 0 && expected != (1 << num_corners) - 1;
        expected_cut |= static_cast<uint64_t>(is_cut) << c;
      }
      ASSERT_EQ(cut, expected_cut) << num_cells << " cells of " << num_corners << " corners";
    }
  }
}

TEST_P(ClusterKernel, FindsTheCrossedEdges) {
  std::mt19937 random(3);
  for (int num_edges = 1; num_edges <= 256; ++num_edges) {
    VertexBits later;
    for (uint8_t& bits : later) bits = static_cast<uint8_t>(random());
    std::vector<uint8_t> low(num_edges + kKernelOverrun, 255);
    std::vector<uint8_t> high(num_edges + kKernelOverrun, 0);
    EdgeBits expected = {};
    for (int e = 0; e < num_edges; ++e) {
      low[e] = random() % 128;
      high[e] = random() % 128;
      const bool is_crossed = IsSet(later, low[e]) != IsSet(later, high[e]);
      expected[e / 64] |= static_cast<uint64_t>(is_crossed) << e % 64;
    }
    EdgeBits crossed;
    crossed.fill(~uint64_t{0});  // as an earlier cluster may have left them
    FindCrossed(later, low.data(), high.data(), num_edges, crossed);
    ASSERT_EQ(crossed, expected) << num_edges << " edges";
  }
}

}  // namespace
}  // namespace liquidblend::slice
