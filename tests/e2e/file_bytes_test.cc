// Bytes of animation, checkpoint and family files, compared with a table of hashes. A change that
// alters them on purpose updates the table, and its commit gives the effect on the accuracy.
#include <signal.h>

#include <memory>
#include <string>
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

// Blobs of tests/data/two_drops, A to B, by name, which is the SHA-256 of their bytes. They hold
// for x86-64 and the libm of Debian 12.
constexpr char kAnimationA[] =
    "sha256-8c2dd9a052e7d41e10c7660837ba75460c5960cf1af0916c54a8e79222e3d03a";
constexpr char kAnimationB[] =
    "sha256-dbd2e039ff096d3f86c996f496f4a787a5861801dd9617d1ab28f54b591264a5";
constexpr char kCheckpoint[] =
    "sha256-44a76548196adfd4401cb5ac29804833ad8cbba7b0303d5a259bd5bd0f89942b";
constexpr char kFamily[] =
    "sha256-60b52a60379ac0fe3940f5df7192a5451e1c188a309d1da273d8f138f11e8f18";

class FileBytesTest : public E2eTest {
 protected:
  void Import(const std::string& id, const std::string& name) {
    const auto read =
        ingest::LoadDirectory(paths::Source(absl::StrCat("tests/data/two_drops/", name)));
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

  // Name of the blob with a checkpoint's state alone: without its label (lease, number,
  // fingerprint) and the time that was worked, which differ between runs and programs.
  absl::StatusOr<std::string> NameOfState(const std::string& checkpoint_blob) {
    LB_ASSIGN_OR_RETURN(const auto blobs, store::OpenLocalBlobStore(data()));
    LB_ASSIGN_OR_RETURN(const auto blob, blobs->Open(checkpoint_blob));
    LB_ASSIGN_OR_RETURN(auto checkpoint, jobs::ReadCheckpoint(*blob, "the checkpoint"));
    std::visit([](auto& state) { state.seconds = 0.0; }, checkpoint.state);
    LB_ASSIGN_OR_RETURN(const auto writer, blobs->Create());
    LB_RETURN_IF_ERROR(jobs::WriteCheckpoint({}, checkpoint.state, *writer));
    return writer->Commit();
  }
};

TEST_F(FileBytesTest, OfTwoDropsAreThoseOfTheTable) {
  Process server = StartServer();
  const std::unique_ptr<store::Catalog> catalog = OpenCatalog();
  {
    Process worker = StartWorker();
    Import("a", "A");
    Import("b", "B");
  }
  EXPECT_EQ(catalog->GetAnimation("a")->blob(), kAnimationA);
  EXPECT_EQ(catalog->GetAnimation("b")->blob(), kAnimationB);

  Operation registration;
  ASSERT_TRUE(Register(4, registration).ok());
  Process killed = StartWorker(
      {"LIQUIDBLEND_CHECKPOINT_INTERVAL=1ms", "LIQUIDBLEND_FAULT_POINT=checkpoint.after_commit"});
  EXPECT_EQ(killed.Wait(), -SIGKILL);
  const std::string id = registration.name().substr(std::string("operations/").size());
  const auto checkpoint = NameOfState(catalog->GetJob(id)->checkpoint_blob());
  ASSERT_TRUE(checkpoint.ok()) << checkpoint.status();
  EXPECT_EQ(*checkpoint, kCheckpoint);

  Process worker = StartWorker();
  ExpectSuccess(AwaitDone(registration.name()));
  EXPECT_EQ(catalog->GetFamily("balls")->blob(), kFamily);
}

}  // namespace
}  // namespace liquidblend::e2e
