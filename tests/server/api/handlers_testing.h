// What tests of the service's methods ask, with one thing changed at a time.
#pragma once

#include <functional>

#include "server/api/handlers.h"
#include "tests/server/backends_testing.h"

namespace liquidblend::server {

class HandlersTest : public RpcTest {
 protected:
  HandlersTest() : backends_(*catalog_, *blobs_, families_, SmallBackends()) {}

  static v1::RegisterFamilyRequest Registration() {
    v1::RegisterFamilyRequest request;
    request.set_family_id("splash");
    request.set_source("animations/a");
    request.add_targets("animations/b");
    return request;
  }

  // A registration with one thing changed.
  absl::Status Register(const std::function<void(v1::RegisterFamilyRequest&)>& change) {
    v1::RegisterFamilyRequest request = Registration();
    change(request);
    return RegisterFamily(backends_, request).status();
  }

  absl::Status RegisterWith(const std::function<void(v1::Correspondence&)>& change) {
    return Register([&](v1::RegisterFamilyRequest& request) {
      v1::Correspondence& correspondence = *request.add_correspondences()->add_correspondences();
      correspondence.set_kind(v1::Correspondence::POINT);
      correspondence.mutable_source()->mutable_position()->set_x(1);
      correspondence.mutable_target()->mutable_position()->set_x(2);
      change(correspondence);
    });
  }

  absl::StatusOr<v1::Frame> Frame(const std::function<void(v1::GetFrameRequest&)>& change) {
    v1::GetFrameRequest request;
    request.set_family("families/splash");
    request.add_weights(0.5);
    request.set_time_s(0.1);
    change(request);
    return GetFrame(backends_, request);
  }

  absl::Status Stream(const std::function<void(v1::StreamFramesRequest&)>& change) {
    v1::StreamFramesRequest request;
    request.set_family("families/splash");
    request.add_weights(0.5);
    change(request);
    SimpleStream stream(families_);
    return stream.Change(request);
  }

  Backends backends_;
};

}  // namespace liquidblend::server
