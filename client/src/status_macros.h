// Early returns for absl::Status and absl::StatusOr, for the client's own sources.
#pragma once

#include <utility>

#include "absl/status/status.h"
#include "absl/status/statusor.h"

#define LBC_CONCAT_INNER(a, b) a##b
#define LBC_CONCAT(a, b) LBC_CONCAT_INNER(a, b)

// Returns the status of `expression` from the enclosing function unless it is OK.
#define LBC_RETURN_IF_ERROR(expression)                             \
  do {                                                              \
    if (absl::Status lbc_status = (expression); !lbc_status.ok()) { \
      return lbc_status;                                            \
    }                                                               \
  } while (false)

// Declares or assigns `lhs` from a StatusOr, or returns its status from the enclosing function.
// `lhs` may be a declaration, so it cannot stand in parentheses.
// NOLINTBEGIN(bugprone-macro-parentheses)
#define LBC_ASSIGN_OR_RETURN(lhs, expression) \
  LBC_ASSIGN_OR_RETURN_IMPL(LBC_CONCAT(lbc_or_, __LINE__), lhs, expression)
#define LBC_ASSIGN_OR_RETURN_IMPL(tmp, lhs, expression) \
  auto tmp = (expression);                              \
  if (!tmp.ok()) return std::move(tmp).status();        \
  lhs = *std::move(tmp)
// NOLINTEND(bugprone-macro-parentheses)
