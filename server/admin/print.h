// Reports for people and, as JSON, for programs.
#pragma once

#include <string>
#include <vector>

#include "absl/time/time.h"
#include "server/admin/check.h"
#include "server/admin/collect.h"
#include "server/admin/jobs.h"
#include "server/admin/plan.h"
#include "server/admin/transfer.h"

namespace liquidblend::admin {

enum class Format { kText, kJson };

// Lines, each with a newline at its end; JSON is one object on one line.
std::string Print(const CheckReport& report, Format format);
std::string Print(const CollectReport& report, bool dry_run, Format format);
std::string Print(const TransferReport& report, const std::string& action, Format format);
// Ages are those at `now`; only for people, JSON has times.
std::string Print(const QueueReport& report, absl::Time now, Format format);
std::string Print(const std::vector<Worker>& workers, absl::Time now, Format format);
std::string Print(const std::vector<store::OwnerUse>& owners, Format format);
std::string Print(const Plan& plan, Format format);

}  // namespace liquidblend::admin
