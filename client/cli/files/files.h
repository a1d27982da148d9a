// Whole files in and out.
#pragma once

#include <string>

#include "absl/status/status.h"
#include "absl/status/statusor.h"

namespace liquidblend::cli {

// Errors: kNotFound if it cannot be read.
absl::StatusOr<std::string> ReadFile(const std::string& path);

// Whether a file can be made there: to be asked before the work that its content takes.
// Errors: kPermissionDenied, with the folder at fault and what to do.
absl::Status CheckOutput(const std::string& path);

// Writes PATH.part, then renames it, so that a file is whole or not there.
// Errors: kPermissionDenied or kInternal with the system's reason.
absl::Status WriteFile(const std::string& path, const std::string& bytes);

// Makes the directory and its parents unless they exist.
absl::Status MakeDirectory(const std::string& path);

// The name after the last dot, in lower case, without the dot; "bobj.gz" counts as one; "" if none.
std::string Extension(const std::string& path);

}  // namespace liquidblend::cli
