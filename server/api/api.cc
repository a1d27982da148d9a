#include "server/api/api.h"

#include <utility>

#include "core/base/log.h"
#include "core/base/status_macros.h"
#include "server/api/handlers.h"
#include "server/api/import_animation.h"
#include "server/base/guarded.h"
#include "server/base/names.h"
#include "server/frames/backends.h"
#include "server/frames/get_frame.h"
#include "server/probes/probes.h"

namespace liquidblend::server {
namespace {

// Runs the delivery of an answer, whose exceptions must not end the thread.
template <typename Tell>
void Deliver(const Tell& tell) {
  const absl::Status delivered = Guarded([&] {
    tell();
    return absl::OkStatus();
  });
  if (!delivered.ok()) base::LogError("an answer is lost: " + delivered.ToString());
}

absl::StatusOr<MadeFrame> ToFrame(const absl::StatusOr<AnsweredFrame>& made) {
  LB_RETURN_IF_ERROR(made.status());
  MadeFrame result;
  if (!result.frame.ParseFromString(*made->bytes)) {
    return absl::InternalError("the bytes of a frame do not parse as Frame");
  }
  result.generation = made->generation;
  return result;
}

absl::StatusOr<FamilyVersion> FindPublished(Backends& backends, const std::string& id) {
  LB_ASSIGN_OR_RETURN(const store::pb::FamilyRecord record, backends.catalog.GetFamily(id));
  return FamilyVersion{record.version(), liquidblend::catalog::GenerationOf(record)};
}

class PooledApi final : public Api {
 public:
  PooledApi(Backends& backends, AccessController& access_controller,
            const ImportRoots& import_roots)
      : backends_(backends), access_controller_(access_controller), import_roots_(import_roots) {}

  absl::Status Admit(const Credentials& credentials, const AccessRequest& access,
                     AccessGrant& grant) override {
    return access_controller_.Admit(credentials, access, grant);
  }

  Cancel GetFrame(v1::GetFrameRequest request, std::string client, trace::Span span,
                  Done<MadeFrame> done) override {
    const auto call = FrameCall::Start(
        backends_, request, std::move(client),
        [done = std::move(done)](const absl::StatusOr<AnsweredFrame>& made) mutable {
          Deliver([&] { done(Guarded([&] { return ToFrame(made); })); });
        },
        std::move(span));
    return [call] { call->Cancel(); };
  }
  void FindVersion(const std::string& family, int64_t version, Done<FamilyVersion> done) override {
    const absl::StatusOr<std::string> id = FamilyId("family", family);
    if (!id.ok()) return done(id.status());
    const auto loaded = version == 0 ? nullptr : backends_.families.Peek(*id, version);
    if (loaded != nullptr) return done(FamilyVersion{version, loaded->generation});
    Answer(
        backends_.io, [this, id = *id] { return FindPublished(backends_, id); }, std::move(done));
  }
  void Call(const Method& method, const Caller& caller, Read read, IsWanted is_wanted,
            Done<MessagePtr> done) override {
    auto call = std::make_shared<OpenCall>(
        OpenCall{caller, std::move(read), std::move(is_wanted), std::move(done)});
    const UnaryMethod* unary = FindUnaryMethod(method.name);
    WorkPool& pool = unary == nullptr ? backends_.io : backends_.*unary->pool;
    const absl::Status accepted = pool.Post([this, unary, &method, call] {
      const absl::Status begun =
          Guarded([&] { return unary == nullptr ? Begin(method, call) : Finish(*unary, *call); });
      if (!begun.ok()) Deliver([&] { call->done(begun); });
    });
    if (!accepted.ok()) call->done(accepted);
  }
  NextOperation WatchOperation(const std::string& name, IsWanted is_wanted) override {
    const auto watch = std::make_shared<OperationWatch>(backends_, name, std::move(is_wanted));
    return [watch](Done<SeenOperationPtr> done) { watch->Next(std::move(done)); };
  }
  std::shared_ptr<ArchiveUpload> OpenUpload(v1::UploadAnimationRequest header,
                                            const Caller& caller) override {
    return OpenArchiveUpload(backends_, std::move(header), caller);
  }
  std::shared_ptr<StreamSession> OpenStream(std::string client,
                                            std::weak_ptr<StreamSession::Sink> sink,
                                            trace::Span span) override {
    return std::make_shared<StreamSession>(backends_, std::move(client), std::move(sink),
                                           std::move(span));
  }
  absl::Status Post(absl::AnyInvocable<void()> work) override {
    return backends_.transfers.Post(std::move(work));
  }
  void CheckIsReady(Done<std::string> done) override {
    const absl::Status preloaded = backends_.preloader->CheckIsOver();
    if (!preloaded.ok()) return done(preloaded);
    probes_.CheckStores(std::move(done));
  }
  void GetMetricsText(Done<std::string> done) override { probes_.GetMetricsText(std::move(done)); }
  metrics::Metrics& metrics() override { return backends_.metrics; }
  CallLog& call_log() override { return backends_.call_log; }
  const trace::Tracer& tracer() override { return *backends_.tracer; }

