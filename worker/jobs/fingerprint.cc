#include "worker/jobs/fingerprint.h"

#include <fcntl.h>
#include <sys/stat.h>

#include <span>

#include "core/base/log.h"
#include "core/base/posix_file.h"
#include "core/base/random_id.h"
#include "core/base/status_macros.h"
#include "core/store/blobs/content_hash.h"
#include "worker/jobs/target_files.h"

namespace liquidblend::jobs {
namespace {

constexpr char kProgramFile[] = "/proc/self/exe";  // also when another has taken its place

absl::StatusOr<std::string> HashOfProgram() {
  const std::string path = kProgramFile;
  LB_ASSIGN_OR_RETURN(const base::FileHandle file, base::OpenFile(path, O_RDONLY));
  struct stat info;
  if (fstat(file.fd(), &info) != 0) return base::ErrnoStatus(errno, "stat", path);
  store::BlobHasher hasher(store::HashKind::kXxh3_128);
  LB_RETURN_IF_ERROR(base::ReadAll(file, static_cast<size_t>(info.st_size), path,
                                   [&](std::span<const std::byte> bytes) { hasher.Add(bytes); }));
  return hasher.Id();
}

// If the program cannot be identified, this process counts as a program of its own.
std::string ProgramId() {
  static const std::string id = [] {
    const absl::StatusOr<std::string> hash = HashOfProgram();
    if (hash.ok()) return *hash;
    base::LogWarning("cannot identify the program, checkpoints are for this process alone: " +
                     hash.status().ToString());
    return base::RandomHex(16);
  }();
  return id;
}

void Add(const std::string& text, store::BlobHasher& hasher) {
  const uint64_t size = text.size();
  hasher.Add(std::as_bytes(std::span(&size, 1)));
  hasher.Add(std::as_bytes(std::span(text)));
}

}  // namespace

std::string FingerprintOf(const store::v1::RegisterJob& job, int target_index,
                          const mesh::SpaceTimeMesh& source, const mesh::SpaceTimeMesh& target,
                          const mesh::RegisteredFamily* previous) {
  store::BlobHasher hasher(store::HashKind::kXxh3_128);
  Add(ProgramId(), hasher);
  Add(job.SerializeAsString(), hasher);
  Add(std::to_string(target_index), hasher);
  Add(HashOf(source), hasher);
  Add(HashOf(target), hasher);
  if (previous != nullptr) hasher.Add(std::as_bytes(previous->targets[target_index].displacement));
  return hasher.Id();
}

}  // namespace liquidblend::jobs
