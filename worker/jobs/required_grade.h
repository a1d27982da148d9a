// The least grade that a registration must have to be published.
#pragma once

#include <span>

#include "absl/status/status.h"
#include "liquidblend/store/v1/files.pb.h"
#include "worker/jobs/assemble_family.h"

namespace liquidblend::jobs {

// Errors: kFailedPrecondition, with a google.rpc.ErrorInfo of the reason VERDICT_TOO_LOW, naming
// the first target whose verdict is worse than `required` or has no grade (kept from a family of an
// older program), and the reason of the verdict. If the required grade is unspecified, all pass.
absl::Status CheckGrades(std::span<const RegisteredTarget> targets, store::v1::Grade required);

}  // namespace liquidblend::jobs
