#include "core/parameters/smooth_interpolation.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace liquidblend::parameters {
namespace {

constexpr double kClose = 1e-8;

// Points in the unit cube, a column each; the first two are opposite corners of it.
Eigen::MatrixXd RandomPoints(int dimensions, int num_points, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> anywhere(0.0, 1.0);
  Eigen::MatrixXd points(dimensions, num_points);
  for (double& x : points.reshaped()) x = anywhere(random);
  points.col(0).setZero();
  points.col(1).setOnes();
  return points;
}

// Three values of each coordinate: 3, 9, 27 or 81 points.
Eigen::MatrixXd CubeOfThree(int dimensions) {
  const auto num_points = static_cast<int>(std::lround(std::pow(3, dimensions)));
  Eigen::MatrixXd points(dimensions, num_points);
  for (int k = 0; k < num_points; ++k) {
    int rest = k;
    for (int i = 0; i < dimensions; ++i, rest /= 3) points(i, k) = 0.5 * (rest % 3);
  }
  return points;
}

SmoothInterpolation MakeSmooth(const Eigen::MatrixXd& points) {
  absl::StatusOr<SmoothInterpolation> made = SmoothInterpolation::Make(points);
  EXPECT_TRUE(made.ok()) << made.status();
  return *std::move(made);
}

Eigen::VectorXd WeightsOnLine(const SmoothInterpolation& line, double x) {
  return line.WeightsAt(Eigen::VectorXd::Constant(1, x));
}

// Calls check(points, interpolation, point) for points in and around many sets of points.
template <typename Check>
void ForManyPoints(const Check& check) {
  for (int dimensions = 1; dimensions <= 4; ++dimensions) {
    for (const int num_points : {dimensions + 2, 9, 17}) {
      const Eigen::MatrixXd points = RandomPoints(dimensions, num_points, 3);
      const SmoothInterpolation smooth = MakeSmooth(points);
      std::mt19937 random(7);
      std::uniform_real_distribution<double> anywhere(-0.5, 1.5);
      for (int i = 0; i < 100; ++i) {
        Eigen::VectorXd point(dimensions);
        for (double& x : point) x = anywhere(random);
        check(points, smooth, point);
      }
    }
  }
}

TEST(SmoothInterpolation, OfThreePointsOnALineIsTheQuadraticThroughThem) {
  const SmoothInterpolation even = MakeSmooth(Eigen::RowVector3d(0, 0.5, 1));
  EXPECT_TRUE(even.is_quadratic());
  EXPECT_TRUE(WeightsOnLine(even, 0.25).isApprox(Eigen::Vector3d(3, 6, -1) / 8, kClose));
  EXPECT_TRUE(WeightsOnLine(even, 0.75).isApprox(Eigen::Vector3d(-1, 6, 3) / 8, kClose));
  EXPECT_TRUE(WeightsOnLine(even, 1.5).isApprox(Eigen::Vector3d(1, -3, 3), kClose));
  const SmoothInterpolation uneven = MakeSmooth(Eigen::RowVector3d(1, 0, 0.25));
  for (const double x : {-0.2, 0.1, 0.25, 0.6, 0.9}) {
    const Eigen::Vector3d lagrange(x * (x - 0.25) / 0.75, (x - 1) * (x - 0.25) / 0.25,
                                   x * (x - 1) / (0.25 * -0.75));
    EXPECT_TRUE(WeightsOnLine(uneven, x).isApprox(lagrange, kClose)) << x;
  }
}

TEST(SmoothInterpolation, WeightsAddUpToOneAndGiveThePointBack) {
  ForManyPoints([](const auto& points, const auto& smooth, const auto& point) {
    const Eigen::VectorXd weights = smooth.WeightsAt(point);
    EXPECT_NEAR(weights.sum(), 1.0, kClose);
    EXPECT_LT((points * weights - point).cwiseAbs().maxCoeff(), kClose);
  });
}

TEST(SmoothInterpolation, IsExactAtItsPoints) {
  for (int dimensions = 1; dimensions <= 4; ++dimensions) {
    for (const int num_points : {dimensions + 2, 9, 17}) {
      const Eigen::MatrixXd points = RandomPoints(dimensions, num_points, 5);
      const SmoothInterpolation smooth = MakeSmooth(points);
      for (int k = 0; k < num_points; ++k) {
        const Eigen::VectorXd weights = smooth.WeightsAt(points.col(k));
        EXPECT_LT((weights - Eigen::VectorXd::Unit(num_points, k)).norm(), kClose);
      }
    }
  }
}

// A quadratic of the coordinates, other for each dimension.
double QuadraticAt(const Eigen::VectorXd& point) {
  const Eigen::VectorXd slopes = Eigen::VectorXd::LinSpaced(point.size(), 1.0, 2.0);
  return 0.5 + slopes.dot(point) - point.squaredNorm() + 3.0 * point[0] * slopes.dot(point);
}

TEST(SmoothInterpolation, ReproducesQuadraticsThatThePointsDetermine) {
  for (int dimensions = 1; dimensions <= 4; ++dimensions) {
    const Eigen::MatrixXd points = CubeOfThree(dimensions);
    const SmoothInterpolation smooth = MakeSmooth(points);
    ASSERT_TRUE(smooth.is_quadratic());
    Eigen::VectorXd values(points.cols());
    for (int k = 0; k < points.cols(); ++k) values[k] = QuadraticAt(points.col(k));
    std::mt19937 random(7);
    std::uniform_real_distribution<double> anywhere(-0.5, 1.5);
    for (int i = 0; i < 50; ++i) {
      Eigen::VectorXd point(dimensions);
      for (double& x : point) x = anywhere(random);
      EXPECT_NEAR(smooth.WeightsAt(point).dot(values), QuadraticAt(point), 1e-8);
    }
  }
}

// On a circle, any multiple of its equation may be added to a quadratic.
TEST(SmoothInterpolation, LeavesQuadraticsOutThatPointsDetermineBadly) {
  std::mt19937 random(4);
  for (const double off : {0.0, 1e-3, 3e-2}) {
    std::uniform_real_distribution<double> anyhow(0.5 - off, 0.5 + off);
    Eigen::MatrixXd points(2, 6);
    for (int k = 0; k < 6; ++k) {
      const double angle = k * M_PI / 3;
      points.col(k) = Eigen::Vector2d(0.5 + anyhow(random) * std::cos(angle),
                                      0.5 + anyhow(random) * std::sin(angle));
    }
    const SmoothInterpolation smooth = MakeSmooth(points);
    EXPECT_FALSE(smooth.is_quadratic());
    EXPECT_LT(smooth.WeightsAt(Eigen::Vector2d(0.5, 0.5)).cwiseAbs().maxCoeff(), 0.5);
  }
}

// Weights of a triangulation have another slope on the other side of a point or of a diagonal.
TEST(SmoothInterpolation, HasTheSameSlopeOnBothSidesOfEachPoint) {
  ForManyPoints([](const auto& points, const auto& smooth, const auto& point) {
    constexpr double kStep = 1e-7;
    for (int k = 0; k < points.cols(); ++k) {
      const Eigen::VectorXd at = points.col(k);
      const Eigen::VectorXd step = kStep * (point - at).normalized();
      const Eigen::VectorXd before = smooth.WeightsAt(at) - smooth.WeightsAt(at - step);
      const Eigen::VectorXd after = smooth.WeightsAt(at + step) - smooth.WeightsAt(at);
      EXPECT_LT((after - before).norm() / kStep, 0.1);
    }
  });
}

TEST(SmoothInterpolation, DoesNotDependOnTheOrderOfPoints) {
  ForManyPoints([](const auto& points, const auto& smooth, const auto& point) {
    const Eigen::VectorXd weights = smooth.WeightsAt(point);
    const Eigen::MatrixXd backwards = points.rowwise().reverse();
    const Eigen::VectorXd others = MakeSmooth(backwards).WeightsAt(point);
    EXPECT_LT((others.reverse() - weights).cwiseAbs().maxCoeff(), 1e-8);
  });
}

TEST(SmoothInterpolation, RefusesTooFewPoints) {
  const auto refusal = [](const Eigen::MatrixXd& points) {
    const absl::Status status = SmoothInterpolation::Make(points).status();
    EXPECT_EQ(status.code(), absl::StatusCode::kInvalidArgument);
    return std::string(status.message());
  };
  EXPECT_EQ(refusal(Eigen::RowVector2d(0, 1)),
            "smooth interpolation of 1 parameter needs at least 3 animations, got 2");
  EXPECT_EQ(refusal(RandomPoints(3, 4, 1)),
            "smooth interpolation of 3 parameters needs at least 5 animations, got 4");
}

TEST(SmoothInterpolation, RefusesPointsForWhichNumbersAreNotExactEnough) {
  Eigen::MatrixXd points(1, 8);
  points << 0, 1e-5, 2e-5, 3e-5, 4e-5, 5e-5, 6e-5, 1;
  EXPECT_THAT(std::string(SmoothInterpolation::Make(points).status().message()),
              testing::HasSubstr("too close to one another for smooth interpolation"));
}

}  // namespace
}  // namespace liquidblend::parameters
