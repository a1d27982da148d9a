#include "client/src/credentials.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <string>

#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "client/src/connection/loopback.h"
#include "client/src/status_macros.h"

namespace liquidblend::client {
namespace {

constexpr size_t kMaxPemBytes = 1 << 20;  // a system's authorities are a fifth of that

class OpenFile {
 public:
  // Without `waits` it does not wait for a FIFO's other end.
  OpenFile(const std::string& path, bool waits)
      : descriptor_(::open(path.c_str(), O_RDONLY | O_CLOEXEC | (waits ? 0 : O_NONBLOCK))) {}
  ~OpenFile() {
    if (descriptor_ >= 0) ::close(descriptor_);
  }
  OpenFile(const OpenFile&) = delete;
  OpenFile& operator=(const OpenFile&) = delete;

  bool is_open() const { return descriptor_ >= 0; }
  bool IsRegular() const {
    struct stat about;
    return ::fstat(descriptor_, &about) == 0 && S_ISREG(about.st_mode);
  }
  // Appends the rest of the file, up to `max_bytes`; false: errno says why.
  bool Read(size_t max_bytes, std::string& text) const {
    char chunk[16 << 10];
    while (text.size() < max_bytes) {
      const ssize_t count =
          ::read(descriptor_, chunk, std::min(sizeof chunk, max_bytes - text.size()));
      if (count == 0) return true;
      if (count > 0) text.append(chunk, static_cast<size_t>(count));
      if (count < 0 && errno != EINTR) return false;
    }
    return true;
  }

 private:
  const int descriptor_;
};

// Who chooses the path of a file.
enum class Chosen {
  kByAnyone,  // a scene's file, too: it may name a device or a FIFO that has no end
  kByUser,    // it may be a pipe, of a program that knows a secret
};

// The text of a PEM file that has a `label`, such as "CERTIFICATE"; "" of "". gRPC would not tell a
// wrong file from a server that does not answer.
absl::StatusOr<std::string> ReadPem(const char* field, const char* label, const std::string& path,
                                    Chosen chosen) {
  if (path.empty()) return std::string();
  const auto invalid = [&](const std::string& what) {
    return absl::InvalidArgumentError(absl::StrCat(field, ": ", path, " ", what));
  };
  const auto unreadable = [&] {
    const std::string why = std::strerror(errno);
    return absl::NotFoundError(absl::StrCat(field, ": ", path, " cannot be read: ", why));
  };
  const OpenFile file(path, /*waits=*/chosen == Chosen::kByUser);
  if (!file.is_open()) return unreadable();
  if (chosen == Chosen::kByAnyone && !file.IsRegular()) return invalid("is no regular file");
  std::string text;
  if (!file.Read(kMaxPemBytes + 1, text)) return unreadable();
  if (text.size() > kMaxPemBytes) return invalid("is larger than 1 MiB");
  if (absl::StrContains(text, absl::StrCat(label, "-----"))) return text;
  return invalid(absl::StrCat("has no PEM block of a ", label));
}

}  // namespace

absl::StatusOr<std::shared_ptr<grpc::ChannelCredentials>> CredentialsOf(
    const SecurityOptions& options) {
  if (!options.uses_tls()) return grpc::InsecureChannelCredentials();
  grpc::SslCredentialsOptions ssl;
  LBC_ASSIGN_OR_RETURN(ssl.pem_root_certs,
                       ReadPem("tls_ca", "CERTIFICATE", options.tls_ca, Chosen::kByAnyone));
  LBC_ASSIGN_OR_RETURN(ssl.pem_cert_chain,
                       ReadPem("tls_cert", "CERTIFICATE", options.tls_cert, Chosen::kByUser));
  LBC_ASSIGN_OR_RETURN(ssl.pem_private_key,
                       ReadPem("tls_key", "PRIVATE KEY", options.tls_key, Chosen::kByUser));
  return grpc::SslCredentials(ssl);
}

absl::Status CheckTokenIsSafe(const SecurityOptions& options, const std::string& target) {
  if (options.token.empty() || options.uses_tls() || IsThisMachine(target)) {
    return absl::OkStatus();
  }
  return absl::InvalidArgumentError(absl::StrCat("token: without TLS it would go to ", target,
                                                 " for everyone on the way to read"));
}

}  // namespace liquidblend::client
