// The object store that ctest starts for the tests that need one (tests/ceph.sh).
#pragma once

#include <string>
#include <vector>

namespace liquidblend::store {

// NAME=VALUE for a program that is to use it; fails the test if it does not run. Its bucket is
// "liquidblend".
std::vector<std::string> CephEnvironment();

}  // namespace liquidblend::store
