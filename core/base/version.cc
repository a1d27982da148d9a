#include "core/base/version.h"

#include "absl/strings/str_cat.h"

namespace liquidblend::base {

std::string Version() { return absl::StrCat(LIQUIDBLEND_VERSION, " (commit ", kCommit, ")"); }

std::string VersionLine(const std::string& program, const std::string& tables) {
  const std::string line = absl::StrCat(program, " ", Version());
  return tables.empty() ? line : absl::StrCat(line, ", ", tables);
}

}  // namespace liquidblend::base
