// Small random clips of liquid, synthetic and cut from a simulation, for tests of robustness.
#pragma once

#include <cstdint>
#include <random>
#include <string>
#include <vector>

#include "core/mesh/animation.h"

namespace liquidblend::registration {

// Two to six frames of some hundred triangles: spheres, tori, bubbles, drops over pools and cuts of
// two_drops, decimated and cropped; some with parts or all of the liquid missing in some frames,
// moved, turned and scaled by up to a thousand. The same clip for the same seed on any platform.
// Errors (as a failed EXPECT): the simulation in tests/data cannot be read.
mesh::Animation RandomClip(uint64_t seed);

// One surface for `num_frames` frames.
mesh::Animation Still(const mesh::TriangleMesh& surface, int num_frames);

// All positions times `scale`, velocities too.
mesh::Animation Scaled(mesh::Animation animation, double scale);

// Frames [first, first + count) of tests/data/two_drops/NAME, cut along a box of the given half
// size around a point and polygonized with the spacing given; metres.
mesh::Animation Cutout(const std::string& name, int first, int count,
                       const Eigen::Vector3f& centre_m, float half_size_m, double spacing_m);

}  // namespace liquidblend::registration
