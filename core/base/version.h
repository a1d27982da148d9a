// Version and commit of the programs.
#pragma once

#include <string>

namespace liquidblend::base {

// Commit of the sources: 12 hexadecimal digits, with "-dirty" after them if files had been changed
// since; "unknown" if they were built outside a repository and LIQUIDBLEND_COMMIT was not set.
extern const char kCommit[];

// Version and commit: "0.2.0 (commit 0123456789ab)".
std::string Version();

// Line for --version and the log: "liquidblend-worker 0.2.0 (commit 0123456789ab), tables 7 of
// SQLite, 6 of PostgreSQL".
//   tables  store::DescribeTables(); "" for a program without a store
std::string VersionLine(const std::string& program, const std::string& tables = "");

}  // namespace liquidblend::base
