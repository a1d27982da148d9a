// Signature Version 4 of Amazon's services, in the form of S3.
//
// Why not a library: Debian 12 has no package of the AWS SDK for C++. libcurl's CURLOPT_AWS_SIGV4
// makes no presigned URLs, and signs with the local clock only (s3_transport.h uses that of S3).
#pragma once

#include <cstddef>
#include <map>
#include <span>
#include <string>

#include "absl/strings/string_view.h"
#include "absl/time/time.h"

namespace liquidblend::store {

// Credentials by which requests to S3 are signed.
struct AwsCredentials {
  std::string access_key_id;
  std::string secret_access_key;
  std::string session_token;  // of temporary credentials; else empty
};

// The signed parts of a request to S3.
struct AwsRequest {
  std::string method;
  std::string host;                          // with the port, as in the Host header
  std::string path;                          // not encoded; begins with a slash
  std::map<std::string, std::string> query;  // not encoded
  std::string body_sha256;                   // in hexadecimal
};

// Whether UriEncode() encodes slashes.
enum class EncodeSlashes { kNo, kYes };
// Percent-encodes all bytes but A-Z a-z 0-9 - . _ ~, and slashes as `slashes` says.
std::string UriEncode(absl::string_view text, EncodeSlashes slashes);

// The query string of these parameters, encoded, in order: "a=1&b=2".
std::string EncodeQuery(const std::map<std::string, std::string>& query);

// The SHA-256 of the bytes, in hexadecimal.
std::string Sha256Hex(std::span<const std::byte> bytes);

// The ETag that S3 gives an object of one part: the MD5 of its bytes, in hexadecimal.
std::string Md5Hex(std::span<const std::byte> bytes);
// The ETag that S3 gives an object of several parts, from theirs: the MD5 of their MD5s, and their
// number; empty if one of them is not an MD5.
std::string EtagOfParts(std::span<const std::string> etags);

// The headers that sign a request: Authorization, x-amz-date, x-amz-content-sha256 and, with
// temporary credentials, x-amz-security-token.
std::map<std::string, std::string> SignRequest(const AwsRequest& request,
                                               const AwsCredentials& credentials,
                                               const std::string& region, absl::Time now);

// The query of a presigned request, which anyone may make without credentials until `expires`
// later: the request's own query and the signature, encoded. The body is not signed.
//   headers  beside Host, that must be sent with these values; names in lower case
// Requires: expires in [1 s, 7 days].
std::string PresignQuery(const AwsRequest& request,
                         const std::map<std::string, std::string>& headers,
                         const AwsCredentials& credentials, const std::string& region,
                         absl::Time now, absl::Duration expires);

}  // namespace liquidblend::store
