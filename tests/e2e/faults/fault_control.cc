#include <fcntl.h>
#include <sys/mman.h>
#include <unistd.h>

#include <cstdlib>

#include "tests/e2e/faults/fault_layer.h"

namespace liquidblend::e2e {

std::string FaultControlFile(const std::string& own) { return own + "/control"; }
std::string FaultDiskFolder(const std::string& own) { return own + "/disk"; }

FaultControl* MapFaultControl(const std::string& path) {
  const int fd = open(path.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0644);
  if (fd < 0 || ftruncate(fd, sizeof(FaultControl)) != 0) std::abort();
  void* const start =
      mmap(nullptr, sizeof(FaultControl), PROT_READ | PROT_WRITE, MAP_SHARED, fd, 0);
  close(fd);
  if (start == MAP_FAILED) std::abort();
  return static_cast<FaultControl*>(start);  // zeros are a valid one
}

}  // namespace liquidblend::e2e
