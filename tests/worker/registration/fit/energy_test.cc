#include "worker/registration/fit/energy.h"

#include <gtest/gtest.h>

#include <cstring>

#include "tests/worker/registration/registration_testing.h"
#include "worker/registration/fit/hard_pins.h"

namespace liquidblend::registration {
namespace {

class MinimizeTest : public ::testing::Test {
 protected:
  // Terms that ask for a smooth warp, with metrics of all directions.
  std::vector<FitTerm> WarpTerms() const {
    std::vector<FitTerm> terms;
    for (int32_t v = 0; v < sphere_.surface.points.cols(); v += 7) {
      const Eigen::Vector4f p = sphere_.surface.points.col(v);
      const Eigen::Vector4f goal(std::sin(0.2f * p.y()), 0.3f * p.x(), 1.0f, 0.1f * p.z());
      const Eigen::Vector4f n = sphere_.mesh.normals.col(v);
      terms.push_back({v, goal, 0.1f * Eigen::Matrix4f::Identity() + n * n.transpose()});
    }
    return terms;
  }
  std::vector<NodeMap> Solve(const std::vector<FitTerm>& terms, const SolverOptions& options,
                             int num_threads, SolveReport* report = nullptr) const {
    std::vector<NodeMap> maps(nodes_.num_nodes(), NodeMap::Zero());
    const auto solved = Minimize(nodes_, graph_, sphere_.surface.points, terms, HardPins(), options,
                                 parallel::Arena(num_threads), maps);
    EXPECT_TRUE(solved.ok()) << solved.status();
    if (report != nullptr) *report = *solved;
    return maps;
  }
  static SolverOptions Iterative() {
    SolverOptions options;
    options.smoothness = 0.5;
    options.max_direct_rows = 0;
    options.tolerance = 1e-6;
    options.max_steps = 2000;
    return options;
  }
  static SolverOptions Direct() {
    SolverOptions options = Iterative();
    options.max_direct_rows = 1 << 20;
    return options;
  }

  TestSurface sphere_{SphereMesh()};
  DeformationNodes nodes_{sphere_.surface.points, sphere_.neighbors, 4.0, {}, 1,
                          parallel::Arena(2)};
  NodeGraph graph_{nodes_};
};

TEST_F(MinimizeTest, ConjugateGradientsAndCholeskyAgree) {
  SolveReport iterative_report, direct_report;
  const auto iterative = Solve(WarpTerms(), Iterative(), 2, &iterative_report);
  const auto direct = Solve(WarpTerms(), Direct(), 2, &direct_report);
  EXPECT_GT(iterative_report.num_steps, 3);
  EXPECT_EQ(direct_report.num_steps, 0);
  for (size_t n = 0; n < direct.size(); ++n) {
    EXPECT_NEAR((iterative[n] - direct[n]).norm(), 0, 2e-3f) << "node " << n;
  }
  EXPECT_NEAR(iterative_report.fit_energy, direct_report.fit_energy,
              1e-3 * direct_report.fit_energy + 1e-6);
}

TEST_F(MinimizeTest, NoNearbyStateHasLessEnergy) {
  const auto terms = WarpTerms();
  SolverOptions options = Direct();
  SolveReport best;
  const auto maps = Solve(terms, options, 1, &best);
  const double smallest = best.fit_energy + options.smoothness * best.smoothness_energy;
  // A state is measured by restarting conjugate gradients there without a single step.
  SolverOptions measure = Iterative();
  measure.max_steps = 0;
  for (int n = 0; n < static_cast<int>(maps.size()); n += 3) {
    for (const float step : {-0.05f, 0.05f}) {
      auto moved = maps;
      moved[n](n % 4, n % 5) += step;
      const auto energy = Minimize(nodes_, graph_, sphere_.surface.points, terms, HardPins(),
                                   measure, parallel::Arena(1), moved);
      ASSERT_TRUE(energy.ok());
      EXPECT_GT(energy->fit_energy + options.smoothness * energy->smoothness_energy,
                smallest - 1e-6);
    }
  }
}

TEST_F(MinimizeTest, ATranslationCostsNothing) {
  std::vector<FitTerm> terms;
  const Eigen::Vector4f shift(3, -2, 1, 0.5f);
  for (int32_t v = 0; v < sphere_.surface.points.cols(); v += 5) {
    terms.push_back({v, shift, Eigen::Matrix4f::Identity()});
  }
  SolverOptions options = Iterative();
  options.smoothness = 500;
  SolveReport report;
  const auto maps = Solve(terms, options, 2, &report);
  EXPECT_NEAR(report.fit_energy, 0, 1e-3);
  const Points deformed = Deform(nodes_, maps, sphere_.surface.points, parallel::Arena(1));
  EXPECT_NEAR((deformed.col(11) - sphere_.surface.points.col(11) - shift).norm(), 0, 1e-2f);
}

TEST_F(MinimizeTest, SameBytesAtAnyThreadCount) {
  const auto one = Solve(WarpTerms(), Iterative(), 1);
  for (const int num_threads : {2, 8}) {
    const auto many = Solve(WarpTerms(), Iterative(), num_threads);
    EXPECT_EQ(std::memcmp(one.data(), many.data(), one.size() * sizeof(NodeMap)), 0);
  }
}

TEST_F(MinimizeTest, WithoutTermsNothingMoves) {
  for (const NodeMap& map : Solve({}, Iterative(), 1)) EXPECT_EQ(map.norm(), 0.0f);
}

// A speck of a few nodes, with terms at hardly any of its vertices: what holds their maps is some
// 1e9 times weaker in some directions than in others.
TEST(Minimize, SolvesWhatHoldsANodeWeaklyAsTheDirectSolverDoes) {
  const TestSurface source(BuildMesh(BlockAndDroplet(1.0f)));
  const Points& rest = source.surface.points;
  const DeformationNodes nodes(rest, source.neighbors, 5.0, {}, 1, parallel::Arena(2));
  const NodeGraph graph(nodes);
  const float beside = 1.2f / static_cast<float>(source.mesh.edge_length_m);
  std::vector<FitTerm> terms;
  int num_of_speck = 0;
  for (int32_t v = 0; v < rest.cols(); v += 5) {
    const bool is_of_speck = rest(1, v) > beside;
    if (is_of_speck && ++num_of_speck > 2) continue;
    const Eigen::Vector4f goal(0.2f * rest(2, v), 1, std::sin(0.2f * rest(0, v)), 0);
    const Eigen::Vector4f n = source.mesh.normals.col(v);
    terms.push_back({v, goal, 0.1f * Eigen::Matrix4f::Identity() + n * n.transpose()});
  }
  ASSERT_EQ(std::min(num_of_speck, 3), 3);
  const auto solve = [&](int max_direct_rows) {
    const SolverOptions options = {.smoothness = 500,
                                   .damping = 1e-6,
                                   .tolerance = 1e-6,
                                   .max_steps = 4000,
                                   .max_direct_rows = max_direct_rows};
    std::vector<NodeMap> maps(nodes.num_nodes(), NodeMap::Zero());
    const auto solved =
        Minimize(nodes, graph, rest, terms, HardPins(), options, parallel::Arena(2), maps);
    EXPECT_TRUE(solved.ok()) << solved.status();
    return solved->fit_energy + options.smoothness * solved->smoothness_energy;
  };
  const double least = solve(1 << 20);
  EXPECT_GT(least, 0.1);
  EXPECT_NEAR(solve(0), least, 1e-4 * least);
}

}  // namespace
}  // namespace liquidblend::registration
