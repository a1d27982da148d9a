// Parameter spaces for tests, and points in them.
#pragma once

#include <cmath>
#include <random>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "core/mesh/parameter_space.h"

namespace liquidblend::parameters {

using Values = std::vector<double>;

inline constexpr double kExact = 4e-9;  // weights are rounded to multiples of 2^-30

inline mesh::ParameterSpace SpaceOf(std::vector<Values> points) {
  mesh::ParameterSpace space;
  for (size_t i = 0; i < points[0].size(); ++i) space.names.push_back(absl::StrCat("p", i));
  space.points = std::move(points);
  return space;
}

// Points at all combinations of the values of each parameter; the first parameter changes fastest.
inline mesh::ParameterSpace GridOf(const std::vector<Values>& values) {
  std::vector<Values> points = {{}};
  for (const Values& axis : values) {
    std::vector<Values> more;
    for (const double value : axis) {
      for (Values point : points) {
        point.push_back(value);
        more.push_back(point);
      }
    }
    points = more;
  }
  return SpaceOf(points);
}

inline mesh::ParameterSpace RandomSpace(int num_parameters, int num_points, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> value(-3.0, 5.0);
  std::vector<Values> points(num_points, Values(num_parameters));
  for (Values& point : points) {
    for (double& x : point) x = value(random);
  }
  return SpaceOf(points);
}

// What the weights, the source's included, make of the animations' points.
inline Values BlendOf(const mesh::ParameterSpace& space, const Values& weights) {
  Values blend = space.points[0];
  for (size_t k = 0; k < weights.size(); ++k) {
    for (size_t i = 0; i < blend.size(); ++i) {
      blend[i] += weights[k] * (space.points[k + 1][i] - space.points[0][i]);
    }
  }
  return blend;
}

// A random mixture of all points: inside of their hull.
inline Values RandomMixture(const mesh::ParameterSpace& space, std::mt19937& random) {
  std::exponential_distribution<double> share;
  Values weights(space.points.size());
  double sum = 0.0;
  for (double& weight : weights) sum += weight = std::pow(share(random), 3);
  Values mixture(space.names.size(), 0.0);
  for (size_t k = 0; k < weights.size(); ++k) {
    for (size_t i = 0; i < mixture.size(); ++i) {
      mixture[i] += weights[k] / sum * space.points[k][i];
    }
  }
  return mixture;
}

}  // namespace liquidblend::parameters
