#include "worker/spacetime/report.h"

#include <algorithm>
#include <cassert>

#include "worker/spacetime/fidelity.h"

namespace liquidblend::spacetime {
namespace {

// Counts the droplets. Pieces of one droplet follow one another.
int64_t NumDroplets(const mesh::SpaceTimeMesh& mesh) {
  int64_t count = 0;
  for (size_t n = 0; n < mesh.rigid_pieces.size(); ++n) {
    const bool is_next = n == 0 || mesh.rigid_pieces[n].droplet != mesh.rigid_pieces[n - 1].droplet;
    if (is_next) ++count;
  }
  return count;
}

double ThinShare(const mesh::SpaceTimeMesh& mesh) {
  if (mesh.thin.empty()) return 0.0;
  const int64_t num_thin =
      static_cast<int64_t>(mesh.thin.size()) - std::count(mesh.thin.begin(), mesh.thin.end(), 0);
  return static_cast<double>(num_thin) / static_cast<double>(mesh.thin.size());
}

}  // namespace

mesh::SpaceTimeReport Report(const mesh::Animation& animation, const mesh::SpaceTimeMesh& mesh,
                             const BuildOptions& options, const parallel::Arena& arena) {
  assert(options.connectivity != Connectivity::kAuto);
  mesh::SpaceTimeReport report;
  report.is_tracked = options.connectivity == Connectivity::kTracked;
  if (!report.is_tracked) report.grid_spacing_m = options.spacing_edges * mesh.edge_length_m;
  report.edge_length_m = mesh.edge_length_m;
  report.num_vertices = mesh.num_vertices();
  report.num_tetrahedra = static_cast<int64_t>(mesh.tetrahedra.size());
  report.num_pyramids = static_cast<int64_t>(mesh.pyramids.size());
  report.num_wedges = static_cast<int64_t>(mesh.wedges.size());
  report.num_hexahedra = static_cast<int64_t>(mesh.hexahedra.size());
  report.num_droplets = NumDroplets(mesh);
  report.num_rigid_pieces = static_cast<int64_t>(mesh.rigid_pieces.size());
  report.thin_share = ThinShare(mesh);
  report.fidelity = MeasureFidelity(animation, mesh, FidelityOptions(), arena);
  return report;
}

}  // namespace liquidblend::spacetime
