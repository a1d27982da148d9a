// Reading and writing of whole files.
#pragma once

#include <string>

#include "absl/status/status.h"
#include "absl/status/statusor.h"

namespace liquidblend::cli {

// Errors: kNotFound if it cannot be read.
absl::StatusOr<std::string> ReadFile(const std::string& path);

// Checks that a file can be made at `path`, before its content is computed.
// Errors: kPermissionDenied, with the folder at fault and what to do.
absl::Status CheckOutput(const std::string& path);

// Writes PATH.part, then renames it, so that the file is whole or missing.
// Errors: kPermissionDenied or kInternal with the system's reason.
absl::Status WriteFile(const std::string& path, const std::string& bytes);

// Makes the directory and its parents unless they exist.
absl::Status MakeDirectory(const std::string& path);

// The name after the last dot, in lower case, without the dot; "bobj.gz" counts as one; "" if none.
std::string Extension(const std::string& path);

}  // namespace liquidblend::cli
