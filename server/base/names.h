// Resource names: animations/{id}, families/{id}, operations/{id}. Requests may give the id alone.
#pragma once

#include <string>

#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"

namespace liquidblend::server {

// Whether `id` may name an animation or a family: [a-z0-9][a-z0-9_.-]{0,62}.
bool IsResourceId(absl::string_view id);

// The id in a name. Errors: kInvalidArgument with a violation of `field`.
absl::StatusOr<std::string> AnimationId(absl::string_view field, absl::string_view name);
absl::StatusOr<std::string> FamilyId(absl::string_view field, absl::string_view name);
absl::StatusOr<std::string> OperationId(absl::string_view field, absl::string_view name);

// The name of an id; a name stays as it is.
std::string AnimationName(absl::string_view id);
std::string FamilyName(absl::string_view id);
std::string OperationName(absl::string_view id);

}  // namespace liquidblend::server