 private:
  struct OpenCall {
    const Caller caller;
    Read read;
    const IsWanted is_wanted;
    Done<MessagePtr> done;
  };

  static absl::Status ReadRequest(OpenCall& call, google::protobuf::Message& request) {
    if (!call.is_wanted()) return absl::CancelledError("the client has gone");
    return call.read(request);
  }

  // Answers the call, or tells why not.
  absl::Status Finish(const UnaryMethod& unary, OpenCall& call) {
    const MessagePtr request = unary.new_request();
    LB_RETURN_IF_ERROR(ReadRequest(call, *request));
    LB_ASSIGN_OR_RETURN(MessagePtr response, unary.handle(backends_, *request, call.caller));
    Deliver([&] { call.done(std::move(response)); });
    return absl::OkStatus();
  }

  // Lets a method begin that takes several steps or waits.
  absl::Status Begin(const Method& method, const std::shared_ptr<OpenCall>& call) {
    if (IsSame(method, kImportAnimation)) return BeginImport(call);
    if (IsSame(method, kMeasureCorrespondences)) return BeginMeasurement(call);
    lro::WaitOperationRequest request;
    LB_RETURN_IF_ERROR(ReadRequest(*call, request));
    const auto watch = std::make_shared<OperationWatch>(backends_, request.name(), call->is_wanted);
    watch->AwaitDone(DeadlineOf(request), [call](const absl::StatusOr<SeenOperationPtr>& seen) {
      Tell(*call, [&]() -> absl::StatusOr<MessagePtr> {
        LB_RETURN_IF_ERROR(seen.status());
        return std::make_unique<lro::Operation>((*seen)->operation);
      });
    });
    return absl::OkStatus();
  }

  // Ends a call with the message that make() returns, or with its error.
  template <typename Make>
  static void Tell(OpenCall& call, const Make& make) {
    Deliver([&] { call.done(Guarded(make)); });
  }

  // The end of a call whose method has an answer of this type.
  template <typename Response>
  static auto DoneOf(const std::shared_ptr<OpenCall>& call) {
    return [call](absl::StatusOr<Response> response) {
      Tell(*call, [&]() -> absl::StatusOr<MessagePtr> {
        LB_RETURN_IF_ERROR(response.status());
        return std::make_unique<Response>(*std::move(response));
      });
    };
  }

  absl::Status BeginImport(const std::shared_ptr<OpenCall>& call) {
    v1::ImportAnimationRequest request;
    LB_RETURN_IF_ERROR(ReadRequest(*call, request));
    ImportAnimation(backends_, import_roots_, std::move(request), call->caller, call->is_wanted,
                    DoneOf<lro::Operation>(call));
    return absl::OkStatus();
  }

  absl::Status BeginMeasurement(const std::shared_ptr<OpenCall>& call) {
    v1::MeasureCorrespondencesRequest request;
    LB_RETURN_IF_ERROR(ReadRequest(*call, request));
    MeasureCorrespondences(backends_, request, call->caller, call->is_wanted,
                           DoneOf<v1::MeasureCorrespondencesResponse>(call));
    return absl::OkStatus();
  }

  // done(work()) on the pool.
  template <typename Work, typename Reply>
  void Answer(WorkPool& pool, Work work, Done<Reply> done) {
    const auto call =
        std::make_shared<std::pair<Work, Done<Reply>>>(std::move(work), std::move(done));
    const absl::Status accepted =
        pool.Post([call] { Deliver([&] { call->second(Guarded(call->first)); }); });
    if (!accepted.ok()) call->second(accepted);
  }

  Backends& backends_;
  AccessController& access_controller_;
  const ImportRoots& import_roots_;
  Probes probes_{backends_, access_controller_};
};

}  // namespace

std::unique_ptr<Api> MakeApi(Backends& backends, AccessController& access_controller,
                             const ImportRoots& import_roots) {
  return std::make_unique<PooledApi>(backends, access_controller, import_roots);
}

}  // namespace liquidblend::server
