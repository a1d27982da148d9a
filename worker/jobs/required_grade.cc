#include "worker/jobs/required_grade.h"

#include <string>

#include "absl/strings/cord.h"
#include "absl/strings/str_cat.h"
#include "core/mesh/verdict.h"
#include "google/rpc/error_details.pb.h"

namespace liquidblend::jobs {
namespace {

constexpr char kErrorInfoUrl[] = "type.googleapis.com/google.rpc.ErrorInfo";

const char* NameOf(mesh::Grade grade) {
  switch (grade) {
    case mesh::Grade::kGood:
      return "good";
    case mesh::Grade::kDoubtful:
      return "doubtful";
    case mesh::Grade::kTooDifferent:
      return "too different";
    case mesh::Grade::kUnknown:
      return "unknown";
  }
  return "unknown";
}

absl::Status TooLow(const RegisteredTarget& target, mesh::Grade required) {
  const mesh::Verdict& verdict = target.registration.report.verdict;
  absl::Status status = absl::FailedPreconditionError(
      absl::StrCat("target '", target.name, "': the verdict is ", NameOf(verdict.grade),
                   ", not at least ", NameOf(required), ", as was required: ", verdict.reason,
                   "; nothing is published. Correspondences may help, or require less"));
  google::rpc::ErrorInfo info;
  info.set_reason("VERDICT_TOO_LOW");
  info.set_domain("liquidblend");
  status.SetPayload(kErrorInfoUrl, absl::Cord(info.SerializeAsString()));
  return status;
}

}  // namespace

absl::Status CheckGrades(std::span<const RegisteredTarget> targets, store::v1::Grade required) {
  if (required == store::v1::GRADE_UNSPECIFIED) return absl::OkStatus();
  const auto worst = mesh::Grade{static_cast<int>(required)};  // the same numbers
  for (const RegisteredTarget& target : targets) {
    if (target.registration.report.verdict.grade > worst) return TooLow(target, worst);
  }
  return absl::OkStatus();
}

}  // namespace liquidblend::jobs
