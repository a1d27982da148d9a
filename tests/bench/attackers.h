// Hostile clients of a server, each a function that goes on until it is told to stop, on a thread
// of its own. Each keeps to a rate: a load generator that takes the cores for itself would measure
// the machine and not the server.
#pragma once

#include <cstdint>
#include <functional>
#include <stop_token>
#include <string>
#include <vector>

#include "tests/bench/load_clients.h"

namespace liquidblend::bench {

// Addresses are on the loopback interface.
struct AttackTarget {
  LoadTarget grpc;
  int http_port = 0;

  int grpc_port() const { return std::stoi(grpc.address.substr(grpc.address.rfind(':') + 1)); }
};

struct AttackReport {
  int64_t num_attempts = 0;
  int64_t num_wrong = 0;  // answers that the server should not give, or none where one is due
};

struct Attacker {
  std::string name;
  double per_second = 0.0;  // most attempts that it makes
  std::string rate;         // the same for the report, in words
  std::function<AttackReport(const AttackTarget&, const std::stop_token&)> run;
};

// Those who need no token.
std::vector<Attacker> PeerAttackers();

// All kinds, one of each; PeerAttackers() too.
std::vector<Attacker> AllAttackers();

}  // namespace liquidblend::bench
