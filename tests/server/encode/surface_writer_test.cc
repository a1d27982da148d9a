#include "server/encode/surface_writer.h"

#include <gtest/gtest.h>

#include "server/encode/draco.h"
#include "server/encode/libdraco.h"
#include "tests/synthetic/shapes.h"

namespace liquidblend::encode {
namespace {

TEST(SurfaceWriter, Quick) {
  for (Preset preset : {Preset::kFastest, Preset::kBalanced}) {
    for (int bits : {8, 12, 14, 20}) {
      for (int s = 0; s < 6; ++s) {
        DracoOptions options;
        options.preset = preset;
        options.position_bits = bits;
        options.grid.origin = {-2, -2, -2};
        options.grid.extent_m = 4;
        auto mesh = synthetic::Icosphere({0, 0, 0}, 1.0, s);
        if (s == 5) mesh = synthetic::Torus({0, 0, 0}, 1.2, 0.5, 60, 30);
        if (s == 4) mesh = synthetic::BallWithBubble({0, 0, 0}, 1, 0.5, 3);
        std::string a = *EncodeDraco(mesh, options);
        std::string b = *EncodeWithLibdraco(mesh, options);
        size_t d = 0;
        while (d < std::min(a.size(), b.size()) && a[d] == b[d]) ++d;
        EXPECT_TRUE(a == b) << "preset " << int(preset) << " bits " << bits << " shape " << s << " "
                            << a.size() << " " << b.size() << " first diff " << d;
      }
    }
  }
}

}  // namespace
}  // namespace liquidblend::encode
