// What a channel shows and believes.
#pragma once

#include <grpcpp/security/credentials.h>

#include <memory>
#include <string>

#include "absl/status/statusor.h"
#include "liquidblend/security.h"

namespace liquidblend::client {

// Errors: kNotFound if a file cannot be read, by name.
absl::StatusOr<std::shared_ptr<grpc::ChannelCredentials>> CredentialsOf(
    const SecurityOptions& options);

// OK, or kInvalidArgument if a token would go to `target` for everyone to read.
absl::Status CheckTokenIsSafe(const SecurityOptions& options, const std::string& target);

}  // namespace liquidblend::client
