// A catalog under a simulated clock, for the simulation of the autoscalers: submits jobs, gives
// them to workers, and prints the metrics that a server would show of it. One command a line:
//   at SECONDS                  the time is that; leases that are held are renewed
//   import NAME GIB             submits a job that needs so much memory: its id
//   register NAME GIB TARGETS   likewise, a registration of TARGETS targets
//   lease WORKER GIB            a worker with so much memory asks for a job: lease and id, or -
//   finish LEASE | release LEASE   the worker is done, or gives the job back
//   metrics                     text of Prometheus, up to a line "."
// Each is answered by a line, "ok" if there is nothing else to say.
//   replay_catalog FILE         the SQLite file of a new catalog
#include <cstdio>
#include <iostream>
#include <map>
#include <memory>
#include <sstream>
#include <string>
#include <utility>

#include "absl/strings/str_cat.h"
#include "absl/time/time.h"
#include "core/base/exit_status.h"
#include "core/base/status_macros.h"
#include "core/store/catalog/catalog.h"
#include "server/metrics/catalog_figures.h"
#include "server/metrics/metrics.h"

namespace liquidblend::kubernetes {
namespace {

namespace pb = store::pb;

constexpr absl::Duration kLease = absl::Minutes(10);
constexpr int64_t kGib = int64_t{1} << 30;

class Replay {
 public:
  absl::Status Open(const std::string& path) {
    store::CatalogOptions options;
    options.now = [this] { return now_; };
    LB_ASSIGN_OR_RETURN(catalog_, store::OpenSqliteCatalog(path, options));
    return MakeAnimation("source");
  }

  absl::StatusOr<std::string> Answer(const std::string& line) {
    std::istringstream words(line);
    std::string command;
    std::string name;
    double number = 0;
    int num_targets = 0;
    words >> command;
    if (command == "metrics") return Metrics();
    if (command == "at" && words >> number) return SetTime(number);
    if (!(words >> name)) return absl::InvalidArgumentError(line);
    if (command == "finish") return Finish(name);
    if (command == "release") return Release(name);
    if (!(words >> number)) return absl::InvalidArgumentError(line);
    const auto memory = static_cast<int64_t>(number * kGib);
    if (command == "import") return Import(name, memory);
    if (command == "lease") return Lease(name, memory);
    if (command == "register" && words >> num_targets) return Register(name, memory, num_targets);
    return absl::InvalidArgumentError(line);
  }

 private:
  absl::Status MakeAnimation(const std::string& id) {
    LB_RETURN_IF_ERROR(Import(id, 0).status());
    LB_ASSIGN_OR_RETURN(const auto lease, catalog_->LeaseJob("worker", kLease));
    pb::AnimationRecord animation;
    animation.set_id(id);
    animation.set_blob("blob-of-" + id);
    return catalog_->PublishAnimation(lease->lease_id, animation);
  }

  absl::StatusOr<std::string> SetTime(double seconds) {
    now_ = absl::FromUnixSeconds(1700000000) + absl::Seconds(seconds);
    for (auto& [id, held] : held_) {
      if (now_ - held.renewed < kLease / 2) continue;
      LB_RETURN_IF_ERROR(catalog_->Heartbeat(id, kLease, {}).status());
      held.renewed = now_;
    }
    return "ok";
  }

  absl::StatusOr<std::string> Import(const std::string& name, int64_t memory) {
    pb::AnimationRecord animation;
    animation.set_id(name);
    pb::JobRecord job;
    job.set_memory_bytes(memory);
    job.mutable_import_animation()->set_animation(name);
    pb::SourceFile* const file = job.mutable_import_animation()->add_files();
    file->set_name("frame_0001.ply");
    file->set_blob("upload-of-" + name);
    LB_ASSIGN_OR_RETURN(const pb::JobRecord submitted, catalog_->SubmitImport(animation, job));
    return submitted.id();
  }

  absl::StatusOr<std::string> Register(const std::string& name, int64_t memory, int num_targets) {
    pb::JobRecord job;
    job.set_memory_bytes(memory);
    job.mutable_register_family()->set_family(name);
    job.mutable_register_family()->set_source("source");
    for (int k = 0; k < num_targets; ++k) job.mutable_register_family()->add_targets("source");
    LB_ASSIGN_OR_RETURN(const pb::JobRecord submitted, catalog_->SubmitRegistration(job));
    return submitted.id();
  }

  absl::StatusOr<std::string> Lease(const std::string& worker, int64_t memory) {
    LB_ASSIGN_OR_RETURN(const auto lease, catalog_->LeaseJob(worker, kLease, memory));
    if (!lease.has_value()) return "-";
    held_[lease->lease_id] = {lease->job, now_};
    return absl::StrCat(lease->lease_id, " ", lease->job.id());
  }

  absl::StatusOr<std::string> Finish(const std::string& lease_id) {
    const pb::JobRecord job = held_[lease_id].job;
    held_.erase(lease_id);
    LB_RETURN_IF_ERROR(Publish(lease_id, job));
    return "ok";
  }

  absl::Status Publish(const std::string& lease_id, const pb::JobRecord& job) {
    if (job.has_register_target()) return catalog_->FinishChild(lease_id, "blob-of-" + job.id());
    if (job.has_register_family()) {
      pb::FamilyRecord family;
      family.set_id(job.register_family().family());
      family.set_blob("blob-of-" + family.id());
      return catalog_->PublishFamily(lease_id, family).status();
    }
    pb::AnimationRecord animation;
    animation.set_id(job.import_animation().animation());
    animation.set_blob("blob-of-" + animation.id());
    return catalog_->PublishAnimation(lease_id, animation);
  }

  absl::StatusOr<std::string> Release(const std::string& lease_id) {
    held_.erase(lease_id);
    LB_RETURN_IF_ERROR(catalog_->ReleaseJob(lease_id));
    return "ok";
  }

  absl::StatusOr<std::string> Metrics() {
    metrics::Snapshot snapshot;
    LB_ASSIGN_OR_RETURN(snapshot.catalog, metrics::ReadCatalogFigures(*catalog_));
    return absl::StrCat(metrics_.Text(snapshot), ".");
  }

  struct Held {
    pb::JobRecord job;
    absl::Time renewed;
  };

  absl::Time now_ = absl::FromUnixSeconds(1700000000);
  std::unique_ptr<store::Catalog> catalog_;
  std::map<std::string, Held> held_;  // by lease
  metrics::Metrics metrics_;
};

absl::Status Run(const std::string& path) {
  Replay replay;
  LB_RETURN_IF_ERROR(replay.Open(path));
  for (std::string line; std::getline(std::cin, line);) {
    LB_ASSIGN_OR_RETURN(const std::string answer, replay.Answer(line));
    std::cout << answer << std::endl;
  }
  return absl::OkStatus();
}

}  // namespace
}  // namespace liquidblend::kubernetes

int main(int argc, char** argv) {
  if (argc != 2) {
    std::fprintf(stderr, "usage: replay_catalog FILE\n");
    return liquidblend::base::kExitUsage;
  }
  const absl::Status status = liquidblend::kubernetes::Run(argv[1]);
  if (status.ok()) return liquidblend::base::kExitDone;
  std::fprintf(stderr, "replay_catalog: %s\n", status.ToString().c_str());
  return liquidblend::base::ExitStatusOf(status);
}
