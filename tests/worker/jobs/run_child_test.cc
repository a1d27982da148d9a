// Registrations of several targets: children on any workers, then one that puts them together.
#include "worker/jobs/run_child.h"

#include <filesystem>
#include <set>
#include <thread>

#include "core/store/blobs/mapped_file.h"
#include "core/store/files/files.h"
#include "tests/worker/jobs/jobs_testing.h"
#include "worker/jobs/target_files.h"

namespace liquidblend::jobs {
namespace {

using store::Succeeds;
using store::pb::JobRecord;
using testing::HasSubstr;

class RunChildTest : public JobsTest {
 protected:
  void ImportBalls() {
    SubmitBall("still", 0.0);
    SubmitBall("slow", 1.0);
    SubmitBall("fast", 3.0);
    SubmitBall("back", -1.0);
    ASSERT_THAT(Work(), Succeeds());
  }

  std::string SubmitBalls(const std::function<void(store::pb::RegisterJob&)>& change = {}) {
    return SubmitRegistration("balls", "still", {"slow", "fast", "back"}, change);
  }

  // The name of the family's file, which is its content.
  std::string PublishedBlob(const std::string& job) {
    EXPECT_EQ(Job(job).state(), JobRecord::SUCCEEDED) << Job(job).error().message();
    return catalog_->GetFamily("balls")->blob();
  }

  // Work of several at once.
  void WorkTogether(int num_workers) {
    std::vector<std::thread> workers;
    for (int k = 0; k < num_workers; ++k) {
      workers.emplace_back([&, k] {
        while (Unfinished()) EXPECT_THAT(Work(1, absl::StrCat("worker ", k)), Succeeds());
      });
    }
    for (std::thread& worker : workers) worker.join();
  }

  bool Unfinished() {
    const JobRecord job = catalog_->ListJobs(1, "")->records[0];
    return job.state() == JobRecord::WAITING || job.state() == JobRecord::QUEUED ||
           job.state() == JobRecord::RUNNING;
  }

