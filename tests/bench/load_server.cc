#include "tests/bench/load_server.h"

#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <numbers>
#include <utility>

#include "core/store/data_directory.h"
#include "core/store/files.h"
#include "tests/synthetic/families.h"

namespace liquidblend::bench {
namespace {

const std::string kSource = "source";
const std::string kTarget = "target";

void Require(const absl::Status& status) {
  if (status.ok()) return;
  std::fprintf(stderr, "lb_load: %s\n", status.ToString().c_str());
  std::abort();
}

template <typename T>
T Require(absl::StatusOr<T> result) {
  Require(result.status());
  return *std::move(result);
}

synthetic::Field TimeWarp(double warp_frames) {
  return [=](int64_t, const Eigen::Vector4f& at) {
    const double phase = std::numbers::pi * (2.0 * at[0] + at[1]);
    return Eigen::Vector4f(0.05F, 0.0F, 0.0F, static_cast<float>(warp_frames * std::sin(phase)));
  };
}

mesh::RegisteredFamily MakeFamily(int vertices_per_frame, double warp_frames) {
  const int num_minor = static_cast<int>(std::sqrt(vertices_per_frame / 2.0));
  synthetic::ComplexOptions options;
  options.num_frames = kLoadFrames;
  options.growth_per_frame = 0.01F;
  mesh::RegisteredFamily family = synthetic::MakeFamily(
      synthetic::HexahedralTorus(vertices_per_frame / num_minor, num_minor, options),
      {{TimeWarp(warp_frames), {}}});
  family.name = "load";
  family.source = kSource;
  family.targets[0].name = kTarget;
  return family;
}

void Import(store::Catalog& catalog, const std::string& id) {
  store::pb::AnimationRecord animation;
  animation.set_id(id);
  store::pb::JobRecord job;
  job.mutable_import_animation()->set_animation(id);
  Require(catalog.SubmitImport(animation, job).status());
  animation.mutable_manifest()->set_num_frames(kLoadFrames);
  const auto lease = Require(catalog.LeaseJob("load", absl::Hours(1)));
  Require(catalog.PublishAnimation(lease->lease_id, animation));
}

}  // namespace

LoadServer::LoadServer(int vertices_per_frame, double warp_frames, int num_threads)
    : catalog_(Require(store::OpenSqliteCatalog(store::CatalogPath(folder_.path())))),
      blobs_(Require(store::OpenLocalBlobStore(folder_.path()))),
      families_(*catalog_, *blobs_) {
  Publish(vertices_per_frame, warp_frames);
  rpc::ServerOptions options;
  options.listen = "127.0.0.1:0";
  options.num_frame_threads = num_threads;
  server_ = Require(rpc::Server::Start(*catalog_, *blobs_, families_, options));
}

void LoadServer::Publish(int vertices_per_frame, double warp_frames) {
  Import(*catalog_, kSource);
  Import(*catalog_, kTarget);
  store::pb::JobRecord job;
  job.mutable_register_family()->set_family("load");
  job.mutable_register_family()->set_source(kSource);
  job.mutable_register_family()->add_targets(kTarget);
  Require(catalog_->SubmitRegistration(job).status());
  const mesh::RegisteredFamily family = MakeFamily(vertices_per_frame, warp_frames);
  duration_s_ = family.duration_s();
  const auto writer = Require(blobs_->Create());
  Require(store::WriteFamily(family, *writer));
  store::pb::FamilyRecord record;
  record.set_id("load");
  record.set_blob(Require(writer->Commit()));
  *record.mutable_manifest() = store::ManifestOf(family);
  const auto lease = Require(catalog_->LeaseJob("load", absl::Hours(1)));
  Require(catalog_->PublishFamily(lease->lease_id, record).status());
}

}  // namespace liquidblend::bench
