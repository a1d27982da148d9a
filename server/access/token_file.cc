#include "server/access/token_file.h"

#include <fcntl.h>
#include <openssl/evp.h>
#include <sys/random.h>

#include <algorithm>
#include <cstddef>
#include <nlohmann/json.hpp>
#include <set>
#include <span>

#include "absl/strings/ascii.h"
#include "absl/strings/escaping.h"
#include "absl/strings/str_cat.h"
#include "core/base/posix_file.h"
#include "core/base/status_macros.h"
#include "server/base/errors.h"

namespace liquidblend::server {
namespace {

using Json = nlohmann::ordered_json;

constexpr size_t kMaxFileBytes = 4 << 20;
constexpr size_t kMaxNameLength = 128;

absl::Status Wrong(const std::string& where, absl::string_view what) {
  return absl::InvalidArgumentError(absl::StrCat(where, ": ", what));
}

// Misspelt fields would take effect by being absent.
absl::Status CheckKeys(const Json& object, const std::string& where,
                       const std::set<std::string>& allowed) {
  if (!object.is_object()) return Wrong(where, "must be an object");
  for (const auto& [key, value] : object.items()) {
    if (allowed.count(key) == 0) {
      return Wrong(where, absl::StrCat("has an unknown field '", CleanText(key), "'"));
    }
  }
  return absl::OkStatus();
}

absl::StatusOr<std::vector<std::string>> Strings(const Json& object, const char* key,
                                                 const std::string& where) {
  std::vector<std::string> strings;
  if (!object.contains(key)) return strings;
  const Json& list = object[key];
  const auto is_string = [](const Json& value) { return value.is_string(); };
  if (!list.is_array() || !std::all_of(list.begin(), list.end(), is_string)) {
    return Wrong(where, absl::StrCat(key, " must be a list of strings"));
  }
  for (const Json& value : list) strings.push_back(value.get<std::string>());
  return strings;
}

absl::StatusOr<std::set<Scope>> ScopesOf(const std::vector<std::string>& names,
                                         const std::string& where) {
  if (names.empty())
    return Wrong(where, "scopes must name at least one of frames, write, register");
  std::set<Scope> scopes;
  for (const std::string& name : names) {
    const absl::StatusOr<Scope> scope = ParseScope(name);
    if (!scope.ok()) return Wrong(where, scope.status().message());
    scopes.insert(*scope);
  }
  return scopes;
}

absl::StatusOr<PrincipalLimits> LimitsOf(const Json& entry, const std::string& where) {
  PrincipalLimits limits;
  if (!entry.contains("limits")) return limits;
  const Json& object = entry["limits"];
  const std::string inside = absl::StrCat(where, ".limits");
  LB_RETURN_IF_ERROR(CheckKeys(object, inside,
                               {"max_upload_bytes", "max_streams", "requests_per_second",
                                "max_stored_bytes", "max_queued_jobs"}));
  for (const auto& [key, value] : object.items()) {
    const bool is_right =
        key == "requests_per_second" ? value.is_number() : value.is_number_integer();
    if (!is_right) return Wrong(inside, absl::StrCat(key, " must be a number"));
  }
  limits.max_upload_bytes = object.value("max_upload_bytes", int64_t{0});
  const int64_t max_streams = object.value("max_streams", int64_t{0});
  limits.max_streams = static_cast<int>(std::clamp<int64_t>(max_streams, -1, 1'000'000));
  limits.requests_per_second = object.value("requests_per_second", 0.0);
  limits.max_stored_bytes = object.value("max_stored_bytes", int64_t{0});
  limits.max_queued_jobs = object.value("max_queued_jobs", int64_t{0});
  const absl::Status status = limits.Validate();
  if (!status.ok()) return Wrong(inside, status.message());
  return limits;
}

absl::StatusOr<TokenHash> ParseHash(const std::string& hex, const std::string& where) {
  const bool is_hex = hex.size() == 64 && std::all_of(hex.begin(), hex.end(), [](char c) {
                        return absl::ascii_isxdigit(static_cast<unsigned char>(c));
                      });
  if (!is_hex) return Wrong(where, "token_sha256 must hold strings of 64 hexadecimal digits");
  const std::string bytes = absl::HexStringToBytes(hex);
  TokenHash hash = {};
  std::copy(bytes.begin(), bytes.end(), hash.begin());
  return hash;
}

bool IsTokenName(absl::string_view name) {
  return !name.empty() && name.size() <= kMaxNameLength && CleanText(name) == name;
}

absl::StatusOr<Principal> PrincipalOf(const Json& entry, const std::string& name,
                                      const std::string& where) {
  Principal principal;
  principal.name = name;
  principal.key = name;
  LB_ASSIGN_OR_RETURN(const std::vector<std::string> scopes, Strings(entry, "scopes", where));
  LB_ASSIGN_OR_RETURN(principal.scopes, ScopesOf(scopes, where));
  LB_ASSIGN_OR_RETURN(principal.limits, LimitsOf(entry, where));
  return principal;
}

absl::StatusOr<TokenEntry> EntryOf(const Json& json, const std::string& where) {
  LB_RETURN_IF_ERROR(
      CheckKeys(json, where, {"name", "token_sha256", "certificate_subject", "scopes", "limits"}));
  if (!json.contains("name") || !json["name"].is_string() ||
      !IsTokenName(json["name"].get<std::string>()) || json["name"] == kAnonymous) {
    return Wrong(where, "name must be of 1 to 128 characters, and not 'anonymous'");
  }
  TokenEntry entry;
  LB_ASSIGN_OR_RETURN(entry.principal, PrincipalOf(json, json["name"].get<std::string>(), where));
  LB_ASSIGN_OR_RETURN(const std::vector<std::string> hashes, Strings(json, "token_sha256", where));
  for (const std::string& hex : hashes) {
    LB_ASSIGN_OR_RETURN(entry.token_hashes.emplace_back(), ParseHash(hex, where));
  }
  if (json.contains("certificate_subject")) {
    if (!json["certificate_subject"].is_string()) {
      return Wrong(where, "certificate_subject must be a string");
    }
    entry.certificate_subject = json["certificate_subject"].get<std::string>();
  }
  if (entry.token_hashes.empty() && entry.certificate_subject.empty()) {
    return Wrong(where, "there must be a token_sha256 or a certificate_subject");
  }
  return entry;
}

// A token, subject or name that two entries have would mean either.
absl::Status CheckAreDistinct(const std::vector<TokenEntry>& entries) {
  std::set<std::string> names, subjects;
  std::set<TokenHash> hashes;
  for (const TokenEntry& entry : entries) {
    const std::string& name = entry.principal.name;
    if (!names.insert(name).second) return Wrong(name, "is named twice");
    for (const TokenHash& hash : entry.token_hashes) {
      if (!hashes.insert(hash).second) return Wrong(name, "has a token that is there already");
    }
    const std::string& subject = entry.certificate_subject;
    if (!subject.empty() && !subjects.insert(subject).second) {
      return Wrong(name, "has a certificate_subject that is there already");
    }
  }
  return absl::OkStatus();
}

std::string RandomToken() {
  std::array<char, 32> bytes = {};
  size_t num_bytes = 0;
  while (num_bytes < bytes.size()) {
    const ssize_t got = getrandom(bytes.data() + num_bytes, bytes.size() - num_bytes, 0);
    if (got > 0) num_bytes += static_cast<size_t>(got);
  }
  std::string token;
  absl::WebSafeBase64Escape(absl::string_view(bytes.data(), bytes.size()), &token);
  return token;
}

// The file's content; of one that is too large the first kMaxFileBytes + 1.
absl::StatusOr<std::string> ReadText(const std::string& path) {
  // A pipe that nobody writes to must not stop the server.
  LB_ASSIGN_OR_RETURN(const base::FileHandle file, base::OpenFile(path, O_RDONLY | O_NONBLOCK));
  LB_ASSIGN_OR_RETURN(const size_t size, base::SizeOfFile(file, path));
  const size_t num_read = std::min(size, kMaxFileBytes + 1);
  std::string text;
  LB_RETURN_IF_ERROR(base::ReadAll(file, num_read, path, [&](std::span<const std::byte> bytes) {
    text.append(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  }));
  return text;
}

}  // namespace

TokenHash HashToken(absl::string_view token) {
  TokenHash hash = {};
  unsigned int size = 0;
  EVP_Digest(token.data(), token.size(), hash.data(), &size, EVP_sha256(), nullptr);
  return hash;
}

absl::StatusOr<TokenFile> ParseTokenFile(absl::string_view text) {
  const Json json = Json::parse(text.begin(), text.end(), nullptr, /*allow_exceptions=*/false);
  if (json.is_discarded()) return absl::InvalidArgumentError("is not JSON");
  LB_RETURN_IF_ERROR(CheckKeys(json, "the file", {"principals", "anonymous"}));
  TokenFile file;
  if (json.contains("principals")) {
    const Json& list = json["principals"];
    if (!list.is_array()) return Wrong("principals", "must be a list");
    for (size_t k = 0; k < list.size(); ++k) {
      LB_ASSIGN_OR_RETURN(file.entries.emplace_back(),
                          EntryOf(list[k], absl::StrCat("principals[", k, "]")));
    }
  }
  LB_RETURN_IF_ERROR(CheckAreDistinct(file.entries));
  if (json.contains(kAnonymous)) {
    LB_RETURN_IF_ERROR(CheckKeys(json[kAnonymous], kAnonymous, {"scopes", "limits"}));
    LB_ASSIGN_OR_RETURN(file.anonymous, PrincipalOf(json[kAnonymous], kAnonymous, kAnonymous));
  }
  return file;
}

absl::StatusOr<TokenFile> ReadTokenFile(const std::string& path) {
  const absl::StatusOr<std::string> text = ReadText(path);
  if (!text.ok()) {
    const std::string message = absl::StrCat("tokens: ", text.status().message());
    if (absl::IsNotFound(text.status())) return absl::NotFoundError(message);
    return absl::FailedPreconditionError(message);
  }
  if (text->size() > kMaxFileBytes) {
    return absl::InvalidArgumentError(
        absl::StrCat("tokens '", path, "' has more than ", kMaxFileBytes, " bytes"));
  }
  absl::StatusOr<TokenFile> file = ParseTokenFile(*text);
  if (file.ok()) return file;
  return absl::InvalidArgumentError(absl::StrCat("tokens '", path, "': ", file.status().message()));
}

absl::StatusOr<NewToken> MakeToken(const std::string& name,
                                   const std::vector<std::string>& scopes) {
  NewToken made;
  made.token = RandomToken();
  const TokenHash hash = HashToken(made.token);
  const absl::string_view bytes(reinterpret_cast<const char*>(hash.data()), hash.size());
  const Json entry = {{"name", name},
                      {"token_sha256", Json::array({absl::BytesToHexString(bytes)})},
                      {"scopes", scopes}};
  LB_RETURN_IF_ERROR(EntryOf(entry, absl::StrCat("'", name, "'")).status());
  made.entry = entry.dump();
  return made;
}

}  // namespace liquidblend::server
