// Our slices against VTK's fastest contouring on the same cells, each one thread. VTK has them as
// tetrahedra at positions that were blended beforehand, with its scalar tree built; ours blends.
#include <benchmark/benchmark.h>
#include <vtkCellArray.h>
#include <vtkCellType.h>
#include <vtkContour3DLinearGrid.h>
#include <vtkFloatArray.h>
#include <vtkNew.h>
#include <vtkPointData.h>
#include <vtkPoints.h>
#include <vtkPolyData.h>
#include <vtkSpanSpace.h>
#include <vtkUnstructuredGrid.h>

#include <array>
#include <numeric>
#include <vector>

#include "core/blend/blend.h"
#include "core/slice/slice.h"
#include "tests/bench/warped_family.h"

namespace liquidblend {
namespace {

constexpr double kWeight = 0.5;

// All around the diagonal from corner 0 to corner 7; neighbours cut their common facet alike.
constexpr std::array<std::array<int, 4>, 6> kTetrahedra = {
    {{0, 1, 3, 7}, {0, 3, 2, 7}, {0, 2, 6, 7}, {0, 6, 4, 7}, {0, 4, 5, 7}, {0, 5, 1, 7}}};

bench::WarpedTorus TorusOf(const benchmark::State& state) {
  return {.vertices_per_frame = static_cast<int>(state.range(0))};
}

// Another time in every iteration, as in a stream.
class Times {
 public:
  explicit Times(const mesh::RegisteredFamily& family) : duration_s_(family.duration_s()) {}
  double Next() {
    share_ = share_ < 0.75 ? share_ + 0.0137 : 0.25;
    return share_ * duration_s_;
  }

 private:
  const double duration_s_;
  double share_ = 0.25;
};

void Report(benchmark::State& state, int64_t num_triangles) {
  state.counters["triangles"] =
      benchmark::Counter(static_cast<double>(num_triangles), benchmark::Counter::kAvgIterations);
}

void SliceOurs(benchmark::State& state) {
  const bench::Loaded& loaded = bench::FamilyOf(TorusOf(state));
  const std::vector<double> weights = {kWeight};
  slice::Workspace workspace;
  Times times(loaded.family);
  int64_t num_triangles = 0;
  for ([[maybe_unused]] auto _ : state) {
    if (!slice::FindCandidates(loaded.index, weights, times.Next(), workspace).ok()) {
      return state.SkipWithError("time");
    }
    num_triangles += slice::March(loaded.index, blend::Blender(loaded.family, weights), workspace)
                         .num_triangles();
  }
  Report(state, num_triangles);
}
BENCHMARK(SliceOurs)->ArgName("vertices")->Arg(50000)->Unit(benchmark::kMillisecond);

vtkNew<vtkUnstructuredGrid> TetrahedraOf(const mesh::RegisteredFamily& family) {
  std::vector<int32_t> all(family.vertices.size());
  std::iota(all.begin(), all.end(), 0);
  std::vector<mesh::Float4> placed(all.size());
  blend::Blender(family, std::vector<double>{kWeight}).Place(all, placed.data());
  vtkNew<vtkPoints> points;
  vtkNew<vtkFloatArray> times;
  points->SetNumberOfPoints(static_cast<vtkIdType>(placed.size()));
  times->SetNumberOfValues(points->GetNumberOfPoints());
  for (vtkIdType v = 0; v < points->GetNumberOfPoints(); ++v) {
    points->SetPoint(v, placed[v][0], placed[v][1], placed[v][2]);
    times->SetValue(v, placed[v][3]);
  }
  vtkNew<vtkCellArray> cells;
  const auto num_cells = static_cast<vtkIdType>(kTetrahedra.size() * family.hexahedra.size());
  cells->AllocateExact(num_cells, 4 * num_cells);
  for (const mesh::Hexahedron& hexahedron : family.hexahedra) {
    for (const auto& corners : kTetrahedra) {
      cells->InsertNextCell({hexahedron[corners[0]], hexahedron[corners[1]], hexahedron[corners[2]],
                             hexahedron[corners[3]]});
    }
  }
  vtkNew<vtkUnstructuredGrid> grid;
  grid->SetPoints(points);
  grid->SetCells(VTK_TETRA, cells);
  grid->GetPointData()->SetScalars(times);
  return grid;
}

void SliceWithVtk(benchmark::State& state) {
  const mesh::RegisteredFamily& family = bench::FamilyOf(TorusOf(state)).family;
  const vtkNew<vtkUnstructuredGrid> grid = TetrahedraOf(family);
  vtkNew<vtkContour3DLinearGrid> contour;
  vtkNew<vtkSpanSpace> tree;
  contour->SetInputData(grid);
  contour->MergePointsOn();
  contour->UseScalarTreeOn();
  contour->SetScalarTree(tree);
  contour->InterpolateAttributesOff();
  contour->SequentialProcessingOn();
  Times times(family);
  const auto slice = [&] {
    contour->SetValue(0, times.Next() * family.frames_per_second);
    contour->Update();
    return vtkPolyData::SafeDownCast(contour->GetOutput())->GetNumberOfPolys();
  };
  slice();  // builds the tree
  int64_t num_triangles = 0;
  for ([[maybe_unused]] auto _ : state) num_triangles += slice();
  Report(state, num_triangles);
}
BENCHMARK(SliceWithVtk)->ArgName("vertices")->Arg(50000)->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace liquidblend
