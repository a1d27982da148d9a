#include "core/store/blobs/aws_signer.h"

#include <openssl/evp.h>
#include <openssl/hmac.h>

#include <algorithm>
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

// The signed headers in a canonical request: a line each, and their names.
struct SignedHeaders {
  explicit SignedHeaders(const std::map<std::string, std::string>& headers) {
    for (const auto& [name, value] : headers) {
      absl::StrAppend(&lines, name, ":", value, "\n");
      absl::StrAppend(&names, names.empty() ? "" : ";", name);
    }
  }
  std::string lines;
  std::string names;
};

// Time and place that a signature is for.
struct Scope {
  Scope(const std::string& in_region, absl::Time now)
      : time(absl::FormatTime("%Y%m%dT%H%M%SZ", now, absl::UTCTimeZone())), region(in_region) {}
  std::string day() const { return time.substr(0, 8); }
  std::string Name() const { return absl::StrCat(day(), "/", region, "/s3/aws4_request"); }
  std::string time;
  std::string region;
};

// "Signature Version 4 signing process": canonical request, string to sign, derived key.
std::string SignatureOf(const AwsRequest& request, const SignedHeaders& headers,
                        const std::string& secret, const Scope& scope) {
  const std::string canonical =
      absl::StrCat(request.method, "\n", UriEncode(request.path, EncodeSlashes::kNo), "\n",
                   EncodeQuery(request.query), "\n", headers.lines, "\n", headers.names, "\n",
                   request.body_sha256);
  const std::string to_sign =
      absl::StrCat("AWS4-HMAC-SHA256\n", scope.time, "\n", scope.Name(), "\n",
                   Sha256Hex(std::as_bytes(std::span(canonical.data(), canonical.size()))));
  std::string key = absl::StrCat("AWS4", secret);
  for (const std::string& part :
       {scope.day(), scope.region, std::string("s3"), std::string("aws4_request")}) {
    key = Hmac(key, part);
  }
  return absl::BytesToHexString(Hmac(key, to_sign));
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

std::string Md5Hex(std::span<const std::byte> bytes) {
  std::array<char, 16> digest = {};
  EVP_Digest(bytes.data(), bytes.size(), reinterpret_cast<unsigned char*>(digest.data()), nullptr,
             EVP_md5(), nullptr);
  return absl::BytesToHexString(absl::string_view(digest.data(), digest.size()));
}

std::string EtagOfParts(std::span<const std::string> etags) {
  std::string digests;
  for (const std::string& etag : etags) {
    const bool is_md5 = etag.size() == 32 && std::all_of(etag.begin(), etag.end(), [](char c) {
                          return absl::ascii_isxdigit(static_cast<unsigned char>(c));
                        });
    if (!is_md5) return "";
    digests += absl::HexStringToBytes(etag);
  }
  return absl::StrCat(Md5Hex(std::as_bytes(std::span(digests.data(), digests.size()))), "-",
                      etags.size());
}

std::map<std::string, std::string> SignRequest(const AwsRequest& request,
                                               const AwsCredentials& credentials,
                                               const std::string& region, absl::Time now) {
  const Scope scope(region, now);
  std::map<std::string, std::string> headers = {{"host", request.host},
                                                {"x-amz-content-sha256", request.body_sha256},
                                                {"x-amz-date", scope.time}};
  if (!credentials.session_token.empty()) {
    headers["x-amz-security-token"] = credentials.session_token;
  }
  const SignedHeaders signed_headers(headers);
  headers["Authorization"] = absl::StrCat(
      "AWS4-HMAC-SHA256 Credential=", credentials.access_key_id, "/", scope.Name(),
      ", SignedHeaders=", signed_headers.names,
      ", Signature=", SignatureOf(request, signed_headers, credentials.secret_access_key, scope));
  return headers;
}

// "Authenticating requests: using query parameters".
std::string PresignQuery(const AwsRequest& request,
                         const std::map<std::string, std::string>& headers,
                         const AwsCredentials& credentials, const std::string& region,
                         absl::Time now, absl::Duration expires) {
  const Scope scope(region, now);
  std::map<std::string, std::string> all = headers;
  all["host"] = request.host;
  const SignedHeaders signed_headers(all);
  AwsRequest to_sign = request;
  to_sign.body_sha256 = "UNSIGNED-PAYLOAD";
  to_sign.query["X-Amz-Algorithm"] = "AWS4-HMAC-SHA256";
  to_sign.query["X-Amz-Credential"] = absl::StrCat(credentials.access_key_id, "/", scope.Name());
  to_sign.query["X-Amz-Date"] = scope.time;
  to_sign.query["X-Amz-Expires"] = absl::StrCat(absl::ToInt64Seconds(expires));
  to_sign.query["X-Amz-SignedHeaders"] = signed_headers.names;
  if (!credentials.session_token.empty()) {
    to_sign.query["X-Amz-Security-Token"] = credentials.session_token;
  }
  return absl::StrCat(EncodeQuery(to_sign.query), "&X-Amz-Signature=",
                      SignatureOf(to_sign, signed_headers, credentials.secret_access_key, scope));
}

}  // namespace liquidblend::store
