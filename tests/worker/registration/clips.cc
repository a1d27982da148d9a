#include "tests/worker/registration/clips.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>

#include "tests/paths.h"
#include "tests/synthetic/implicit.h"
#include "tests/synthetic/shapes.h"
#include "tests/synthetic/surface_distance.h"
#include "worker/ingest/read_animation.h"
#include "worker/ingest/read_directory.h"
#include "worker/registration/surface/axis_rays.h"

namespace liquidblend::registration {
namespace {

// Numbers that are the same on any platform, which those of std's distributions are not.
class Dice {
 public:
  explicit Dice(uint64_t seed) : engine_(seed) {}
  int Below(int bound) { return static_cast<int>(engine_() % static_cast<uint64_t>(bound)); }
  double Between(double low, double high) {
    return low + (high - low) * static_cast<double>(engine_() >> 11) * 0x1p-53;
  }
  bool OneIn(int count) { return Below(count) == 0; }

 private:
  std::mt19937_64 engine_;
};

Eigen::Vector3f Point(Dice& dice, double size) {
  const double x = dice.Between(-size, size), y = dice.Between(-size, size);
  return Eigen::Vector3d(x, y, dice.Between(-size, size)).cast<float>();
}

const std::vector<ingest::LoadedFile>& Files(const std::string& name) {
  static std::map<std::string, std::vector<ingest::LoadedFile>> loaded;
  auto& files = loaded[name];
  if (files.empty()) {
    auto read = ingest::LoadDirectory(paths::Source("tests/data/two_drops/" + name));
    EXPECT_TRUE(read.ok()) << read.status();
    if (read.ok()) files = *std::move(read);
  }
  return files;
}

// The frames as they were simulated; numbers in the files' names count from 1.
mesh::Animation Frames(const std::string& name, int first, int count) {
  std::vector<ingest::InputFile> chosen;
  for (const ingest::InputFile& file : ingest::Views(Files(name))) {
    const size_t digits = file.name.find_first_of("0123456789");
    const int number = digits == std::string::npos ? 0 : std::atoi(file.name.c_str() + digits);
    const bool is_frame = number > first && number <= first + count;
    if (file.name == "meta.json" || is_frame) chosen.push_back(file);
  }
  const auto animation = ingest::ReadAnimation(name, chosen, {}, parallel::Arena(1));
  EXPECT_TRUE(animation.ok()) << animation.status();
  return animation.ok() ? *animation : mesh::Animation();
}

mesh::TriangleMesh Cut(const mesh::TriangleMesh& frame, const synthetic::GridBox& box) {
  RayGrid grid;
  grid.axis = 2;
  grid.first_m = box.min_m.head<2>().cast<double>();
  grid.spacing_m = box.spacing_m;
  grid.counts.fill(2 + static_cast<int>((box.max_m - box.min_m).maxCoeff() / box.spacing_m));
  const AxisRays rays(frame, grid);
  const synthetic::SurfaceDistance distance(frame);
  return synthetic::Polygonize(
      [&](const Eigen::Vector3d& p) {
        const Eigen::Vector2d at = (p.head<2>() - grid.first_m) / grid.spacing_m;
        const int winding = rays.Winding(static_cast<int>(std::lround(at.x())),
                                         static_cast<int>(std::lround(at.y())), p.z());
        const double metres = distance.Distance(p.cast<float>());
        return winding > 0 ? -metres : metres;
      },
      box);
}

mesh::Animation RandomSpheres(Dice& dice, int num_frames) {
  synthetic::MovingSphereOptions options;
  options.num_frames = num_frames;
  options.subdivisions = 1 + dice.Below(2);
  options.velocity_m_per_s = Point(dice, 5.0);
  options.growth_m_per_s = dice.Between(-0.5, 2.0);
  return synthetic::MovingSphere(options);
}

mesh::Animation RandomDrop(Dice& dice, int num_frames) {
  synthetic::FallingDropOptions options;
  options.num_frames = num_frames;
  options.spacing_m = dice.Between(0.14, 0.2);
  options.drop_m.z() = static_cast<float>(dice.Between(-0.2, 0.8));
  options.drop_radius_m = dice.Between(0.15, 0.35);
  options.drop_velocity_m_per_s = dice.Between(-6.0, 0.0);
  return synthetic::FallingDrop(options);
}

mesh::Animation RandomShape(Dice& dice, int num_frames) {
  switch (dice.Below(4)) {
    case 0:
      return Still(synthetic::Torus({0, 0, 0}, 0.6, dice.Between(0.05, 0.3), 16, 8), num_frames);
    case 1:
      return Still(synthetic::BallWithBubble({0, 0, 0}, 0.8, 0.4, 2), num_frames);
    case 2:
      return Still(synthetic::Box({-1, -1, -0.3f}, {1, 1, 0}, 8), num_frames);
    default:  // a tetrahedron nearly
      return Still(synthetic::Icosphere({0, 0, 0}, 0.5, 0), num_frames);
  }
}

mesh::Animation RandomCutout(Dice& dice, int num_frames) {
  const std::string name = std::vector<std::string>{"A", "B", "MID"}[dice.Below(3)];
  const int first = dice.Below(72 - num_frames);
  const Eigen::Vector3f centre(static_cast<float>(dice.Between(-1.2, 1.2)),
                               static_cast<float>(dice.Between(-0.4, 0.4)),
                               static_cast<float>(dice.Between(-1.0, 0.2)));
  return Cutout(name, first, num_frames, centre, 0.9f, dice.Between(0.15, 0.22));
}

// A ball that is there in some frames only.
void AddIsland(Dice& dice, mesh::Animation& animation) {
  const Eigen::Vector3f place = Point(dice, 1.0) + Eigen::Vector3f(0, 0, 2);
  const double radius_m = dice.Between(0.05, 0.3);
  for (mesh::TriangleMesh& frame : animation.frames) {
    if (dice.OneIn(2)) continue;
    const mesh::TriangleMesh parts[] = {frame, synthetic::Icosphere(place, radius_m, 1)};
    frame = synthetic::Join(parts);
  }
}

void Move(Dice& dice, mesh::Animation& animation) {
  const Eigen::Matrix3f turn =
      Eigen::AngleAxisf(static_cast<float>(dice.Between(0.0, 2 * std::numbers::pi)),
                        (Point(dice, 1.0) + Eigen::Vector3f(0, 0, 2)).normalized())
          .toRotationMatrix();
  const Eigen::Vector3f shift = Point(dice, dice.OneIn(4) ? 50.0 : 0.5);
  const bool turns = dice.OneIn(3);
  for (mesh::TriangleMesh& frame : animation.frames) {
    if (turns) {
      frame.vertices = (turn * frame.vertices).eval();
      if (frame.velocities.cols() > 0) frame.velocities = (turn * frame.velocities).eval();
    }
    frame.vertices.colwise() += shift;
  }
}

}  // namespace

mesh::Animation RandomClip(uint64_t seed) {
  Dice dice(seed);
  const int num_frames = 2 + dice.Below(5);
  mesh::Animation clip;
  switch (dice.Below(5)) {
    case 0:
      clip = RandomSpheres(dice, num_frames);
      break;
    case 1:
      clip = RandomShape(dice, num_frames);
      break;
    case 2:
      clip = RandomDrop(dice, num_frames);
      break;
    default:
      clip = RandomCutout(dice, num_frames);
  }
  clip.name = "clip " + std::to_string(seed);
  if (dice.OneIn(4)) AddIsland(dice, clip);
  if (dice.OneIn(8)) clip.frames[dice.Below(num_frames)] = {};
  if (dice.OneIn(2)) Move(dice, clip);
  return dice.OneIn(6) ? Scaled(clip, std::pow(10.0, dice.Between(-3.0, 3.0))) : clip;
}

mesh::Animation Still(const mesh::TriangleMesh& surface, int num_frames) {
  mesh::Animation animation;
  animation.frames.assign(num_frames, surface);
  return animation;
}

mesh::Animation Scaled(mesh::Animation animation, double scale) {
  for (mesh::TriangleMesh& frame : animation.frames) {
    frame.vertices *= static_cast<float>(scale);
    frame.velocities *= static_cast<float>(scale);
  }
  return animation;
}

mesh::Animation Cutout(const std::string& name, int first, int count,
                       const Eigen::Vector3f& centre_m, float half_size_m, double spacing_m) {
  mesh::Animation animation = Frames(name, first, count);
  const Eigen::Vector3f half = Eigen::Vector3f::Constant(half_size_m);
  for (mesh::TriangleMesh& frame : animation.frames) {
    frame = Cut(frame, {centre_m - half, centre_m + half, spacing_m});
  }
  return animation;
}

}  // namespace liquidblend::registration
