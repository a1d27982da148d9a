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

std::string DescribeUnknown(const RegisteredTarget& target, mesh::Grade required) {
  return absl::StrCat("target '", target.name, "' has no verdict, since an earlier program has ",
                      "registered it, and at least ", NameOf(required),
                      " was required; nothing is published. Register it anew, or require nothing");
}

std::string DescribeTooLow(const RegisteredTarget& target, mesh::Grade required) {
  const mesh::Verdict& verdict = target.registration.report.verdict;
  return absl::StrCat("target '", target.name, "': the verdict is ", NameOf(verdict.grade),
                      ", not at least ", NameOf(required), ", as was required: ", verdict.reason,
                      "; nothing is published. Correspondences may help, or require less");
}

absl::Status TooLow(const std::string& message) {
  absl::Status status = absl::FailedPreconditionError(message);
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
    const mesh::Grade grade = target.registration.report.verdict.grade;
    if (grade == mesh::Grade::kUnknown) return TooLow(DescribeUnknown(target, worst));
    if (grade > worst) return TooLow(DescribeTooLow(target, worst));
  }
  return absl::OkStatus();
}

}  // namespace liquidblend::jobs
