// Detection of gRPC targets on this machine.
#pragma once

#include <string>

namespace liquidblend::client {

// Whether a channel to `target` stays on this machine. Takes HOST:PORT and gRPC's schemes dns:,
// ipv4:, ipv6: (every address must be of this machine) and unix:. Hosts are IP addresses in
// 127.0.0.0/8, ::1 or IPv4-mapped, or exactly "localhost"; no other name is looked up. Other
// targets count as not on this machine.
bool IsThisMachine(const std::string& target);

}  // namespace liquidblend::client
