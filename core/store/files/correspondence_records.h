// Reports on correspondences <-> their records in family files.
#pragma once

#include <vector>

#include "core/mesh/correspondence.h"
#include "liquidblend/store/v1/files.pb.h"

namespace liquidblend::store {

liquidblend::store::v1::CorrespondenceReport ToRecord(const mesh::CorrespondenceReport& report,
                                                      double frames_per_second);

// Requires: IsWhole(record).
mesh::CorrespondenceReport FromRecord(const liquidblend::store::v1::CorrespondenceReport& record,
                                      double frames_per_second);

// Times become frames.
mesh::Correspondence FromRecord(const liquidblend::store::v1::Correspondence& record,
                                double frames_per_second);

// Whether both its events have four numbers.
bool IsWhole(const liquidblend::store::v1::CorrespondenceReport& record);

}  // namespace liquidblend::store
