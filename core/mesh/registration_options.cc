#include "core/mesh/registration_options.h"

namespace liquidblend::mesh {

absl::Status RegistrationOptions::Validate() const {
  absl::Status status;
  ForEach(*this, [&](const OptionInfo& info, const auto&... members) {
    (status.Update(CheckRange(info.name, static_cast<double>(members), info.range)), ...);
  });
  return status;
}

}  // namespace liquidblend::mesh
