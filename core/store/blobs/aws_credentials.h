// Credentials for S3: their sources and renewal.
#pragma once

#include <functional>
#include <optional>
#include <string>

#include "absl/base/thread_annotations.h"
#include "absl/status/statusor.h"
#include "absl/synchronization/mutex.h"
#include "absl/time/clock.h"
#include "absl/time/time.h"
#include "core/store/blobs/aws_signer.h"
#include "core/store/blobs/http_client.h"

namespace liquidblend::store {

// Credentials of a source, and when they expire.
struct FoundCredentials {
  AwsCredentials credentials;
  absl::Time expires = absl::InfiniteFuture();
};

// Reads the section of a shared credentials file (ini); nothing if the text has no such section.
// Fields that the section does not have are empty.
std::optional<AwsCredentials> ParseCredentialsFile(const std::string& text,
                                                   const std::string& section);
// Reads a document (JSON) of the container's or the instance's endpoint; nothing if it has no key.
// Key id and token, which go into headers, have no control characters.
std::optional<FoundCredentials> ParseEndpointCredentials(const std::string& json);

// Reads AWS_ACCESS_KEY_ID, AWS_SECRET_ACCESS_KEY and AWS_SESSION_TOKEN. This and the following
// functions read one source each; nothing if the source is not configured. Errors, which name the
// source and never a secret: kUnavailable if it is configured and does not answer, or cannot be
// read.
absl::StatusOr<std::optional<FoundCredentials>> CredentialsFromEnvironment();
// Reads AWS_SHARED_CREDENTIALS_FILE (~/.aws/credentials), the section AWS_PROFILE (default).
absl::StatusOr<std::optional<FoundCredentials>> CredentialsFromFile();
// Asks the container's endpoint: AWS_CONTAINER_CREDENTIALS_FULL_URI or _RELATIVE_URI, with
// AWS_CONTAINER_AUTHORIZATION_TOKEN_FILE or AWS_CONTAINER_AUTHORIZATION_TOKEN. A full URI must be
// https, or of this host.
absl::StatusOr<std::optional<FoundCredentials>> CredentialsFromContainer(HttpClient& http);
// Asks the instance metadata service, version 2, at AWS_EC2_METADATA_SERVICE_ENDPOINT
// (http://169.254.169.254), unless AWS_EC2_METADATA_DISABLED is "true". An instance without a role
// is kUnavailable: it may get one.
absl::StatusOr<std::optional<FoundCredentials>> CredentialsFromInstance(HttpClient& http);

// Provider of the credentials of the first source that has some: given ones, the environment, the
// shared file, the container's endpoint, the instance's. Web identity tokens are not supported.
// Threads: safe; calls wait while another one reads a source.
class AwsCredentialsProvider {
 public:
  //   given  with an empty access_key_id: there are none
  //   now    the clock; called by any thread
  explicit AwsCredentialsProvider(AwsCredentials given,
                                  std::function<absl::Time()> now = absl::Now);

  // Returns credentials that are valid now. Temporary ones are renewed from five minutes before
  // they expire on; while that fails, the old ones are used up to their end. Errors:
  // kInvalidArgument if no source is configured; kUnavailable as above, and if a source may be
  // configured soon (~/.aws exists, or the instance may get a role); kPermissionDenied if the
  // credentials have expired.
  absl::StatusOr<AwsCredentials> Get() ABSL_LOCKS_EXCLUDED(mutex_);

  // Reads the sources again after S3 refused these credentials, at most once a second, however many
  // requests are refused. Returns whether Get() returns others now.
  bool Renew(const AwsCredentials& refused) ABSL_LOCKS_EXCLUDED(mutex_);

 private:
  absl::StatusOr<FoundCredentials> Read();
  absl::Status Update() ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);

  const AwsCredentials given_;
  const std::function<absl::Time()> now_;
  HttpClient http_;
  absl::Mutex mutex_;
  std::optional<FoundCredentials> current_ ABSL_GUARDED_BY(mutex_);
  absl::Time read_at_ ABSL_GUARDED_BY(mutex_) = absl::InfinitePast();
  absl::Status read_error_ ABSL_GUARDED_BY(mutex_);                       // of the last time
  absl::Time renewed_at_ ABSL_GUARDED_BY(mutex_) = absl::InfinitePast();  // by Renew()
};

}  // namespace liquidblend::store
