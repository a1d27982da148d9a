// Slices of a real simulation, written by us and by libdraco.
#include <gtest/gtest.h>

#include <cstdio>
#include <string>

#include "core/parallel/arena.h"
#include "core/slice/slice.h"
#include "server/encode/draco.h"
#include "server/encode/libdraco.h"
#include "tests/paths.h"
#include "tests/server/encode/encode_testing.h"
#include "tests/synthetic/slice_family.h"
#include "worker/ingest/read_animation.h"
#include "worker/ingest/read_directory.h"
#include "worker/spacetime/build.h"

namespace liquidblend::encode {
namespace {

TEST(TwoDrops, SlicesAreLibdracosByteForByte) {
  const parallel::Arena arena;
  const auto files = ingest::LoadDirectory(paths::Source("tests/data/two_drops/A"));
  ASSERT_TRUE(files.ok()) << files.status();
  const auto animation = ingest::ReadAnimation("A", ingest::Views(*files), {}, arena);
  ASSERT_TRUE(animation.ok()) << animation.status();
  const auto built = spacetime::Build(*animation, {}, arena);
  ASSERT_TRUE(built.ok()) << built.status();
  const mesh::RegisteredFamily family = mesh::ViewOf(*built);
  const slice::CellIndex index(family);
  slice::Workspace workspace;
  SurfaceWriter writer;
  DracoOptions options;
  options.grid = frames::GridOf(family);
  int num_non_manifold = 0;
  std::array<double, 3> bytes = {0, 0, 0};
  double num_triangles = 0;
  for (double frame = 0.5; frame < family.num_frames - 1; frame += 3.25) {
    const mesh::TriangleMesh surface =
        synthetic::SliceFamily(index, {}, frame / family.frames_per_second, workspace);
    const bool is_non_manifold = mesh::CheckClosed(surface).num_non_manifold_edges > 0;
    num_non_manifold += is_non_manifold ? 1 : 0;
    num_triangles += static_cast<double>(surface.num_triangles());
    for (const Preset preset : {Preset::kFastest, Preset::kBalanced, Preset::kSmallest}) {
      options.preset = preset;
      const auto data = EncodeDraco(surface, options, writer);
      ASSERT_TRUE(data.ok()) << data.status();
      bytes[static_cast<int>(preset)] += static_cast<double>(data->size());
      const auto judge = EncodeWithLibdraco(surface, options);
      ASSERT_TRUE(judge.ok()) << judge.status();
      ASSERT_TRUE(NodesOf(Decode(*data), options) == NodesOf(Decode(*judge), options)) << frame;
      if (!is_non_manifold) {
        EXPECT_TRUE(*data == *judge) << frame;
      }
    }
  }
  std::printf("bytes per triangle: fastest %.3f, balanced %.3f, smallest %.3f; %d non-manifold\n",
              bytes[0] / num_triangles, bytes[1] / num_triangles, bytes[2] / num_triangles,
              num_non_manifold);
  EXPECT_LT(bytes[1], bytes[0]);
  EXPECT_LT(bytes[2], bytes[1]);
}

}  // namespace
}  // namespace liquidblend::encode
