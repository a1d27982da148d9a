#include "worker/spacetime/nets/layers.h"

#include <algorithm>
#include <limits>
#include <optional>
#include <utility>

#include "absl/strings/str_cat.h"
#include "core/base/data_limit.h"
#include "core/base/memory_limit.h"
#include "core/base/status_macros.h"
#include "worker/spacetime/nets/mixed_cells.h"

namespace liquidblend::spacetime {
namespace {

constexpr int kWaveLayers = 8;       // steps sampled at a time: bounds the memory
constexpr double kGridMargin = 2.0;  // grid spacings around the liquid

// Each layer keeps a bit for each point: much, if a little liquid is far from the rest.
absl::Status CheckMemory(const mesh::Animation& animation, const Grid& grid, int64_t num_layers) {
  const int64_t bytes_per_layer = grid.num_rows() * grid.words_per_row() * int64_t{8};
  const int64_t bytes = bytes_per_layer * num_layers, left = base::DataBytesLeft();
  if (bytes <= left) return absl::OkStatus();
  return base::MemoryLimitError(absl::StrCat(
      "animation '", animation.name, "' needs a grid of ", grid.dims[0], " x ", grid.dims[1], " x ",
      grid.dims[2], " points at a spacing of ", grid.spacing_m, " m and ", num_layers,
      " times, hence ", base::FormatGibibytes(bytes), ", more than the ",
      base::FormatGibibytes(left), " that the job may still allocate: use a larger spacing"));
}

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
  grid.origin_m = lo - kGridMargin * spacing_m;
  const Eigen::Array3d dims = ((hi - lo) / spacing_m).ceil() + 2 * kGridMargin + 1;
  if (!(dims.prod() < static_cast<double>(std::numeric_limits<int32_t>::max()))) {
    return base::MemoryLimitError(absl::StrCat("animation '", animation.name, "' needs a grid of ",
                                               dims[0], " x ", dims[1], " x ", dims[2],
                                               " points at a spacing of ", spacing_m,
                                               " m, more than 2^31: use a larger spacing"));
  }
  for (int axis = 0; axis < 3; ++axis) grid.dims[axis] = static_cast<int>(dims[axis]);
  LB_RETURN_IF_ERROR(CheckMemory(animation, grid, static_cast<int64_t>(times.size())));
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

LayerSource SourceOf(const mesh::Animation& animation, const LayerTime& layer, const Grid& grid,
                     std::optional<float> sheet_motion) {
  GridSurface earlier = SurfaceAt(animation, layer.earlier, layer.time, grid);
  if (layer.earlier == layer.later) return LayerSource(grid, std::move(earlier), sheet_motion);
  return LayerSource(grid, std::move(earlier), SurfaceAt(animation, layer.later, layer.time, grid),
                     static_cast<float>(layer.share), sheet_motion);
}

// Samples slabs in waves, a few layers at a time.
class Sampler {
 public:
  Sampler(const mesh::Animation& animation, const LayerOptions& options,
          const parallel::Arena& arena, Layers& result)
      : animation_(animation), options_(options), arena_(arena), result_(result) {
    const int num_slabs = result.plan.num_slabs();
    result.inside.resize(result.plan.layers.size());
    result.slabs.resize(num_slabs);
    sources_.resize(result.plan.layers.size());
    layers_.resize(result.plan.layers.size());
    needed_.resize(num_slabs);
    steps_.resize(num_slabs);
    arena.Run(num_slabs, [&](int64_t s) {
      steps_[s] =
          PlanSteps(animation, result.plan, static_cast<int>(s), result.grid, options.max_motion_m);
    });
  }

  // The end of the wave that begins with a slab.
  int EndOfWave(int begin) const {
    const LayerPlan& plan = result_.plan;
    int end = begin + 1;
    while (end < plan.num_slabs() &&
           plan.first_layer[end + 1] - plan.first_layer[begin] <= kWaveLayers) {
      ++end;
    }
    return end;
  }

