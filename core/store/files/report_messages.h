// Reports <-> their messages in manifests.
#pragma once

#include "core/mesh/registered_family.h"
#include "liquidblend/store/v1/files.pb.h"

namespace liquidblend::store {

liquidblend::store::v1::RegistrationReport ToMessage(const mesh::FamilyTarget& target,
                                                     double frames_per_second);
liquidblend::store::v1::Verdict ToMessage(const mesh::Verdict& verdict);
liquidblend::store::v1::SpaceTimeReport ToMessage(const mesh::SpaceTimeReport& report);

// Requires: IsWhole() of each correspondence.
mesh::RegistrationReport FromMessage(const liquidblend::store::v1::RegistrationReport& message,
                                     double frames_per_second);
mesh::Verdict FromMessage(const liquidblend::store::v1::Verdict& message);
mesh::SpaceTimeReport FromMessage(const liquidblend::store::v1::SpaceTimeReport& message);

}  // namespace liquidblend::store
