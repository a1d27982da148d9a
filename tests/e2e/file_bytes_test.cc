// Bytes of animation, checkpoint and family files, compared with a table of hashes. A change that
// alters them on purpose updates the table, and its commit gives the effect on the accuracy.
#include <signal.h>

#include <memory>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "absl/status/statusor.h"
#include "absl/strings/str_cat.h"
#include "core/base/status_macros.h"
#include "core/store/blobs/blob_store.h"
#include "core/store/catalog/catalog.h"
#include "tests/e2e/e2e_testing.h"
#include "tests/paths.h"
#include "worker/ingest/read_directory.h"
#include "worker/jobs/checkpoint_file.h"

namespace liquidblend::e2e {
namespace {

constexpr int kCheckpointed = 2;  // the iteration of the first checkpoint that is due
constexpr int kMaxRuns = 10;

// Blobs of a source, a target, a checkpoint and the family of both, by name, which is the SHA-256
// of their bytes. They hold for x86-64 and the libm of Debian 12.
struct Scene {
  std::string folder;  // in tests/data
  std::string source;
  std::string target;
  std::string source_blob;
  std::string target_blob;
  std::string checkpoint_blob;
  std::string family_blob;
};

const Scene kTwoDrops = {
    .folder = "two_drops",
    .source = "A",
    .target = "B",
    .source_blob = "sha256-8c2dd9a052e7d41e10c7660837ba75460c5960cf1af0916c54a8e79222e3d03a",
    .target_blob = "sha256-dbd2e039ff096d3f86c996f496f4a787a5861801dd9617d1ab28f54b591264a5",
    .checkpoint_blob = "sha256-0ad3f324531d8d73e5dc602c5e0bfac5cc92fd9f8b519d222908414c7ca21abd",
    .family_blob = "sha256-ae3ae570ba03bd0c945c84af2b3193e488c3c732b77b910f527ea4d12d0c085a",
};
const Scene kDamBreakClip = {
    .folder = "dam_break_clip",
    .source = "w0_p0",
    .target = "w1_p1",
    .source_blob = "sha256-5a6fe06ac67ee4fdb069d3bc7591d20528d66796bf2ca1c9fdd9a8c8c2b0d685",
    .target_blob = "sha256-0546f02ca060cc2b2e96fbc1ac8ab1a3155191fab2a6585a75ea215b0a685f50",
    .checkpoint_blob = "sha256-02d345137aedd98cf8f089694bbb5cdf7625cf8c2dd1557e28cef4b0f35c2b0d",
    .family_blob = "sha256-6e1e48c0ec8cef33e103f8b7c72c8fad2b78c494917fefbfbaa8aafeceb6508c",
};

class FileBytesTest : public E2eTest {
 protected:
  void Import(const std::string& id, const std::string& folder) {
    const auto read = ingest::LoadDirectory(paths::Source("tests/data/" + folder));
    ASSERT_TRUE(read.ok()) << read.status();
    std::vector<NamedBytes> files;
    for (const ingest::InputFile& file : ingest::Views(*read)) {
      const auto* bytes = reinterpret_cast<const char*>(file.bytes.data());
      files.push_back({file.name, std::string(bytes, file.bytes.size())});
    }
    Operation operation;
    const grpc::Status status = Upload(id, files, "", operation);
    ASSERT_TRUE(status.ok()) << status.error_message();
    ExpectSuccess(AwaitDone(operation.name()));
  }

  // A worker registers a and b, dies once its first checkpoint is recorded, and another one goes
  // on. The checkpoint.
  jobs::Checkpoint RegisterWithALostWorker(store::Catalog& catalog) {
    Operation registration;
    EXPECT_TRUE(Register(4, registration).ok());
    Process killed = StartWorker(
        {"LIQUIDBLEND_CHECKPOINT_INTERVAL=1ms", "LIQUIDBLEND_FAULT_POINT=checkpoint.after_commit"});
    EXPECT_EQ(killed.Wait(), -SIGKILL);
    const std::string id = registration.name().substr(std::string("operations/").size());
    auto checkpoint = Load(catalog.GetJob(id)->checkpoint_blob());
    EXPECT_TRUE(checkpoint.ok()) << checkpoint.status();
    Process worker = StartWorker();
    ExpectSuccess(AwaitDone(registration.name()));
    return checkpoint.ok() ? *std::move(checkpoint) : jobs::Checkpoint();
  }

  absl::StatusOr<jobs::Checkpoint> Load(const std::string& checkpoint_blob) {
    LB_ASSIGN_OR_RETURN(const auto blobs, store::OpenLocalBlobStore(data()));
    LB_ASSIGN_OR_RETURN(const auto blob, blobs->Open(checkpoint_blob));
    return jobs::ReadCheckpoint(*blob, "the checkpoint");
  }

  // Name of the blob with a checkpoint's state alone: without its label (lease, number,
  // fingerprint) and the time that was worked, which differ between runs and programs.
  absl::StatusOr<std::string> NameOf(registration::IterationState state) {
    state.seconds = 0.0;
    LB_ASSIGN_OR_RETURN(const auto blobs, store::OpenLocalBlobStore(data()));
    LB_ASSIGN_OR_RETURN(const auto writer, blobs->Create());
    LB_RETURN_IF_ERROR(jobs::WriteCheckpoint({}, state, *writer));
    return writer->Commit();
  }

  void ExpectBlobs(const Scene& scene);
};

void FileBytesTest::ExpectBlobs(const Scene& scene) {
  Process server = StartServer();
  const std::unique_ptr<store::Catalog> catalog = OpenCatalog();
  {
    Process worker = StartWorker();
    Import("a", absl::StrCat(scene.folder, "/", scene.source));
    Import("b", absl::StrCat(scene.folder, "/", scene.target));
  }
  EXPECT_EQ(catalog->GetAnimation("a")->blob(), scene.source_blob);
  EXPECT_EQ(catalog->GetAnimation("b")->blob(), scene.target_blob);

  // A thread that a busy machine holds up saves a later iteration than the first that is due.
  for (int run = 1; run <= kMaxRuns; ++run) {
    const jobs::Checkpoint checkpoint = RegisterWithALostWorker(*catalog);
    EXPECT_EQ(catalog->GetFamily("balls")->blob(), scene.family_blob);
    const auto* const state = std::get_if<registration::IterationState>(&checkpoint.state);
    if (state == nullptr || state->last.iteration != kCheckpointed) continue;
    const auto name = NameOf(*state);
    ASSERT_TRUE(name.ok()) << name.status();
    EXPECT_EQ(*name, scene.checkpoint_blob);
    return;
  }
  ADD_FAILURE() << "no checkpoint after iteration " << kCheckpointed << " in " << kMaxRuns
                << " registrations";
}

TEST_F(FileBytesTest, OfTwoDropsAreThoseOfTheTable) { ExpectBlobs(kTwoDrops); }

TEST_F(FileBytesTest, OfDamBreakAreThoseOfTheTable) { ExpectBlobs(kDamBreakClip); }

}  // namespace
}  // namespace liquidblend::e2e
