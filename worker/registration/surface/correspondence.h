// Comparison of correspondences (paper, section 6).
#pragma once

#include "core/mesh/correspondence.h"

namespace liquidblend::registration {

using mesh::Correspondence;
using mesh::CorrespondenceKind;
using mesh::CorrespondenceReport;

// Whether two correspondences are equal up to the rounding of a file's units.
bool IsSame(const Correspondence& a, const Correspondence& b);

}  // namespace liquidblend::registration
