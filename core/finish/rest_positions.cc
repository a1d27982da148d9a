#include "core/finish/rest_positions.h"

namespace liquidblend::finish {

void AddRestPositions(const mesh::RegisteredFamily& family, const CrossedEdges& crossed,
                      mesh::TriangleMesh& surface) {
  const mesh::TimeAxis axis = family.time_axis();
  const double time = axis.Frames(crossed.time_ticks);
  // Edges are straight in space and frames, as March() cuts them.
  const auto in_source = [&](int32_t v) {
    Eigen::Vector4f place = Eigen::Map<const Eigen::Vector4f>(family.vertices[v].data());
    place[3] = static_cast<float>(axis.Frames(place[3]) / family.frames_per_second);
    return place;
  };
  surface.rest.resize(4, surface.num_vertices());
  for (Eigen::Index i = 0; i < surface.num_vertices(); ++i) {
    const double from = axis.Frames(crossed.low_positions[i][3]);
    const double to = axis.Frames(crossed.high_positions[i][3]);
    const auto share = static_cast<float>((time - from) / (to - from));
    const Eigen::Vector4f low = in_source(crossed.low[i]), high = in_source(crossed.high[i]);
    surface.rest.col(i) = low + share * (high - low);
  }
}

}  // namespace liquidblend::finish
