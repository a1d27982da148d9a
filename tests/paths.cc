#include "tests/paths.h"

#include <cstdlib>

namespace liquidblend::paths {
namespace {

std::string Place(const char* variable, const char* of_build) {
  const char* const value = std::getenv(variable);
  return value == nullptr ? of_build : value;
}

}  // namespace

std::string Program(const std::string& name) {
  return Place("LIQUIDBLEND_BINARY_DIR", LIQUIDBLEND_BINARY_DIR) + "/" + name;
}

std::string Source(const std::string& path) {
  return Place("LIQUIDBLEND_SOURCE_DIR", LIQUIDBLEND_SOURCE_DIR) + "/" + path;
}

std::string FaultLayer() { return Place("LIQUIDBLEND_FAULT_LAYER", LIQUIDBLEND_FAULT_LAYER); }

std::string CephFolder() { return Place("LIQUIDBLEND_CEPH", LIQUIDBLEND_CEPH); }

}  // namespace liquidblend::paths
