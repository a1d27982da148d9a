#include "server/api/handlers.h"

#include <memory>
#include <optional>
#include <string>
#include <utility>

#include "core/base/status_macros.h"
#include "server/base/errors.h"
#include "server/base/guarded.h"
#include "server/base/names.h"
#include "server/base/work_pool.h"
#include "server/frames/find_family.h"
#include "server/frames/measure.h"

namespace liquidblend::server {
namespace {

using Response = v1::MeasureCorrespondencesResponse;

// One call, which lives in the callback and the work that it waits for.
class MeasureCall : public std::enable_shared_from_this<MeasureCall> {
 public:
  using Done = absl::AnyInvocable<void(absl::StatusOr<Response>)>;

  MeasureCall(Backends& backends, std::string account, IsWanted is_wanted, Done done)
      : backends_(backends),
        account_(std::move(account)),
        is_wanted_(std::move(is_wanted)),
        done_(std::move(done)) {}

  void Begin(const v1::MeasureCorrespondencesRequest& request) {
    const absl::Status begun = Guarded([&] { return Find(request); });
    if (!begun.ok()) done_(begun);
  }

 private:
  absl::Status Find(const v1::MeasureCorrespondencesRequest& request) {
    LB_ASSIGN_OR_RETURN(const std::string id, FamilyId("family", request.family()));
    if (request.version() < 0) return InvalidField("version", "must not be negative");
    FindFamily(backends_, id, {request.version()},
               [self = shared_from_this(), request](absl::StatusOr<catalog::FamilyPtr> found) {
                 self->Go([&] { return self->Measure(std::move(found), request); });
               });
    return absl::OkStatus();
  }

  absl::Status Measure(absl::StatusOr<catalog::FamilyPtr> found,
                       const v1::MeasureCorrespondencesRequest& request) {
    LB_RETURN_IF_ERROR(found.status());
    LB_RETURN_IF_ERROR(CheckMeasurement(**found, request));
    measurement_.emplace(*std::move(found), request);
    return PostStep(/*is_refusable=*/true);
  }

  absl::Status PostStep(bool is_refusable) {
    FrameWork work;
    work.client = account_;
    work.cost = measurement_->StepCost();
    work.deadline = SteadyNow();
    work.run = [self = shared_from_this()] { self->Go([&] { return self->Step(); }); };
    return backends_.frames.Post(std::move(work), is_refusable).status();
  }

  absl::Status Step() {
    if (!is_wanted_()) return absl::CancelledError("the client has cancelled the call");
    measurement_->Step();
    if (!measurement_->is_over()) return PostStep(/*is_refusable=*/false);
    LB_ASSIGN_OR_RETURN(Response response, measurement_->TakeResponse());
    done_(std::move(response));
    return absl::OkStatus();
  }

  // Runs the next part of the call, and ends it if that fails.
  template <typename Part>
  void Go(Part part) {
    const absl::Status status = Guarded(part);
    if (!status.ok()) done_(status);
  }

  Backends& backends_;
  const std::string account_;
  const IsWanted is_wanted_;
  Done done_;
  std::optional<Measurement> measurement_;
};

}  // namespace

void MeasureCorrespondences(
    Backends& backends, const v1::MeasureCorrespondencesRequest& request, const Caller& caller,
    IsWanted is_wanted,
    absl::AnyInvocable<void(absl::StatusOr<v1::MeasureCorrespondencesResponse>)> done) {
  std::make_shared<MeasureCall>(backends, caller.principal.key, std::move(is_wanted),
                                std::move(done))
      ->Begin(request);
}

}  // namespace liquidblend::server
