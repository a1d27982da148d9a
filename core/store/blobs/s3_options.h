// Options of a blob store in S3: endpoint, credentials, cache, retries and timeouts.
#pragma once

#include <cstdint>
#include <string>

#include "absl/status/status.h"
#include "absl/time/time.h"

namespace liquidblend::store {

// Options of S3. FillFromEnvironment() sets a field from the environment variable that its comment
// names: strings if they are empty, numbers and durations whenever the variable is set.
struct S3Options {
  std::string endpoint;  // http(s)://host[:port]; AWS_ENDPOINT_URL_S3, AWS_ENDPOINT_URL
  // The endpoint by which clients of the server reach S3; empty: they get no urls.
  std::string client_endpoint = {};
  std::string region;  // AWS_REGION, AWS_DEFAULT_REGION, us-east-1
  // Without a key id: the credentials that AwsCredentialsProvider finds, which are read again when
  // S3 refuses them.
  std::string access_key_id;
  std::string secret_access_key;
  std::string session_token;
  std::string ca_file;                                   // AWS_CA_BUNDLE
  std::string cache_directory;                           // not empty; blobs in use lie here
  int64_t cache_bytes = int64_t{64} << 30;               // >= 0; beside what is in use now
  int max_attempts = 6;                                  // >= 1; of a request
  absl::Duration first_pause = absl::Milliseconds(100);  // > 0; doubles with each attempt ...
  absl::Duration longest_pause = absl::Seconds(5);       // >= first_pause; ... up to this
  // >= 1 ms; until a connection is established; LIQUIDBLEND_S3_CONNECT_TIMEOUT
  absl::Duration connect_timeout = absl::Seconds(5);
  // >= connect_timeout; of a request that makes no progress; LIQUIDBLEND_S3_STALL_TIMEOUT
  absl::Duration stall_timeout = absl::Seconds(20);
  // >= 0, at least three stall timeouts count; time for S3 to assemble the parts of an upload,
  // during which it sends only spaces to keep the connection
  absl::Duration complete_timeout = absl::Minutes(10);
  // >= 1 KiB; larger blobs are sent and fetched in parts of this size. Amazon accepts no part below
  // 5 MiB but the last, other stores may; LIQUIDBLEND_S3_PART_BYTES
  int64_t part_bytes = int64_t{16} << 20;
  int num_parallel = 4;           // 1 to 64; parts on their way at once
  absl::Status Validate() const;  // names the first field out of range, and its value

  // Fills fields that are not set from the environment variables that are named above, credentials
  // apart.
  // Errors: kInvalidArgument for a variable that is not a number or duration, naming it.
  absl::Status FillFromEnvironment();

  // The pause after so many failed attempts in a row, before jitter; four times as long if S3
  // answers SlowDown.  Requires: num_failures >= 1.
  absl::Duration PauseAfter(int num_failures, bool is_slow_down) const;
};

}  // namespace liquidblend::store