  void Sample(int begin, int end) {
    const LayerPlan& plan = result_.plan;
    // The last layer is also that of the slab after.
    const int next = std::min(end + 1, plan.num_slabs());
    const int first = plan.first_layer[begin], last = plan.first_layer[end];
    arena_.Run(plan.first_layer[next] - first + 1, [&](int64_t n) { FindSource(first + n); });
    arena_.Run(next - begin, [&](int64_t n) { FindNeeded(begin + n); });
    arena_.Run(last - first + 1, [&](int64_t n) { SampleLayer(first + n); });
    arena_.Run(end - begin, [&](int64_t n) { Place(begin + n); });
    for (int l = first; l < last; ++l) layers_[l].reset();
    for (int s = begin; s < end; ++s) needed_[s] = {};
  }

 private:
  void FindSource(int64_t l) {
    if (sources_[l] || layers_[l]) return;  // in the wave before
    std::optional<float> sheet_motion;
    if (options_.keep_thin_sheets) {
      sheet_motion = MotionAt(animation_, result_.plan, static_cast<int>(l), result_.grid);
    }
    sources_[l].emplace(SourceOf(animation_, result_.plan.layers[l], result_.grid, sheet_motion));
  }

  // The corners of all cells that the slab may have.
  void FindNeeded(int64_t s) {
    if (!needed_[s].words().empty()) return;
    std::vector<const InsideBits*> inside;
    std::vector<InsideBits> around_sheets(result_.plan.num_steps(static_cast<int>(s)) + 1);
    for (int n = 0; n <= result_.plan.num_steps(static_cast<int>(s)); ++n) {
      const LayerSource& source = *sources_[result_.plan.first_layer[s] + n];
      for (const LayerSource::View& view : source.views) inside.push_back(&view.inside);
      around_sheets[n] = source.AroundSheets(result_.grid);
      if (!around_sheets[n].words().empty()) inside.push_back(&around_sheets[n]);
    }
    needed_[s] = CornersOfMixedCells(result_.grid, inside);
  }

  void SampleLayer(int64_t l) {
    if (layers_[l]) return;
    const int slab = result_.SlabOf(static_cast<int>(l));
    PointBits needed = needed_[slab];
    if (sources_[l]->views.size() > 1) {
      const PointBits cut = steps_[slab].Grown().CutPoints(result_.grid);
      for (size_t w = 0; w < cut.words().size(); ++w) needed.words()[w] &= cut.words()[w];
    } else if (slab > 0 && l == result_.plan.first_layer[slab]) {
      const PointBits& before = needed_[slab - 1];
      for (size_t w = 0; w < before.words().size(); ++w) needed.words()[w] |= before.words()[w];
    }
    layers_[l].emplace(result_.grid, std::move(*sources_[l]), &needed);
    sources_[l].reset();
    result_.inside[l] = layers_[l]->inside();
  }

  void Place(int64_t s) {
    std::vector<const Layer*> of_slab;
    for (int l = result_.plan.first_layer[s]; l <= result_.plan.first_layer[s + 1]; ++l) {
      of_slab.push_back(&*layers_[l]);
    }
    const double seconds = (result_.end(s) - result_.begin(s)) / animation_.frames_per_second;
    result_.slabs[s] = PlaceVertices(result_.grid, of_slab, std::move(steps_[s]),
                                     static_cast<float>(seconds / result_.grid.spacing_m));
  }

  const mesh::Animation& animation_;
  const LayerOptions& options_;
  const parallel::Arena& arena_;
  Layers& result_;
  std::vector<SlabSteps> steps_;                     // per slab, until it is placed
  std::vector<PointBits> needed_;                    // per slab, for this wave and one slab more
  std::vector<std::optional<LayerSource>> sources_;  // until they are sampled
  std::vector<std::optional<Layer>> layers_;
};

}  // namespace

absl::StatusOr<Layers> SampleLayers(const mesh::Animation& animation, const LayerOptions& options,
                                    const parallel::Arena& arena,
                                    const std::function<void(double)>& progress) {
  Layers result;
  result.plan = PlanLayers(animation, options.max_motion_m);
  LB_ASSIGN_OR_RETURN(result.grid, ChooseGrid(animation, result.plan.layers, options.spacing_m));
  Sampler sampler(animation, options, arena, result);
  const int num_slabs = result.plan.num_slabs();
  for (int begin = 0; begin < num_slabs;) {
    const int end = sampler.EndOfWave(begin);
    sampler.Sample(begin, end);
    if (progress) progress(0.8 * end / num_slabs);
    begin = end;
  }
  return result;
}

}  // namespace liquidblend::spacetime
