// Detection of gRPC targets on this machine.
#pragma once

#include <string>

#include "absl/functional/function_ref.h"
#include "absl/strings/string_view.h"

namespace liquidblend::client {

// Whether a channel to `target` stays on this machine. Takes HOST:PORT and gRPC's schemes dns:,
// ipv4:, ipv6: (every address must be of this machine) and unix:. Hosts are IP addresses in
// 127.0.0.0/8, ::1 or IPv4-mapped, or exactly "localhost"; no other name is looked up. Other
// targets count as not on this machine.
bool IsThisMachine(const std::string& target);

// Whether each host of such a target passes `test`, which gets it without brackets and port. Those
// of unix: do, as they are of this machine; those that a name server of the target's own would look
// up do not.
bool AllHostsPass(const std::string& target, absl::FunctionRef<bool(absl::string_view host)> test);

}  // namespace liquidblend::client
