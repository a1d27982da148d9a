#include "worker/spacetime/layers.h"

#include <algorithm>
#include <limits>
#include <optional>
#include <utility>

#include "absl/strings/str_cat.h"
#include "core/base/status_macros.h"

namespace liquidblend::spacetime {
namespace {

constexpr int kWaveLayers = 8;   // steps sampled at a time: bounds the memory
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

// Spacings that one metre per second goes from layer l to the furthest layer that a cell may join
// it with.
float MotionAt(const mesh::Animation& animation, const LayerPlan& plan, int l, const Grid& grid) {
  const auto& layers = plan.layers;
  const bool is_between = layers[l].earlier != layers[l].later;
  const int last = static_cast<int>(layers.size()) - 1;
  int before = std::max(0, l - 1), after = std::min(l + 1, last);
  while (!is_between && layers[before].earlier != layers[before].later) --before;
  while (!is_between && layers[after].earlier != layers[after].later) ++after;
  const double frames =
      std::max(layers[l].time - layers[before].time, layers[after].time - layers[l].time);
  return static_cast<float>(frames / (animation.frames_per_second * grid.spacing_m));
}

// In between two frames, only where `wanted` is cut.
Layer SampleLayer(const mesh::Animation& animation, const LayerTime& layer, const SlabSteps& wanted,
                  const Grid& grid, std::optional<float> sheet_motion) {
  GridSurface earlier = SurfaceAt(animation, layer.earlier, layer.time, grid);
  if (layer.earlier == layer.later) return Layer(grid, std::move(earlier), sheet_motion);
  return Layer(grid, std::move(earlier), SurfaceAt(animation, layer.later, layer.time, grid),
               static_cast<float>(layer.share), wanted, sheet_motion);
}

}  // namespace

absl::StatusOr<Layers> SampleLayers(const mesh::Animation& animation, const LayerOptions& options,
                                    const parallel::Arena& arena,
                                    const std::function<void(double)>& progress) {
  Layers result;
  result.plan = PlanLayers(animation, options.max_motion_m);
  const LayerPlan& plan = result.plan;
  LB_ASSIGN_OR_RETURN(result.grid, ChooseGrid(animation, plan.layers, options.spacing_m));
  const Grid& grid = result.grid;
  const int num_slabs = plan.num_slabs();
  result.inside.resize(plan.layers.size());
  result.slabs.resize(num_slabs);
  std::vector<SlabSteps> steps(num_slabs), around_steps(num_slabs);
  arena.Run(num_slabs, [&](int64_t s) {
    steps[s] = PlanSteps(animation, plan, static_cast<int>(s), grid, options.max_motion_m);
    around_steps[s] = steps[s].Grown();
  });
  std::vector<std::optional<Layer>> layers(plan.layers.size());
  for (int begin = 0; begin < num_slabs;) {
    int end = begin + 1;
    while (end < num_slabs && plan.first_layer[end + 1] - plan.first_layer[begin] <= kWaveLayers) {
      ++end;
    }
    const int first = plan.first_layer[begin], last = plan.first_layer[end];
    arena.Run(last - first + 1, [&](int64_t n) {
      const int64_t l = first + n;
      if (layers[l]) return;  // the last one of the wave before
      const int slab = result.SlabOf(static_cast<int>(l));
      std::optional<float> sheet_motion;
      if (options.keep_thin_sheets) {
        sheet_motion = MotionAt(animation, plan, static_cast<int>(l), grid);
      }
      layers[l].emplace(
          SampleLayer(animation, plan.layers[l], around_steps[slab], grid, sheet_motion));
      result.inside[l] = layers[l]->inside();
    });
    arena.Run(end - begin, [&](int64_t n) {
      const int64_t s = begin + n;
      std::vector<const Layer*> of_slab;
      for (int l = plan.first_layer[s]; l <= plan.first_layer[s + 1]; ++l) {
        of_slab.push_back(&*layers[l]);
      }
      result.slabs[s] =
          PlaceVertices(grid, of_slab, std::move(steps[s]),
                        static_cast<float>((result.end(s) - result.begin(s)) /
                                           (animation.frames_per_second * grid.spacing_m)));
    });
    for (int l = first; l < last; ++l) layers[l].reset();
    if (progress) progress(0.8 * end / num_slabs);
    begin = end;
  }
  return result;
}

}  // namespace liquidblend::spacetime
