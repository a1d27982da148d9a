// The token file, which lists the server's principals: docs/operations/tls-and-tokens.md.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "server/access/principal.h"

namespace liquidblend::server {

using TokenHash = std::array<uint8_t, 32>;  // SHA-256

TokenHash HashToken(absl::string_view token);

struct TokenEntry {
  Principal principal;
  std::vector<TokenHash> token_hashes;  // several while one replaces another
  std::string certificate_subject;      // or empty
};

struct TokenFile {
  std::vector<TokenEntry> entries;
  std::optional<Principal> anonymous;  // callers without credentials; none: refused
};

// Errors: kInvalidArgument that names the entry and the field at fault, and never shows a hash.
absl::StatusOr<TokenFile> ParseTokenFile(absl::string_view json);

// Errors: kInvalidArgument as above, or if it is too large; kNotFound if there is none;
// kFailedPrecondition if it cannot be read, which may pass. Messages name the path.
absl::StatusOr<TokenFile> ReadTokenFile(const std::string& path);

struct NewToken {
  std::string token;  // 43 characters, of 256 random bits; stored nowhere
  std::string entry;  // for the file: JSON with its hash
};

// Errors: kInvalidArgument for a name or scope that a file may not have.
absl::StatusOr<NewToken> MakeToken(const std::string& name, const std::vector<std::string>& scopes);

}  // namespace liquidblend::server
