#include "server/base/guarded.h"

#include <gtest/gtest.h>

#include <new>
#include <stdexcept>

#include "tests/core/store/store_testing.h"

namespace liquidblend::server {
namespace {

using Code = absl::StatusCode;
using store::Fails;

TEST(Guarded, AStoreThatRefusesTheServerIsUnavailable) {
  const absl::Status refused = absl::PermissionDeniedError("PUT s3://bucket/key: HTTP status 403");
  EXPECT_THAT(Guarded([&] { return refused; }), Fails(Code::kUnavailable, "s3://bucket/key"));
  EXPECT_THAT(Guarded([&]() -> absl::StatusOr<int> { return refused; }),
              Fails(Code::kUnavailable, "s3://bucket/key"));
}

TEST(Guarded, ACallThatIsRefusedStaysSo) {
  const absl::Status refused = absl::PermissionDeniedError("no");
  EXPECT_THAT(Guarded([&] { return WithReason(refused, "SCOPE_MISSING"); }),
              Fails(Code::kPermissionDenied, "no"));
  EXPECT_THAT(Guarded([&] { return AtField("location", refused); }),
              Fails(Code::kPermissionDenied, "no"));
}

TEST(Guarded, WhatOthersThrowIsAnError) {
  EXPECT_THAT(Guarded([]() -> absl::Status { throw std::bad_alloc(); }),
              Fails(Code::kResourceExhausted, "memory"));
  EXPECT_THAT(Guarded([]() -> absl::Status { throw std::runtime_error("who knows"); }),
              Fails(Code::kInternal, "who knows"));
  EXPECT_EQ(*Guarded([]() -> absl::StatusOr<int> { return 7; }), 7);
}

}  // namespace
}  // namespace liquidblend::server