  // A point at the top of the ball, half-way.
  static void AddCorrespondence(store::pb::RegisterJob::Correspondences& list, double velocity) {
    store::pb::Correspondence& top = *list.add_correspondences();
    top.set_kind(store::pb::Correspondence::POINT);
    top.set_hard(true);
    for (const double value : {0.0, 0.0, 0.5, 1.0 / 24}) top.add_source(value);
    for (const double value : {velocity / 24, 0.0, 0.5, 1.0 / 24}) top.add_target(value);
  }
};

TEST_F(RunChildTest, TheFamilyIsTheSameBytesAsOfOneJobForAnyNumberOfWorkers) {
  ImportBalls();
  const auto change = [](auto& job) {
    job.mutable_options()->set_max_iterations(2);
    for (const double velocity : {1.0, 3.0, -1.0}) {
      AddCorrespondence(*job.add_correspondences(), velocity);
    }
  };
  const std::string one_job = SubmitBalls(change);
  MakeOneJobOf(one_job);
  ASSERT_THAT(Work(), Succeeds());
  const std::string expected = PublishedBlob(one_job);
  const store::pb::FamilyManifest manifest = catalog_->GetFamily("balls")->manifest();
  EXPECT_EQ(manifest.targets_size(), 3);
  EXPECT_EQ(manifest.coarser_levels_size(), 2);
  for (const int num_workers : {1, 2, 3}) {
    const std::string job = SubmitBalls(change);
    ASSERT_EQ(catalog_->ListChildren(job)->size(), 3);
    WorkTogether(num_workers);
    EXPECT_EQ(PublishedBlob(job), expected) << num_workers << " workers";
    // The catalog's record has the seconds, too: those of the children.
    const store::pb::FamilyRecord record = *catalog_->GetFamily("balls");
    ASSERT_EQ(record.manifest().reports_size(), 3);
    for (const auto& report : record.manifest().reports()) {
      EXPECT_GT(report.seconds(), 0.0);
    }
  }
}

TEST_F(RunChildTest, ARefinementOfSeveralTargetsIsTheSameBytesAsOfOneJob) {
  ImportBalls();
  std::vector<std::string> blobs;
  for (const bool is_one_job : {false, true}) {
    ASSERT_THAT(catalog_->DeleteFamily("balls").code(),
                testing::AnyOf(absl::StatusCode::kOk, absl::StatusCode::kNotFound));
    SubmitBalls();
    ASSERT_THAT(Work(), Succeeds());
    const int64_t version = catalog_->GetFamily("balls")->version();
    const std::string job = SubmitBalls([&](auto& registration) {
      registration.set_refine_version(version);
      for (const double velocity : {1.0, 3.0, -1.0}) {
        AddCorrespondence(*registration.add_correspondences(), velocity);
      }
    });
    if (is_one_job) MakeOneJobOf(job);
    ASSERT_THAT(Work(), Succeeds());
    blobs.push_back(PublishedBlob(job));
    EXPECT_EQ(catalog_->GetFamily("balls")->version(), version + 1);
  }
  EXPECT_EQ(blobs[0], blobs[1]);
}

TEST_F(RunChildTest, ARefinementKeepsTargetsWithoutNewCorrespondences) {
  ImportBalls();
  const auto displacements = [&] {
    const auto family =
        store::OpenFamily(*blobs_.Open(catalog_->GetFamily("balls")->blob()), "balls");
    EXPECT_THAT(family, Succeeds());
    std::vector<std::vector<mesh::Float4>> result;
    for (const mesh::FamilyTarget& target : family->targets) {
      result.emplace_back(target.displacement.begin(), target.displacement.end());
    }
    return result;
  };
  const auto refine = [&](bool is_one_job) {
    const std::string job = SubmitBalls([&](auto& registration) {
      registration.set_refine_version(catalog_->GetFamily("balls")->version());
      for (int k = 0; k < 3; ++k) registration.add_correspondences();
      AddCorrespondence(*registration.mutable_correspondences(1), 3.0);
    });
    if (is_one_job) MakeOneJobOf(job);
    EXPECT_THAT(Work(), Succeeds());
    return PublishedBlob(job);
  };
  std::vector<std::string> blobs;
  for (const bool is_one_job : {false, true}) {
    SubmitBalls();
    ASSERT_THAT(Work(), Succeeds());
    const auto before = displacements();
    blobs.push_back(refine(is_one_job));
    const auto after = displacements();
    EXPECT_EQ(before[0], after[0]);
    EXPECT_NE(before[1], after[1]);
    EXPECT_EQ(before[2], after[2]);
    const store::pb::FamilyManifest manifest = catalog_->GetFamily("balls")->manifest();
    for (int k = 0; k < 3; ++k) {
      EXPECT_EQ(manifest.reports(k).correspondences_size(), k == 1 ? 1 : 0);
      EXPECT_EQ(manifest.space_time_reports(k + 1).num_vertices(), 972);  // 6 layers of 162
    }
    // With nothing new, all go on.
    refine(is_one_job);
    const auto last = displacements();
    for (int k = 0; k < 3; ++k) EXPECT_NE(last[k], after[k]) << k;
  }
  EXPECT_EQ(blobs[0], blobs[1]);
}

TEST_F(RunChildTest, WorkersShareTheChildren) {
  ImportBalls();
  const std::string job = SubmitBalls();
  // Each worker that opens its first file waits for the others to have a child as well.
  blobs_.on_open = [&] {
    Await([&] {
      const auto children = catalog_->ListChildren(job);
      return std::none_of(children->begin(), children->end(), [](const JobRecord& child) {
        return child.state() == JobRecord::QUEUED;
      });
    });
    return absl::OkStatus();
  };
  WorkTogether(3);
  EXPECT_EQ(Job(job).state(), JobRecord::SUCCEEDED) << Job(job).error().message();
}

TEST_F(RunChildTest, ProgressTellsOfTheTargetFromTheStart) {
  ImportBalls();
  const std::string job = SubmitBalls();
  bool was_told = false;
  blobs_.on_open = [&] {
    const auto children = catalog_->ListChildren(job);
    if (was_told || (*children)[1].state() != JobRecord::RUNNING) return absl::OkStatus();
    Await([&] { return (*catalog_->ListChildren(job))[1].progress().target_index() == 1; });
    EXPECT_EQ((*catalog_->ListChildren(job))[1].progress().stage(), "space-time meshes");
    was_told = true;
    return absl::OkStatus();
  };
  ASSERT_THAT(Work(), Succeeds());
  EXPECT_TRUE(was_told);
  EXPECT_EQ(Job(job).state(), JobRecord::SUCCEEDED) << Job(job).error().message();
}

TEST_F(RunChildTest, ABadTargetFailsTheRegistrationByName) {
  SubmitBall("still", 0.0, 24);
  SubmitBall("slow", 1.0, 24);
  SubmitBall("other", 1.0, 25);  // frames a second
  ASSERT_THAT(Work(), Succeeds());
  const std::string job = SubmitRegistration("balls", "still", {"slow", "other"});
  ASSERT_THAT(Work(), Succeeds());
  EXPECT_EQ(Job(job).state(), JobRecord::FAILED);
  EXPECT_THAT(Job(job).error().message(), HasSubstr("target 'other': "));
  EXPECT_TRUE(catalog_->ListChildren(job)->empty());
  EXPECT_EQ(catalog_->GetFamily("balls")->version(), 0);
}

TEST_F(RunChildTest, ACancelledRegistrationStopsTheChildrenAtWork) {
  ImportBalls();
  const std::string job =
      SubmitBalls([](auto& r) { r.mutable_options()->set_max_iterations(200); });
  int num_opened = 0;
  blobs_.on_open = [&] {
    if (++num_opened > 1) return absl::OkStatus();
    EXPECT_THAT(catalog_->RequestCancel(job), Succeeds());
    return absl::OkStatus();
  };
  ASSERT_THAT(Work(), Succeeds());
  EXPECT_EQ(Job(job).state(), JobRecord::CANCELLED);
  // The first frames of all four, and the two of the first child; no other was begun.
  EXPECT_LE(num_opened, 6);
  EXPECT_EQ(catalog_->GetFamily("balls")->version(), 0);
}

TEST_F(RunChildTest, ALostTargetFileIsNamedByWhoPutsThemTogether) {
  ImportBalls();
  const std::string job = SubmitBalls();
  blobs_.on_open = [&] {
    const auto children = catalog_->ListChildren(job);
    if (Job(job).state() == JobRecord::RUNNING) {
      EXPECT_THAT(blobs_.Delete((*children)[2].result_blob()), Succeeds());
    }
    return absl::OkStatus();
  };
  ASSERT_THAT(Work(), Succeeds());
  EXPECT_EQ(Job(job).state(), JobRecord::FAILED);
  EXPECT_EQ(Job(job).error().code(), static_cast<int>(absl::StatusCode::kNotFound));
  EXPECT_THAT(Job(job).error().message(), HasSubstr("target 'back': "));
  EXPECT_EQ(catalog_->GetFamily("balls")->version(), 0);
}

RegisteredTarget SampleTarget() {
  RegisteredTarget target;
  target.name = "slow";
  target.space_time.num_vertices = 5;
  target.registration.displacement.setRandom(4, 5);
  target.registration.extrapolation.setRandom(4, 5);
  target.registration.report.num_nodes = 3;
  return target;
}

// ---- workers of several versions of the program

class MixedVersionsTest : public RunChildTest {
 protected:
  // Does the next child as a worker does whose program makes another mesh of the source.
  void DoChildWithAnotherVersion() {
    const auto lease = catalog_->LeaseJob("old worker", absl::Seconds(30));
    ASSERT_THAT(lease, Succeeds());
    ASSERT_TRUE(lease->has_value() && (*lease)->job.has_register_target());
    RegisteredTarget target = SampleTarget();
    target.name = kTargets[(*lease)->job.register_target().target_index()];
    const auto id = StoreTarget(target, "a mesh of another version", blobs_);
    ASSERT_THAT(id, Succeeds());
    ASSERT_THAT(catalog_->FinishChild((*lease)->lease_id, *id), Succeeds());
  }

