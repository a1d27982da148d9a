#include "worker/spacetime/layers.h"

#include <algorithm>
#include <limits>
#include <optional>
#include <utility>

#include "absl/strings/str_cat.h"
#include "core/base/status_macros.h"

namespace liquidblend::spacetime {
namespace {

constexpr int kWaveLayers = 8;   // layers sampled at a time: bounds the memory
constexpr double kMargin = 2.0;  // grid spacings around the liquid

absl::StatusOr<Grid> ChooseGrid(const mesh::Animation& animation,
                                const std::vector<LayerTime>& times, double spacing_m) {
  Eigen::Array3d lo = Eigen::Array3d::Constant(std::numeric_limits<double>::infinity());
  Eigen::Array3d hi = -lo;
  const auto include = [&](int frame, double frames) {
    if (animation.frames[frame].num_vertices() == 0) return;
    const Eigen::Matrix3Xf vertices = Advected(animation, frame, frames);
    lo = lo.min(vertices.rowwise().minCoeff().cast<double>().array());
    hi = hi.max(vertices.rowwise().maxCoeff().cast<double>().array());
  };
  for (const LayerTime& layer : times) {
    include(layer.earlier, layer.time - animation.time(layer.earlier));
    include(layer.later, layer.time - animation.time(layer.later));
  }
  if (!(lo <= hi).all()) lo = hi = 0.0;  // no liquid: an empty grid
  Grid grid;
  grid.spacing_m = spacing_m;
  grid.origin_m = lo - kMargin * spacing_m;
  const Eigen::Array3d dims = ((hi - lo) / spacing_m).ceil() + 2 * kMargin + 1;
  if (!(dims.prod() < static_cast<double>(std::numeric_limits<int32_t>::max()))) {
    return absl::ResourceExhaustedError(
        absl::StrCat("animation '", animation.name, "' needs a grid of ", dims[0], " x ", dims[1],
                     " x ", dims[2], " points at a spacing of ", spacing_m,
                     " m, more than 2^31: use a larger spacing"));
  }
  for (int axis = 0; axis < 3; ++axis) grid.dims[axis] = static_cast<int>(dims[axis]);
  return grid;
}

GridSurface SurfaceAt(const mesh::Animation& animation, int frame, double time, const Grid& grid) {
  const Eigen::Matrix3Xf vertices = Advected(animation, frame, time - animation.time(frame));
  const Eigen::Matrix3Xd points =
      (vertices.cast<double>().colwise() - grid.origin_m) / grid.spacing_m;
  return {points.cast<float>(), animation.frames[frame].triangles,
          animation.frames[frame].velocities};
}

// Spacings that one metre per second goes from layer l to the further one of its neighbours.
float MotionAt(const mesh::Animation& animation, const std::vector<LayerTime>& times, int l,
               const Grid& grid) {
  const size_t before = std::max(0, l - 1), after = std::min<size_t>(l + 1, times.size() - 1);
  const double frames =
      std::max(times[l].time - times[before].time, times[after].time - times[l].time);
  return static_cast<float>(frames / (animation.frames_per_second * grid.spacing_m));
}

Layer SampleLayer(const mesh::Animation& animation, const LayerTime& layer, const Grid& grid,
                  float motion) {
  GridSurface earlier = SurfaceAt(animation, layer.earlier, layer.time, grid);
  if (layer.earlier == layer.later) return Layer(grid, std::move(earlier), motion);
  return Layer(grid, std::move(earlier), SurfaceAt(animation, layer.later, layer.time, grid),
               static_cast<float>(layer.share), motion);
}

}  // namespace

absl::StatusOr<Layers> SampleLayers(const mesh::Animation& animation, std::vector<LayerTime> times,
                                    double spacing_m, const parallel::Arena& arena,
                                    const std::function<void(double)>& progress) {
  Layers result;
  LB_ASSIGN_OR_RETURN(result.grid, ChooseGrid(animation, times, spacing_m));
  const Grid& grid = result.grid;
  const int num_layers = static_cast<int>(times.size());
  result.times = std::move(times);
  result.inside.resize(num_layers);
  result.slabs.resize(num_layers - 1);
  std::vector<std::optional<Layer>> wave(kWaveLayers + 1);  // [0]: the last one of the wave before
  for (int begin = 0; begin < num_layers; begin += kWaveLayers) {
    const int count = std::min(kWaveLayers, num_layers - begin);
    arena.Run(count, [&](int64_t n) {
      const int l = begin + static_cast<int>(n);
      wave[n + 1].emplace(SampleLayer(animation, result.times[l], grid,
                                      MotionAt(animation, result.times, l, grid)));
      result.inside[l] = wave[n + 1]->inside();
    });
    arena.Run(count, [&](int64_t n) {
      const int l = begin + static_cast<int>(n);
      if (l > 0) result.slabs[l - 1] = PlaceVertices(grid, *wave[n], *wave[n + 1]);
    });
    wave[0] = std::move(wave[count]);
    if (progress) progress(0.8 * (begin + count) / num_layers);
  }
  return result;
}

}  // namespace liquidblend::spacetime
