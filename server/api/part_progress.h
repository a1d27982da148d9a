// How far a registration is whose targets are registered side by side, each as a part of its own.
#pragma once

#include <vector>

#include "liquidblend/store/v1/records.pb.h"

namespace liquidblend::server {

// The job with the progress that its parts make together, until it has its own: the fraction is
// their mean, the time left that of the slowest at the pace of those that run. Stage, iteration,
// energies, attempt and worker are of the running part that is the furthest behind; with none
// running, nothing of that is set.
//   parts  Catalog::ListParts() of the job; without any, the job is returned as it is
store::v1::JobRecord WithProgressOf(const std::vector<store::v1::JobRecord>& parts,
                                    store::v1::JobRecord job);

}  // namespace liquidblend::server
