// Groups of clients that run side by side, and tables of what they saw.
#pragma once

#include <functional>
#include <stop_token>
#include <string>
#include <vector>

#include "tests/bench/load_clients.h"

namespace liquidblend::bench {

using Client = std::function<ClientReport(const std::stop_token&)>;

// Clients of one kind; what its members saw, together.
struct Group {
  std::string name;
  std::vector<Client> clients;
  ClientReport report;
};

// Of clients make(0), make(1)...
Group Repeat(std::string name, int count, const std::function<Client(int)>& make);

// Adds what one client saw to what all saw; their latencies are to be sorted at the end.
void AddUp(const ClientReport& one, ClientReport& all);
void Sort(ClientReport& report);

// Runs all clients of all groups side by side and sets the groups' reports.
void Run(std::vector<Group>& groups, double seconds);

// Nearest rank; 0 of nothing. Requires: ascending.
double Percentile(const std::vector<double>& sorted, double share);

// A row for each group, below a header.
void PrintHeader();
void PrintTitle(const std::string& title);  // of rows, in place of a group
void Print(Group& group, double seconds);
// A title if there are any: how many, how long, and how many of the late frames they touched.
void PrintStops(const std::vector<Interval>& stops, const std::vector<Group>& groups);

}  // namespace liquidblend::bench
