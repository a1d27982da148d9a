// Options and correspondences as jobs carry them -> as the stages take them.
#pragma once

#include <vector>

#include "liquidblend/store/v1/records.pb.h"
#include "worker/ingest/read_animation.h"
#include "worker/registration/correspondence.h"
#include "worker/registration/register.h"

namespace liquidblend::jobs {

ingest::ImportOptions ToImportOptions(const store::v1::ImportOptions& options);

// 0 stands for the stage's default.
registration::RegistrationOptions ToRegistrationOptions(
    const store::v1::RegistrationOptions& options);

// Those of one target; seconds become frames.
std::vector<registration::Correspondence> ToCorrespondences(const store::v1::RegisterJob& job,
                                                            int target_index,
                                                            double frames_per_second);

}  // namespace liquidblend::jobs
