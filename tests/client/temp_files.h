// Directories and files that live as long as a test.
#pragma once

#include <string>
#include <vector>

namespace liquidblend::testing {

class TempDir {
 public:
  TempDir();
  ~TempDir();
  TempDir(const TempDir&) = delete;
  TempDir& operator=(const TempDir&) = delete;

  std::string path() const { return path_; }
  std::string File(const std::string& name) const { return path_ + "/" + name; }
  std::string Write(const std::string& name, const std::string& bytes) const;  // gives the path
  std::vector<std::string> List() const;                                       // names, sorted

 private:
  std::string path_;
};

// Names of what is in a folder, sorted.
std::vector<std::string> ListFolder(const std::string& path);

std::string ReadBytes(const std::string& path);

}  // namespace liquidblend::testing
