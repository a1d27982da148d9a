#include "server/access/authorizer.h"

#include <arpa/inet.h>
#include <netinet/in.h>
#include <openssl/crypto.h>
#include <sys/stat.h>

#include <algorithm>
#include <iterator>
#include <optional>
#include <utility>

#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_replace.h"
#include "absl/strings/strip.h"
#include "core/base/status_macros.h"
#include "server/base/errors.h"

namespace liquidblend::server {
namespace {

constexpr char kMissing[] = "missing";  // the stamp of no file

// Changes whenever the file does: written in place, replaced, or a link to it turned elsewhere.
std::string StampOf(const std::string& path) {
  struct stat info = {};
  if (stat(path.c_str(), &info) != 0) return kMissing;
  return absl::StrCat(info.st_dev, " ", info.st_ino, " ", info.st_size, " ", info.st_mtim.tv_sec,
                      " ", info.st_mtim.tv_nsec, " ", info.st_ctim.tv_sec, " ",
                      info.st_ctim.tv_nsec);
}

Principal Everyone(absl::string_view certificate_subject) {
  Principal principal;
  principal.name = certificate_subject.empty() ? kAnonymous : CleanText(certificate_subject, 128);
  principal.scopes = {Scope::kFrames, Scope::kWrite, Scope::kRegister};
  return principal;
}

// Looks at all hashes, each in the same time, so that the time of the answer says nothing of them.
const TokenEntry* FindToken(const TokenFile& file, absl::string_view token) {
  const TokenHash hash = HashToken(token);
  const TokenEntry* found = nullptr;
  for (const TokenEntry& entry : file.entries) {
    for (const TokenHash& known : entry.token_hashes) {
      if (CRYPTO_memcmp(hash.data(), known.data(), hash.size()) == 0) found = &entry;
    }
  }
  return found;
}

absl::Status Unauthenticated(const char* message, const char* reason) {
  return WithReason(absl::UnauthenticatedError(message), reason);
}

absl::StatusOr<Principal> Find(const TokenFile& file, absl::string_view bearer,
                               absl::string_view certificate_subject) {
  if (!bearer.empty()) {
    if (const TokenEntry* entry = FindToken(file, bearer)) return entry->principal;
    return Unauthenticated("this server does not know the token", "TOKEN_UNKNOWN");
  }
  for (const TokenEntry& entry : file.entries) {
    if (!certificate_subject.empty() && entry.certificate_subject == certificate_subject) {
      return entry.principal;
    }
  }
  if (file.anonymous.has_value()) return *file.anonymous;
  if (certificate_subject.empty()) {
    return Unauthenticated("a token is needed: authorization: Bearer TOKEN", "TOKEN_MISSING");
  }
  return WithReason(
      absl::UnauthenticatedError(
          "this server does not know the certificate's subject, and there is no token"),
      "CERTIFICATE_UNKNOWN", {{"subject", std::string(certificate_subject)}});
}

// The /64 of an IPv6 address in brackets, or the IPv4 address that is mapped to it. gRPC escapes
// the brackets, and a zone may follow the address.
std::optional<std::string> NetworkOfIpv6(const std::string& host) {
  const std::string unescaped =
      absl::StrReplaceAll(host, {{"%5B", "["}, {"%5b", "["}, {"%5D", "]"}, {"%5d", "]"}});
  absl::string_view text = unescaped;
  if (!absl::ConsumePrefix(&text, "[") || !absl::ConsumeSuffix(&text, "]")) return std::nullopt;
  in6_addr address = {};
  const std::string without_zone(text.substr(0, text.find('%')));
  if (inet_pton(AF_INET6, without_zone.c_str(), &address) != 1) return std::nullopt;
  char shown[INET6_ADDRSTRLEN] = {};
  if (IN6_IS_ADDR_V4MAPPED(&address)) {
    inet_ntop(AF_INET, &address.s6_addr[12], shown, sizeof(shown));
    return shown;
  }
  std::fill(std::begin(address.s6_addr) + 8, std::end(address.s6_addr), uint8_t{0});
  inet_ntop(AF_INET6, &address, shown, sizeof(shown));
  return absl::StrCat(shown, "/64");
}

}  // namespace

absl::StatusOr<std::unique_ptr<Authorizer>> Authorizer::Open(const std::string& path) {
  std::unique_ptr<Authorizer> authorizer(new Authorizer(path));
  LB_RETURN_IF_ERROR(authorizer->ReloadIfChanged());
  return authorizer;
}

absl::StatusOr<Principal> Authorizer::Check(absl::string_view bearer,
                                            absl::string_view certificate_subject,
                                            absl::string_view peer) const {
  const std::shared_ptr<const TokenFile> file = File();
  Principal principal = Everyone(certificate_subject);
  if (file != nullptr) {
    LB_ASSIGN_OR_RETURN(principal, Find(*file, bearer, certificate_subject));
  }
  principal.key = principal.name == kAnonymous ? absl::StrCat(kAnonymous, "@", HostOfPeer(peer))
                                               : principal.name;
  return principal;
}

std::shared_ptr<const TokenFile> Authorizer::File() const {
  absl::MutexLock lock(&mutex_);
  return file_;
}

std::vector<Principal> Authorizer::Principals() const {
  const std::shared_ptr<const TokenFile> file = File();
  std::vector<Principal> principals;
  if (file == nullptr) return principals;
  for (const TokenEntry& entry : file->entries) principals.push_back(entry.principal);
  if (file->anonymous.has_value()) principals.push_back(*file->anonymous);
  return principals;
}

absl::Status Authorizer::ReloadIfChanged() {
  if (path_.empty()) return absl::OkStatus();
  const absl::MutexLock reload(&reload_mutex_);
  const std::string stamp = StampOf(path_);
  if (stamp == stamp_) {
    told_.clear();
    return absl::OkStatus();
  }
  absl::StatusOr<TokenFile> file = ReadTokenFile(path_);
  const absl::Status status = file.status();
  if (file.ok()) {
    auto read = std::make_shared<const TokenFile>(*std::move(file));
    absl::MutexLock lock(&mutex_);
    file_ = std::move(read);
  }
  const bool is_gone = absl::IsNotFound(status);
  if (!status.ok() && !absl::IsInvalidArgument(status) && !is_gone) {
    // Without a stamp it is read again: the cause may pass without a change of the file.
    const std::string failure = absl::StrCat(stamp, " ", status.ToString());
    return std::exchange(told_, failure) == failure ? absl::OkStatus() : status;
  }
  stamp_ = is_gone ? kMissing : stamp;
  told_.clear();
  return status;
}

absl::string_view BearerToken(absl::string_view authorization) {
  constexpr absl::string_view kScheme = "Bearer ";
  if (!absl::StartsWithIgnoreCase(authorization, kScheme)) return "";
  return absl::StripAsciiWhitespace(authorization.substr(kScheme.size()));
}

std::string HostOfPeer(absl::string_view peer) {
  absl::ConsumePrefix(&peer, "ipv4:");
  absl::ConsumePrefix(&peer, "ipv6:");
  const std::string host(peer.substr(0, peer.rfind(':')));
  return NetworkOfIpv6(host).value_or(host);
}

}  // namespace liquidblend::server
