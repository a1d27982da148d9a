#include "liquidblend/client.h"

#include <utility>

#include "absl/strings/str_cat.h"
#include "client/src/client_impl.h"
#include "client/src/convert.h"
#include "client/src/names.h"
#include "client/src/pages.h"
#include "client/src/status_macros.h"

namespace liquidblend {
namespace {

template <typename Request>
Request NamedRequest(const std::string& name) {
  Request request;
  request.set_name(name);
  return request;
}

}  // namespace

Client::Client(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
Client::~Client() = default;

absl::StatusOr<std::unique_ptr<Client>> Client::Connect(const ConnectOptions& options) {
  LBC_RETURN_IF_ERROR(options.Validate());
  LBC_ASSIGN_OR_RETURN(std::unique_ptr<client::Servers> servers, client::Servers::Open(options));
  if (!servers->WaitForAny(options.connect_timeout)) {
    const std::string reason = servers->ExplainFailure(options.security.uses_tls());
    return absl::UnavailableError(absl::StrCat(
        "cannot reach a liquidblend server at ", options.target, " within ",
        absl::FormatDuration(options.connect_timeout), reason.empty() ? "" : ": ", reason));
  }
  return std::unique_ptr<Client>(new Client(std::make_unique<Impl>(options, std::move(servers))));
}

// ---- animations -------------------------------------------------------------------------------

absl::StatusOr<Animation> Client::GetAnimation(const std::string& name) {
  LBC_ASSIGN_OR_RETURN(
      const v1::Animation animation,
      impl_->Call(&Impl::Service::GetAnimation,
                  NamedRequest<v1::GetAnimationRequest>(client::ResourceName("animations", name))));
  return client::FromProto(animation);
}

absl::StatusOr<std::vector<Animation>> Client::ListAnimations() {
  std::vector<Animation> animations;
  const auto fetch = [&](const v1::ListAnimationsRequest& next) {
    return impl_->Call(&Impl::Service::ListAnimations, next);
  };
  const auto items = [](const auto& page) -> auto& { return page.animations(); };
  const auto take = [&](const v1::Animation& animation) -> absl::Status {
    LBC_ASSIGN_OR_RETURN(animations.emplace_back(), client::FromProto(animation));
    return absl::OkStatus();
  };
  LBC_RETURN_IF_ERROR(client::ForEachItem(v1::ListAnimationsRequest(), fetch, items, take));
  return animations;
}

absl::Status Client::DeleteAnimation(const std::string& name) {
  return impl_->CallDelete(
      &Impl::Service::DeleteAnimation,
      NamedRequest<v1::DeleteAnimationRequest>(client::ResourceName("animations", name)));
}

// ---- families ---------------------------------------------------------------------------------

absl::StatusOr<Operation> Client::RegisterFamily(const RegisterRequest& request) {
  LBC_RETURN_IF_ERROR(request.options.Validate());
  LBC_RETURN_IF_ERROR(request.space_time.Validate());
  v1::RegisterFamilyRequest proto = client::ToProto(request);
  proto.set_request_id(client::MakeRequestId());
  LBC_ASSIGN_OR_RETURN(
      const google::longrunning::Operation operation,
      impl_->Submit(&Impl::Service::RegisterFamily, proto, impl_->options.call_timeout));
  return client::FromProto(operation);
}

absl::StatusOr<Family> Client::GetFamily(const std::string& name, int64_t version) {
  auto request = NamedRequest<v1::GetFamilyRequest>(client::ResourceName("families", name));
  request.set_version(version);
  LBC_ASSIGN_OR_RETURN(const v1::Family family, impl_->Call(&Impl::Service::GetFamily, request));
  LBC_RETURN_IF_ERROR(client::CheckVersion(version, family.version()));
  impl_->known_versions.Note(family.name(), family.version());
  return client::FromProto(family);
}

absl::StatusOr<std::vector<Family>> Client::ListFamilies() {
  std::vector<Family> families;
  const auto fetch = [&](const v1::ListFamiliesRequest& next) {
    return impl_->Call(&Impl::Service::ListFamilies, next);
  };
  const auto items = [](const auto& page) -> auto& { return page.families(); };
  const auto take = [&](const v1::Family& family) -> absl::Status {
    impl_->known_versions.Note(family.name(), family.version());
    LBC_ASSIGN_OR_RETURN(families.emplace_back(), client::FromProto(family));
    return absl::OkStatus();
  };
  LBC_RETURN_IF_ERROR(client::ForEachItem(v1::ListFamiliesRequest(), fetch, items, take));
  return families;
}

absl::StatusOr<Family> Client::RollbackFamily(const std::string& name, int64_t version) {
  auto request = NamedRequest<v1::RollbackFamilyRequest>(client::ResourceName("families", name));
  request.set_version(version);
  LBC_ASSIGN_OR_RETURN(const v1::Family family,
                       impl_->Call(&Impl::Service::RollbackFamily, request));
  impl_->known_versions.Note(family.name(), family.version());
  return client::FromProto(family);
}

absl::Status Client::DeleteFamily(const std::string& name) {
  impl_->known_versions.Forget(client::ResourceName("families", name));
  return impl_->CallDelete(
      &Impl::Service::DeleteFamily,
      NamedRequest<v1::DeleteFamilyRequest>(client::ResourceName("families", name)));
}

// ---- frames -----------------------------------------------------------------------------------

absl::StatusOr<Frame> Client::GetFrame(const FrameRequest& request) {
  v1::GetFrameRequest proto = client::ToProto(request);
  if (proto.min_version() == 0) proto.set_min_version(impl_->known_versions.Of(proto.family()));
  absl::StatusOr<v1::Frame> frame = impl_->Call(&Impl::Service::GetFrame, proto);
  if (absl::IsNotFound(frame.status())) impl_->known_versions.Forget(proto.family());
  if (!frame.ok()) return frame.status();
  return client::FromProto(*std::move(frame));
}

}  // namespace liquidblend
