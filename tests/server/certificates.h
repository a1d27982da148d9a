// A certificate authority for tests, and what it signs.
#pragma once

#include <memory>
#include <string>

namespace liquidblend::server {

struct PemPair {
  std::string certificate;
  std::string key;
};

// Elliptic-curve keys, valid for a day.  Threads: one.
class TestAuthority {
 public:
  explicit TestAuthority(const std::string& common_name);
  ~TestAuthority();

  const std::string& certificate() const;  // PEM
  // For a server on 127.0.0.1 (a client just shows it), with the subject CN=common_name.
  PemPair Sign(const std::string& common_name);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

// Replaces the file at once, as tools do that renew certificates.
void ReplaceFile(const std::string& path, const std::string& text);

}  // namespace liquidblend::server
