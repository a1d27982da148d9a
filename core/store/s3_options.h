// Where blobs are in S3, and how hard to try.
#pragma once

#include <cstdint>
#include <string>

#include "absl/status/status.h"
#include "absl/time/time.h"

namespace liquidblend::store {

// Empty strings stand for the environment variable that is named, if it is set.
struct S3Options {
  std::string endpoint;  // http(s)://host[:port]; AWS_ENDPOINT_URL_S3, AWS_ENDPOINT_URL
  // The same as clients of the server reach it; empty: they are given no urls.
  std::string client_endpoint = {};
  std::string region;                       // AWS_REGION, AWS_DEFAULT_REGION, us-east-1
  std::string access_key_id;                // AWS_ACCESS_KEY_ID
  std::string secret_access_key;            // AWS_SECRET_ACCESS_KEY
  std::string session_token;                // AWS_SESSION_TOKEN
  std::string ca_file;                      // AWS_CA_BUNDLE
  std::string cache_directory;              // not empty; blobs in use lie here
  int64_t cache_bytes = int64_t{64} << 30;  // >= 0; beside what is in use now
  int max_attempts = 6;                     // >= 1; of a request
  absl::Duration first_pause = absl::Milliseconds(100);  // > 0; doubles with each attempt ...
  absl::Duration longest_pause = absl::Seconds(5);       // >= first_pause; ... up to this
  int64_t part_bytes = int64_t{16} << 20;  // >= 5 MiB; larger blobs are sent and got in such parts
  int num_parallel = 4;                    // 1 to 64; parts on their way at once
  absl::Status Validate() const;           // names the first field out of range, and its value
};

}  // namespace liquidblend::store
