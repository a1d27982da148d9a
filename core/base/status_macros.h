// Early returns for absl::Status and absl::StatusOr.
#pragma once

#include <utility>

#include "absl/status/status.h"
#include "absl/status/statusor.h"

#define LB_CONCAT_INNER(a, b) a##b
#define LB_CONCAT(a, b) LB_CONCAT_INNER(a, b)

// Returns the status of `expression` from the enclosing function unless it is OK.
#define LB_RETURN_IF_ERROR(expression)                            \
  do {                                                            \
    if (absl::Status lb_status = (expression); !lb_status.ok()) { \
      return lb_status;                                           \
    }                                                             \
  } while (false)

// Declares or assigns `lhs` from a StatusOr, or returns its status from the enclosing function.
// `lhs` may be a declaration, so it cannot stand in parentheses.
// NOLINTBEGIN(bugprone-macro-parentheses)
#define LB_ASSIGN_OR_RETURN(lhs, expression) \
  LB_ASSIGN_OR_RETURN_IMPL(LB_CONCAT(lb_or_, __LINE__), lhs, expression)
#define LB_ASSIGN_OR_RETURN_IMPL(tmp, lhs, expression) \
  auto tmp = (expression);                             \
  if (!tmp.ok()) return std::move(tmp).status();       \
  lhs = *std::move(tmp)
// NOLINTEND(bugprone-macro-parentheses)
