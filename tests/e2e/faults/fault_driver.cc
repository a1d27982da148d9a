#include <sys/mman.h>

#include <cstdlib>
#include <filesystem>
#include <string>

#include "tests/e2e/faults/fault_layer.h"
#include "tests/paths.h"

namespace liquidblend::e2e {
namespace {

// The library to preload. A sanitizer's runtime has to come before all else, and its calls then
// reach the layer; one that is linked into the programs does.
std::string Preloaded() {
  const char* const sanitizer = std::getenv("LIQUIDBLEND_E2E_SANITIZER");
  const std::string runtime = sanitizer == nullptr ? "" : sanitizer;
  return (runtime.empty() || runtime == "linked" ? "" : runtime + ":") + paths::FaultLayer();
}

}  // namespace

FaultLayer::FaultLayer(const std::string& folder, const std::string& own, bool has_disk)
    : folder_(folder), own_(own), has_disk_(has_disk) {
  std::filesystem::create_directories(FaultDiskFolder(own_));
  control_ = MapFaultControl(FaultControlFile(own_));
}

FaultLayer::~FaultLayer() { munmap(control_, sizeof(FaultControl)); }

std::vector<std::string> FaultLayer::environment() const {
  std::vector<std::string> variables = {"LD_PRELOAD=" + Preloaded(),
                                        std::string(kFaultFolderVariable) + "=" + folder_,
                                        std::string(kFaultOwnVariable) + "=" + own_};
  if (has_disk_) variables.push_back(std::string(kFaultDiskVariable) + "=1");
  return variables;
}

std::string FaultLayer::disk() const { return FaultDiskFolder(own_); }

void FaultLayer::FailCalls(FaultyCall call, int error_number, int64_t first, int64_t num_failing) {
  Heal();
  control_->error_number = error_number;
  control_->first = first;
  control_->num_failing = num_failing;
  control_->num_calls = 0;
  control_->num_failed = 0;
  control_->call = call;
}

}  // namespace liquidblend::e2e
