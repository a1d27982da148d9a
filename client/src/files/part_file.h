// A file that is received: whole at its place, or missing.
#pragma once

#include <fstream>
#include <string>

#include "absl/status/status.h"
#include "absl/strings/string_view.h"
#include "client/src/files/checksum.h"

namespace liquidblend::client {

// Written as path.part, which is removed unless Commit() succeeds.  Threads: one at a time.
class PartFile {
 public:
  //   checksum  that the content must have; says of which kind
  PartFile(const std::string& path, const std::string& checksum);
  ~PartFile();
  PartFile(const PartFile&) = delete;
  PartFile& operator=(const PartFile&) = delete;

  // Errors: kPermissionDenied if it cannot be written, which then stays so.
  absl::Status Append(absl::string_view bytes);

  // Verifies the content and moves it to its place, once.
  // Errors: as Append(); kDataLoss if it has another checksum.
  absl::Status Commit();

 private:
  const std::string path_, part_, expected_;
  Checksum checksum_;
  std::ofstream output_;
};

}  // namespace liquidblend::client
