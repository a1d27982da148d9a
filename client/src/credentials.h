// Credentials of a channel: certificates and trusted authorities.
#pragma once

#include <grpcpp/security/credentials.h>

#include <memory>
#include <string>

#include "absl/status/statusor.h"
#include "liquidblend/security.h"

namespace liquidblend::client {

// Errors: kNotFound if a file cannot be read, kInvalidArgument if it is no regular file of at most
// 1 MiB with a PEM block of its kind; by name.
absl::StatusOr<std::shared_ptr<grpc::ChannelCredentials>> CredentialsOf(
    const SecurityOptions& options);

// Errors: kInvalidArgument if a token would be sent to `target` unencrypted.
absl::Status CheckTokenIsSafe(const SecurityOptions& options, const std::string& target);

}  // namespace liquidblend::client
