#include "server/api/unary_methods.h"

#include <algorithm>
#include <iterator>
#include <utility>

#include "core/base/status_macros.h"
#include "server/api/handlers.h"

namespace liquidblend::server {
namespace {

using google::protobuf::Message;

// A handler of handlers.h as one of untyped messages.
template <auto kHandler>
struct Untyped;

template <typename Request, typename Response,
          absl::StatusOr<Response> (*kHandler)(Backends&, const Request&)>
struct Untyped<kHandler> {
  static MessagePtr NewRequest() { return std::make_unique<Request>(); }
  static absl::StatusOr<MessagePtr> Handle(Backends& backends, const Message& request,
                                           const Caller&) {
    LB_ASSIGN_OR_RETURN(Response response,
                        kHandler(backends, static_cast<const Request&>(request)));
    return std::make_unique<Response>(std::move(response));
  }
};

template <typename Request, typename Response,
          absl::StatusOr<Response> (*kHandler)(Backends&, const Request&, const Caller&)>
struct Untyped<kHandler> {
  static MessagePtr NewRequest() { return std::make_unique<Request>(); }
  static absl::StatusOr<MessagePtr> Handle(Backends& backends, const Message& request,
                                           const Caller& caller) {
    LB_ASSIGN_OR_RETURN(Response response,
                        kHandler(backends, static_cast<const Request&>(request), caller));
    return std::make_unique<Response>(std::move(response));
  }
};

template <auto kHandler>
constexpr UnaryMethod MethodOf(const Method& method, WorkPool Backends::*pool) {
  return {&method, pool, Untyped<kHandler>::NewRequest, Untyped<kHandler>::Handle};
}

constexpr UnaryMethod kUnaryMethods[] = {
    MethodOf<PresignUpload>(kPresignUpload, &Backends::transfers),
    MethodOf<PresignDownload>(kPresignDownload, &Backends::transfers),
    MethodOf<ReadFile>(kReadFile, &Backends::transfers),
    MethodOf<GetAnimation>(kGetAnimation, &Backends::io),
    MethodOf<GetAnimationFrame>(kGetAnimationFrame, &Backends::transfers),
    MethodOf<ListAnimations>(kListAnimations, &Backends::io),
    MethodOf<DeleteAnimation>(kDeleteAnimation, &Backends::io),
    MethodOf<RegisterFamily>(kRegisterFamily, &Backends::io),
    MethodOf<GetFamily>(kGetFamily, &Backends::io),
    MethodOf<ListFamilies>(kListFamilies, &Backends::io),
    MethodOf<RollbackFamily>(kRollbackFamily, &Backends::io),
    MethodOf<DeleteFamily>(kDeleteFamily, &Backends::io),
    MethodOf<ListOperations>(kListOperations, &Backends::io),
    MethodOf<GetOperation>(kGetOperation, &Backends::io),
    MethodOf<DeleteOperation>(kDeleteOperation, &Backends::io),
    MethodOf<CancelOperation>(kCancelOperation, &Backends::io)};

}  // namespace

const UnaryMethod* FindUnaryMethod(absl::string_view name) {
  const auto found =
      std::find_if(std::begin(kUnaryMethods), std::end(kUnaryMethods),
                   [&](const UnaryMethod& unary) { return unary.method->name == name; });
  return found == std::end(kUnaryMethods) ? nullptr : found;
}

}  // namespace liquidblend::server
