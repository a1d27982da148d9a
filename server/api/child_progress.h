// Progress of a registration whose targets are registered side by side, each as a child of its own.
#pragma once

#include <vector>

#include "liquidblend/store/v1/records.pb.h"

namespace liquidblend::server {

// The job with the combined progress of its children, until it has its own: the fraction is their
// mean, the time left that of the slowest at the speed of the running ones. Stage, iteration,
// energies, attempt and worker are of the running child that is the furthest behind; without a
// running child they are not set.
//   children  Catalog::ListChildren() of the job; without any, the job is returned as it is
store::v1::JobRecord WithProgressOf(const std::vector<store::v1::JobRecord>& children,
                                    store::v1::JobRecord job);

}  // namespace liquidblend::server
