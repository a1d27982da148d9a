#include "worker/spacetime/field/near_triangle.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <functional>
#include <random>
#include <utility>
#include <vector>

namespace liquidblend::spacetime {
namespace {

using Corners = Eigen::Matrix3d;

// Of the rounding in single precision, of lengths of up to some 10 spacings.
constexpr double kRounding = 1e-4;

Eigen::Vector3d FromSegment(const Eigen::Vector3d& p, const Eigen::Vector3d& a,
                            const Eigen::Vector3d& b) {
  const Eigen::Vector3d ab = b - a;
  const double length_sq = ab.squaredNorm();
  const double along = length_sq > 0 ? std::clamp(ab.dot(p - a) / length_sq, 0.0, 1.0) : 0.0;
  return p - (a + along * ab);
}

// From the closest point of the triangle to p, read off the definition: that of the three sides
// which is nearest, or the foot of the perpendicular where that is on the inner side of all three.
Eigen::Vector3d PlainOffset(const Eigen::Vector3d& p, const Corners& corners) {
  Eigen::Vector3d nearest = FromSegment(p, corners.col(0), corners.col(1));
  for (const auto& [a, b] : {std::pair(1, 2), std::pair(2, 0)}) {
    const Eigen::Vector3d offset = FromSegment(p, corners.col(a), corners.col(b));
    if (offset.squaredNorm() < nearest.squaredNorm()) nearest = offset;
  }
  const Eigen::Vector3d ab = corners.col(1) - corners.col(0), ac = corners.col(2) - corners.col(0);
  const Eigen::Vector3d normal = ab.cross(ac);
  if (normal.norm() < 1e-9) return nearest;
  for (int c = 0; c < 3; ++c) {
    const Eigen::Vector3d side = corners.col((c + 1) % 3) - corners.col(c);
    if (side.cross(p - corners.col(c)).dot(normal) < 0) return nearest;
  }
  return normal * (normal.dot(p - corners.col(0)) / normal.squaredNorm());
}

// Where two points of the triangle are as near, either will do: so lengths are compared, and that
// the offset leads to a point of the triangle.
void ExpectOffsetsOf(const Corners& corners, const Eigen::Vector3f& first) {
  const FourOffsets found =
      NearTriangle(corners.cast<float>()).OffsetsOfRow(first.x(), first.y(), first.z());
  for (int n = 0; n < 4; ++n) {
    const Eigen::Vector3d p = first.cast<double>() + Eigen::Vector3d(n, 0, 0);
    const Eigen::Vector3d offset(found.x[n], found.y[n], found.z[n]);
    const double expected = PlainOffset(p, corners).norm();
    const auto where = [&] {
      return testing::Message() << "point " << p.transpose() << ", triangle\n" << corners;
    };
    ASSERT_NEAR(offset.norm(), expected, kRounding) << where();
    ASSERT_NEAR(PlainOffset(p - offset, corners).norm(), 0, kRounding) << where();
    ASSERT_NEAR(found.length_sq[n], offset.squaredNorm(), kRounding * (1 + offset.norm()))
        << where();
  }
}

class NearTriangleTest : public testing::Test {
 protected:
  Eigen::Vector3d RandomPoint(double from, double to) {
    std::uniform_real_distribution<double> at(from, to);
    const double x = at(random_), y = at(random_), z = at(random_);
    // Of single precision, so that the reference sees the same point.
    return Eigen::Vector3f(Eigen::Vector3d(x, y, z).cast<float>()).cast<double>();
  }

  // Of triangles whose corners are `corners_of` of three random points; rows begin around them.
  void ExpectOffsets(const std::function<Corners(const Corners&)>& corners_of) {
    for (int k = 0; k < 20'000; ++k) {
      Corners corners;
      for (int c = 0; c < 3; ++c) corners.col(c) = RandomPoint(2, 5);
      const Eigen::Vector3f first = RandomPoint(0, 6).cast<float>();
      ExpectOffsetsOf(corners_of(corners).cast<float>().cast<double>(), first);
      if (HasFatalFailure()) return;
    }
  }

