#include "core/store/aws_signer.h"

#include <openssl/evp.h>
#include <openssl/hmac.h>

#include <array>

#include "absl/strings/ascii.h"
#include "absl/strings/escaping.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"

namespace liquidblend::store {
namespace {

using Digest = std::array<unsigned char, 32>;

std::string Hex(const Digest& digest) {
  return absl::BytesToHexString(
      absl::string_view(reinterpret_cast<const char*>(digest.data()), digest.size()));
}

std::string Hmac(absl::string_view key, absl::string_view text) {
  Digest digest = {};
  HMAC(EVP_sha256(), key.data(), static_cast<int>(key.size()),
       reinterpret_cast<const unsigned char*>(text.data()), text.size(), digest.data(), nullptr);
  return std::string(reinterpret_cast<const char*>(digest.data()), digest.size());
}

}  // namespace

std::string UriEncode(absl::string_view text, EncodeSlashes slashes) {
  std::string encoded;
  for (const char c : text) {
    const bool is_plain = absl::ascii_isalnum(static_cast<unsigned char>(c)) || c == '-' ||
                          c == '.' || c == '_' || c == '~' ||
                          (c == '/' && slashes == EncodeSlashes::kNo);
    if (is_plain) {
      encoded.push_back(c);
    } else {
      absl::StrAppendFormat(&encoded, "%%%02X", static_cast<unsigned char>(c));
    }
  }
  return encoded;
}

std::string EncodeQuery(const std::map<std::string, std::string>& query) {
  std::string encoded;
  for (const auto& [name, value] : query) {
    absl::StrAppend(&encoded, encoded.empty() ? "" : "&", UriEncode(name, EncodeSlashes::kYes), "=",
                    UriEncode(value, EncodeSlashes::kYes));
  }
  return encoded;
}

std::string Sha256Hex(std::span<const std::byte> bytes) {
  Digest digest = {};
  EVP_Digest(bytes.data(), bytes.size(), digest.data(), nullptr, EVP_sha256(), nullptr);
  return Hex(digest);
}

// "Signature Version 4 signing process": canonical request, string to sign, derived key.
std::map<std::string, std::string> SignRequest(const AwsRequest& request,
                                               const AwsCredentials& credentials,
                                               const std::string& region, absl::Time now) {
  const std::string time = absl::FormatTime("%Y%m%dT%H%M%SZ", now, absl::UTCTimeZone());
  const std::string day = time.substr(0, 8);
  std::map<std::string, std::string> headers = {
      {"host", request.host}, {"x-amz-content-sha256", request.body_sha256}, {"x-amz-date", time}};
  if (!credentials.session_token.empty()) {
    headers["x-amz-security-token"] = credentials.session_token;
  }
  std::string lines;
  std::string names;
  for (const auto& [name, value] : headers) {
    absl::StrAppend(&lines, name, ":", value, "\n");
    absl::StrAppend(&names, names.empty() ? "" : ";", name);
  }
  const std::string canonical =
      absl::StrCat(request.method, "\n", UriEncode(request.path, EncodeSlashes::kNo), "\n",
                   EncodeQuery(request.query), "\n", lines, "\n", names, "\n", request.body_sha256);
  const std::string scope = absl::StrCat(day, "/", region, "/s3/aws4_request");
  const std::string to_sign =
      absl::StrCat("AWS4-HMAC-SHA256\n", time, "\n", scope, "\n",
                   Sha256Hex(std::as_bytes(std::span(canonical.data(), canonical.size()))));
  std::string key = absl::StrCat("AWS4", credentials.secret_access_key);
  for (const std::string& part : {day, region, std::string("s3"), std::string("aws4_request")}) {
    key = Hmac(key, part);
  }
  headers["Authorization"] = absl::StrCat(
      "AWS4-HMAC-SHA256 Credential=", credentials.access_key_id, "/", scope,
      ", SignedHeaders=", names, ", Signature=", absl::BytesToHexString(Hmac(key, to_sign)));
  return headers;
}

}  // namespace liquidblend::store
