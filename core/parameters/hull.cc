#include "core/parameters/hull.h"

#include <libqhull_r/qhull_ra.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <string>

#include "absl/cleanup/cleanup.h"
#include "absl/strings/str_cat.h"

namespace liquidblend::parameters {
namespace {

// C-0: facets in one hyperplane, but for rounding, become one. Pp: no remarks on precision.
char kCommand[] = "qhull C-0 Pp";

// Qhull needs two dimensions.
std::vector<HullFacet> EndsOf(const Eigen::MatrixXd& points) {
  HullFacet low = {{0}, -Eigen::VectorXd::Ones(1)};
  HullFacet high = {{0}, Eigen::VectorXd::Ones(1)};
  points.row(0).minCoeff(low.points.data());
  points.row(0).maxCoeff(high.points.data());
  return {low, high};
}

std::vector<HullFacet> FacetsOf(qhT* qh) {
  std::vector<HullFacet> facets;
  facetT* facet = nullptr;
  FORALLfacets {
    HullFacet& to = facets.emplace_back();
    to.normal = Eigen::Map<const Eigen::VectorXd>(facet->normal, qh->hull_dim);
    vertexT* vertex = nullptr;
    vertexT** vertexp = nullptr;
    FOREACHvertex_(facet->vertices) to.points.push_back(qh_pointid(qh, vertex->point));
    std::sort(to.points.begin(), to.points.end());
  }
  return facets;
}

// First what is large, then the pool of what is small.
void FreeAll(qhT* qh) {
  int num_left = 0;
  int num_bytes_left = 0;
  qh_freeqhull(qh, !qh_ALL);
  qh_memfreeshort(qh, &num_left, &num_bytes_left);
}

}  // namespace

absl::StatusOr<std::vector<HullFacet>> FindHullFacets(const Eigen::MatrixXd& points) {
  if (points.rows() == 1) return EndsOf(points);
  char* messages = nullptr;
  size_t num_bytes = 0;
  FILE* const log = open_memstream(&messages, &num_bytes);
  const absl::Cleanup free_messages = [&] { std::free(messages); };
  if (log == nullptr) return absl::ResourceExhaustedError("no memory for Qhull's messages");
  qhT state;
  qh_zero(&state, log);
  Eigen::MatrixXd copy = points;  // Qhull takes it as its own
  const int code =
      qh_new_qhull(&state, static_cast<int>(points.rows()), static_cast<int>(points.cols()),
                   copy.data(), False, kCommand, nullptr, log);
  std::vector<HullFacet> facets;
  if (code == qh_ERRnone) facets = FacetsOf(&state);
  FreeAll(&state);
  std::fclose(log);
  if (code == qh_ERRnone) return facets;
  const std::string text(messages, num_bytes);
  return absl::InvalidArgumentError(absl::StrCat("Qhull finds no hull of ", points.cols(),
                                                 " points in ", points.rows(),
                                                 " dimensions: ", text.substr(0, text.find('\n'))));
}

}  // namespace liquidblend::parameters
