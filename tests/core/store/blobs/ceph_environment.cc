#include "tests/core/store/blobs/ceph_environment.h"

#include "absl/strings/str_split.h"
#include "tests/core/store/store_testing.h"
#include "tests/paths.h"

namespace liquidblend::store {

std::vector<std::string> CephEnvironment() {
  const std::string folder = paths::CephFolder();
  const std::string text = ReadFile(folder + "/s3.env");
  EXPECT_FALSE(text.empty()) << "tests/ceph.sh start " << folder << " has not run";
  return absl::StrSplit(text, '\n', absl::SkipEmpty());
}

}  // namespace liquidblend::store
