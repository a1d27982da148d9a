// What a user says belongs together (paper, section 6).
#pragma once

#include "core/mesh/correspondence.h"

namespace liquidblend::registration {

using mesh::Correspondence;
using mesh::CorrespondenceKind;
using mesh::CorrespondenceReport;

}  // namespace liquidblend::registration