  // Works at this many jobs.
  void WorkAt(int num_jobs) {
    JobLoopOptions options = Options();
    options.max_jobs = num_jobs;
    ASSERT_THAT(WorkWith(options), Succeeds());
  }

  JobRecord Child(const std::string& job, int k) { return (*catalog_->ListChildren(job))[k]; }

  // Blob of the family as workers of one version make it.
  std::string ExpectedBlob() {
    ImportBalls();
    const std::string job = SubmitBalls();
    EXPECT_THAT(Work(), Succeeds());
    return PublishedBlob(job);
  }

  static constexpr const char* kTargets[] = {"slow", "fast", "back"};
};

TEST_F(MixedVersionsTest, TargetsOfAnotherMeshAreRegisteredAgain) {
  const std::string expected = ExpectedBlob();
  const std::string job = SubmitBalls();
  DoChildWithAnotherVersion();
  WorkAt(1);
  DoChildWithAnotherVersion();
  const JobRecord kept = Child(job, 1);
  WorkAt(1);  // the parent
  ASSERT_EQ(Job(job).state(), JobRecord::WAITING) << Job(job).error().message();
  EXPECT_EQ(Child(job, 0).state(), JobRecord::QUEUED);
  EXPECT_EQ(Child(job, 2).state(), JobRecord::QUEUED);
  EXPECT_EQ(Child(job, 1).SerializeAsString(), kept.SerializeAsString());
  EXPECT_EQ(catalog_->GetFamily("balls")->version(), 1) << "nothing is published";
  ASSERT_THAT(Work(), Succeeds());
  EXPECT_EQ(PublishedBlob(job), expected);
  const JobRecord done = Job(job);
  EXPECT_EQ(done.attempts(), 1);
  ASSERT_EQ(done.failed_attempts_size(), 2);
  EXPECT_EQ(done.failed_attempts(1).worker(), "old worker");
  EXPECT_THAT(done.failed_attempts(1).error().message(),
              HasSubstr("target 'back': registered by another version of the program"));
}

TEST_F(MixedVersionsTest, ATargetThatComesOfAnotherMeshAgainAndAgainIsRegisteredByTheLastWorker) {
  const std::string expected = ExpectedBlob();
  const std::string job = SubmitBalls();
  for (int k = 0; k < 3; ++k) DoChildWithAnotherVersion();
  WorkAt(1);
  ASSERT_EQ(Job(job).state(), JobRecord::WAITING) << Job(job).error().message();
  DoChildWithAnotherVersion();
  WorkAt(3);  // two children and the parent
  ASSERT_EQ(Job(job).state(), JobRecord::WAITING) << Job(job).error().message();
  EXPECT_EQ(Child(job, 0).failed_attempts_size(), 2);
  DoChildWithAnotherVersion();
  EXPECT_EQ(Job(job).state(), JobRecord::QUEUED);
  WorkAt(1);
  EXPECT_EQ(PublishedBlob(job), expected);
}

TEST_F(MixedVersionsTest, ARefinementIsRegisteredAgainToo) {
  std::vector<std::string> blobs;
  ImportBalls();
  for (const bool is_mixed : {false, true}) {
    ASSERT_THAT(catalog_->DeleteFamily("balls").code(),
                testing::AnyOf(absl::StatusCode::kOk, absl::StatusCode::kNotFound));
    SubmitBalls();
    ASSERT_THAT(Work(), Succeeds());
    const std::string job = SubmitBalls([&](auto& registration) {
      registration.set_refine_version(catalog_->GetFamily("balls")->version());
      for (int k = 0; k < 3; ++k) registration.add_correspondences();
      AddCorrespondence(*registration.mutable_correspondences(0), 1.0);
    });
    if (is_mixed) DoChildWithAnotherVersion();
    ASSERT_THAT(Work(), Succeeds());
    blobs.push_back(PublishedBlob(job));
  }
  EXPECT_EQ(blobs[0], blobs[1]);
}

TEST_F(MixedVersionsTest, ACancelledRegistrationRepeatsNothing) {
  ImportBalls();
  const std::string job = SubmitBalls();
  for (int k = 0; k < 3; ++k) DoChildWithAnotherVersion();
  blobs_.on_open = [&] {
    if (Job(job).state() == JobRecord::RUNNING) {
      EXPECT_THAT(catalog_->RequestCancel(job), Succeeds());
    }
    return absl::OkStatus();
  };
  ASSERT_THAT(Work(), Succeeds());
  EXPECT_EQ(Job(job).state(), JobRecord::CANCELLED);
  EXPECT_EQ(catalog_->GetFamily("balls")->version(), 0);
}

// ---- target files

TEST_F(RunChildTest, ATargetFileComesBackAsItWas) {
  const RegisteredTarget target = SampleTarget();
  const auto id = StoreTarget(target, "hash", blobs_);
  ASSERT_THAT(id, Succeeds());
  const auto read = ReadTarget(*id, "slow", "hash", blobs_);
  ASSERT_THAT(read, Succeeds());
  ASSERT_TRUE(read->has_value());
  const RegisteredTarget* const back = &**read;
  EXPECT_EQ(back->name, "slow");
  EXPECT_EQ(back->space_time.num_vertices, 5);
  EXPECT_EQ(back->registration.displacement, target.registration.displacement);
  EXPECT_EQ(back->registration.extrapolation, target.registration.extrapolation);
  EXPECT_EQ(back->registration.report.num_nodes, 3);
}

TEST_F(RunChildTest, ATargetFileOfAnotherTargetIsRefusedAndOneOfAnotherMeshIsNothing) {
  const auto id = StoreTarget(SampleTarget(), "hash", blobs_);
  ASSERT_THAT(id, Succeeds());
  EXPECT_THAT(
      ReadTarget(*id, "fast", "hash", blobs_),
      store::Fails(absl::StatusCode::kFailedPrecondition, "'fast' is one of target 'slow'"));
  const auto other = ReadTarget(*id, "slow", "other", blobs_);
  ASSERT_THAT(other, Succeeds());
  EXPECT_FALSE(other->has_value());
}

TEST_F(RunChildTest, ATargetFileThatCannotBeReadAnyMoreIsNotCalledBad) {
  store::SurviveUnreadablePages();
  const auto id = StoreTarget(SampleTarget(), "hash", blobs_);
  ASSERT_THAT(id, Succeeds());
  blobs_.after_open = [&](const store::BlobId& opened) {
    std::filesystem::resize_file(store::LocalBlobPath(folder_.path(), opened), 0);
  };
  EXPECT_THAT(ReadTarget(*id, "slow", "hash", blobs_),
              store::Fails(absl::StatusCode::kDataLoss, "target 'slow': a part of "));
}

// The version that is refined is in use until the end.
TEST_F(RunChildTest, APreviousVersionThatCannotBeReadAnyMoreIsNeitherUsedNorBlamed) {
  store::SurviveUnreadablePages();
  ImportBalls();
  for (const bool is_one_job : {false, true}) {
    for (const bool is_late : {false, true}) {
      blobs_.after_open = {};
      SubmitBalls();
      ASSERT_THAT(Work(), Succeeds());
      const store::pb::FamilyRecord family = *catalog_->GetFamily("balls");
      const std::string path = store::LocalBlobPath(folder_.path(), family.blob());
      const std::string content = store::ReadFile(path);
      const std::string job = SubmitBalls(
          [&](auto& registration) { registration.set_refine_version(family.version()); });
      if (is_one_job) MakeOneJobOf(job);
      const std::string later = catalog_->GetAnimation("still")->blob();
      blobs_.after_open = [&](const store::BlobId& id) {
        if (id == (is_late ? later : family.blob())) std::filesystem::resize_file(path, 0);
      };
      ASSERT_THAT(Work(), Succeeds());
      EXPECT_EQ(Job(job).state(), JobRecord::FAILED);
      EXPECT_EQ(Job(job).error().code(), static_cast<int>(absl::StatusCode::kDataLoss));
      EXPECT_THAT(Job(job).error().message(), HasSubstr("the version to refine: a part of "));
      EXPECT_EQ(catalog_->GetFamily("balls")->version(), family.version());
      store::WriteFile(path, content);
    }
  }
}

TEST(HashOf, ChangesWithAnyArrayOfTheMesh) {
  mesh::SpaceTimeMesh mesh;
  mesh.vertices.setZero(4, 2);
  std::set<std::string> hashes = {HashOf(mesh)};
  mesh.vertices(3, 1) = 1;
  hashes.insert(HashOf(mesh));
  mesh.velocities.setZero(3, 2);
  hashes.insert(HashOf(mesh));
  mesh.tetrahedra.push_back({0, 1, 0, 1});
  hashes.insert(HashOf(mesh));
  mesh.hexahedra.push_back({0, 1, 0, 1, 0, 1, 0, 1});
  hashes.insert(HashOf(mesh));
  mesh.tetrahedra.push_back({0, 1, 0, 1});
  mesh.tetrahedra.push_back({0, 1, 0, 1});
  mesh.hexahedra.clear();
  hashes.insert(HashOf(mesh));
  EXPECT_EQ(hashes.size(), 6);
}

}  // namespace
}  // namespace liquidblend::jobs
