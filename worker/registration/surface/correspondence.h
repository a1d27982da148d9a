// What a user says belongs together (paper, section 6).
#pragma once

#include "core/mesh/correspondence.h"

namespace liquidblend::registration {

using mesh::Correspondence;
using mesh::CorrespondenceKind;
using mesh::CorrespondenceReport;

// But for what a file's units make of them.
bool IsSame(const Correspondence& a, const Correspondence& b);

}  // namespace liquidblend::registration