  std::mt19937 random_{1};
};

TEST_F(NearTriangleTest, IsAsFarFromRandomPointsAsThePlainReferenceSays) {
  ExpectOffsets([](const Corners& corners) { return corners; });
}

TEST_F(NearTriangleTest, OffsetsAreFromThePlaneWherePointsAreAboveTheTriangle) {
  Corners corners;
  corners << 0, 4, 0, 0, 0, 4, 1, 1, 1;
  const FourOffsets found = NearTriangle(corners.cast<float>()).OffsetsOfRow(0.5f, 0.25f, 3);
  for (int n = 0; n < 4; ++n) {
    EXPECT_NEAR(found.x[n], 0, 1e-6) << n;
    EXPECT_NEAR(found.y[n], 0, 1e-6) << n;
    EXPECT_NEAR(found.z[n], 2, 1e-6) << n;
    EXPECT_NEAR(found.length_sq[n], 4, 1e-5) << n;
  }
}

TEST_F(NearTriangleTest, PointsOfTheTriangleAreAtDistanceZero) {
  for (int k = 0; k < 1000; ++k) {
    Corners corners;
    for (int c = 0; c < 3; ++c) corners.col(c) = RandomPoint(2, 5);
    Eigen::Vector3d weights = RandomPoint(0, 1);
    weights /= weights.sum();
    const Eigen::Vector3f p = (corners * weights).cast<float>();
    const FourOffsets found = NearTriangle(corners.cast<float>()).OffsetsOfRow(p.x(), p.y(), p.z());
    ASSERT_NEAR(found.length_sq[0], 0, kRounding * kRounding) << corners;
  }
}

TEST_F(NearTriangleTest, ATriangleWithoutAreaIsItsLongestSide) {
  ExpectOffsets([](const Corners& corners) {
    Corners flat = corners;
    flat.col(2) = 0.75 * corners.col(0) + 0.25 * corners.col(1);
    return flat;
  });
  ExpectOffsets([](const Corners& corners) {
    Corners flat = corners;
    flat.col(0) = 1.5 * corners.col(1) - 0.5 * corners.col(2);
    return flat;
  });
}

TEST_F(NearTriangleTest, ATriangleOfTwoEqualCornersIsASegmentWhicheverTheyAre) {
  for (int c = 0; c < 3; ++c) {
    ExpectOffsets([c](const Corners& corners) {
      Corners segment = corners;
      segment.col((c + 1) % 3) = corners.col(c);
      return segment;
    });
  }
}

TEST_F(NearTriangleTest, ATriangleOfOnePointIsThatPoint) {
  ExpectOffsets([](const Corners& corners) { return Corners(corners.col(0).replicate<1, 3>()); });
}

TEST_F(NearTriangleTest, NeedlesAndSpecksAreNoFurtherThanTheyAre) {
  ExpectOffsets([](const Corners& corners) {
    Corners needle = corners;
    needle.col(2) = 0.5 * (corners.col(0) + corners.col(1)) + 1e-3 * corners.col(2);
    return needle;
  });
  ExpectOffsets([](const Corners& corners) {
    Corners speck = corners;
    for (int c = 1; c < 3; ++c) {
      speck.col(c) = corners.col(0) + 1e-3 * (corners.col(c) - corners.col(0));
    }
    return speck;
  });
}

// As the grid's points are where a surface is made of planes along it.
TEST_F(NearTriangleTest, CornersOnGridPointsAndPointsInTheTrianglesPlane) {
  ExpectOffsets([](const Corners& corners) { return Corners(corners.array().round()); });
  for (int k = 0; k < 1000; ++k) {
    Corners corners;
    for (int c = 0; c < 3; ++c) corners.col(c) = RandomPoint(0, 6).array().round();
    const Eigen::Vector3d first = RandomPoint(0, 6).array().round();
    ExpectOffsetsOf(corners, first.cast<float>());
    if (HasFatalFailure()) return;
  }
}

}  // namespace
}  // namespace liquidblend::spacetime
