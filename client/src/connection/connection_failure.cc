#include "client/src/connection/connection_failure.h"

#include "absl/strings/ascii.h"
#include "absl/strings/match.h"

namespace liquidblend::client {
namespace {

bool Has(const std::string& words, const char* part) { return absl::StrContains(words, part); }

// In lower case.
std::string ExplainTlsFailure(const std::string& words) {
  if (Has(words, "wrong_version_number") || Has(words, "wrong version number")) {
    return "it answers without TLS: leave out --tls and --tls-ca, or start it with --tls-cert and "
           "--tls-key";
  }
  if (Has(words, "certificate_verify_failed") || Has(words, "certificate verify failed")) {
    return "none of the trusted authorities has signed its certificate, or it has expired: give "
           "--tls-ca the file of the authority that has";
  }
  if (Has(words, "peer name")) {
    return "its certificate is for another name: connect to that name, or give it with "
           "--tls-server-name";
  }
  if (Has(words, "certificate required") || Has(words, "certificate_required") ||
      Has(words, "handshake failure") || Has(words, "bad certificate")) {
    return "it refuses this client's certificate, or wants one: see --tls-cert and --tls-key";
  }
  return "";
}

}  // namespace

std::string ExplainConnectionFailure(absl::string_view grpc_words, bool uses_tls) {
  const std::string words = absl::AsciiStrToLower(grpc_words);
  if (Has(words, "connection refused")) {
    return "nothing listens there: is the server running, and is the port right?";
  }
  if (Has(words, "dns resolution failed")) {
    return "no host of that name is known";
  }
  if (Has(words, "timed out") || Has(words, "timeout") || Has(words, "deadline exceeded")) {
    return "nothing answers there: is the server stopped or overloaded, or a firewall in between?";
  }
  if (uses_tls) return ExplainTlsFailure(words);
  if (Has(words, "socket closed") || Has(words, "connection reset") || Has(words, "preface") ||
      Has(words, "settings frame") || Has(words, "endpoint closed")) {
    return "it ends the connection, as a server does that wants TLS: give --tls-ca FILE, or --tls";
  }
  return "";
}

}  // namespace liquidblend::client
