// Parameter space: the user's own parameters of animations, such as settings of the simulations.
#pragma once

#include <map>
#include <string>
#include <vector>

namespace liquidblend {

// How a point between the animations becomes weights.
enum class Interpolation {
  kUnspecified,  // kLinear; in a refinement, as the family has it
  kLinear,       // linearly in the Delaunay simplex around it
  kSmooth,       // by a smooth function through all animations; some weights are negative
};

// Points of a family's animations, in the user's own units; empty: not known.
struct ParameterSpace {
  std::vector<std::string> names;           // 1 to 4, e.g. "wall_width"; [a-z][a-z0-9_]{0,62}
  std::vector<std::vector<double>> points;  // the source's, then one per target; a value per name
  Interpolation interpolation = Interpolation::kUnspecified;
};

using Parameters = std::map<std::string, double>;  // a point; every name of the family has a value

}  // namespace liquidblend
