#include "core/store/blobs/mapped_file.h"

#include <signal.h>
#include <sys/mman.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <cstdint>
#include <mutex>

#include "absl/strings/str_cat.h"

namespace liquidblend::store {
namespace {

// One mapped range, as the signal handler sees it. Entries are linked once, never freed, and used
// again for other ranges, so that the handler can walk the list without a lock.
struct MappedRange {
  std::atomic<bool> is_used = false;
  std::atomic<uintptr_t> begin = 0;  // 0: no range
  std::atomic<uintptr_t> end = 0;
  std::atomic<bool> is_damaged = false;
  MappedRange* next = nullptr;
};

std::atomic<MappedRange*> first_range = nullptr;
struct sigaction previous_action;

MappedRange* TakeRange() {
  for (MappedRange* range = first_range.load(); range != nullptr; range = range->next) {
    bool is_used = false;
    if (range->is_used.compare_exchange_strong(is_used, true)) return range;
  }
  auto* const range = new MappedRange;
  range->is_used = true;
  range->next = first_range.load();
  while (!first_range.compare_exchange_weak(range->next, range)) {
  }
  return range;
}

MappedRange* FindRange(uintptr_t address) {
  for (MappedRange* range = first_range.load(); range != nullptr; range = range->next) {
    if (range->begin.load() != 0 && range->begin.load() <= address && address < range->end.load()) {
      return range;
    }
  }
  return nullptr;
}

// Handler of SIGBUS: maps a page of zeros over the page that could not be read. It calls only
// functions that a signal handler may call.
void OnBusError(int number, siginfo_t* info, void* context) {
  static const auto page_bytes = static_cast<uintptr_t>(sysconf(_SC_PAGESIZE));
  const auto address = reinterpret_cast<uintptr_t>(info->si_addr);
  MappedRange* const range = FindRange(address);
  if (range != nullptr) {
    range->is_damaged = true;
    void* const page = reinterpret_cast<void*>(address / page_bytes * page_bytes);
    const int saved_errno = errno;
    void* const zeros =
        mmap(page, page_bytes, PROT_READ, MAP_PRIVATE | MAP_ANONYMOUS | MAP_FIXED, -1, 0);
    errno = saved_errno;
    if (zeros != MAP_FAILED) return;
  }
  // Not in a mapped file: the fault repeats under the previous action, which usually ends the
  // process.
  if ((previous_action.sa_flags & SA_SIGINFO) != 0 && previous_action.sa_sigaction != nullptr) {
    return previous_action.sa_sigaction(number, info, context);
  }
  signal(number, SIG_DFL);
}

class MappedBlob final : public Blob {
 public:
  MappedBlob(void* start, size_t size, std::string path)
      : start_(start), size_(size), path_(std::move(path)), range_(TakeRange()) {
    range_->is_damaged = false;
    range_->end = reinterpret_cast<uintptr_t>(start_) + size_;
    range_->begin = reinterpret_cast<uintptr_t>(start_);
  }
  MappedBlob(const MappedBlob&) = delete;
  MappedBlob& operator=(const MappedBlob&) = delete;
  ~MappedBlob() override {
    range_->begin = 0;
    munmap(start_, size_);
    range_->is_used = false;
  }
  std::span<const std::byte> bytes() const override {
    return {static_cast<const std::byte*>(start_), size_};
  }
  absl::Status Check() const override {
    if (!range_->is_damaged) return absl::OkStatus();
    return absl::DataLossError(
        absl::StrCat("a part of ", path_, " cannot be read any more: the disk may be failing"));
  }

 private:
  void* const start_;
  const size_t size_;
  const std::string path_;
  MappedRange* const range_;
};

class EmptyBlob final : public Blob {
 public:
  std::span<const std::byte> bytes() const override { return {}; }
};

}  // namespace

void SurviveUnreadablePages() {
  static std::once_flag installed;
  std::call_once(installed, [] {
    struct sigaction action = {};
    action.sa_sigaction = OnBusError;
    action.sa_flags = SA_SIGINFO;
    sigemptyset(&action.sa_mask);
    sysconf(_SC_PAGESIZE);
    sigaction(SIGBUS, &action, &previous_action);
  });
}

absl::StatusOr<std::shared_ptr<const Blob>> MapFile(const base::FileHandle& file, size_t size,
                                                    const std::string& path) {
  if (size == 0) return std::make_shared<EmptyBlob>();
  void* const start = mmap(nullptr, size, PROT_READ, MAP_SHARED, file.fd(), 0);
  if (start == MAP_FAILED) return base::ErrnoStatus(errno, "map", path);
  return std::make_shared<MappedBlob>(start, size, path);
}

}  // namespace liquidblend::store
