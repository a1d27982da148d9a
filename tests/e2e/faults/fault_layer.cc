// The library itself: calls of libc, each the same unless a fault is due. See fault_layer.h.
#include "tests/e2e/faults/fault_layer.h"

#include <dlfcn.h>
#include <fcntl.h>
#include <linux/futex.h>
#include <signal.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <sys/time.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cerrno>
#include <climits>
#include <cstdarg>
#include <cstdlib>
#include <ctime>
#include <filesystem>
#include <string>
#include <string_view>
#include <system_error>

#include "tests/e2e/faults/fault_disk.h"

namespace liquidblend::e2e {
namespace {

// The call that this library stands in front of, found out when it is first made. Made as a
// constant: the guards of other static variables are calls of a sanitizer's runtime, which makes
// some of the calls below while it starts. Nor do others wait while it is found out: they would by
// these very calls.
template <typename Function>
class Next {
 public:
  explicit constexpr Next(const char* name) : name_(name) {}
  template <typename... Arguments>
  auto operator()(Arguments... arguments) {
    Function* found = found_;
    if (found == nullptr) {
      found = reinterpret_cast<Function*>(dlsym(RTLD_NEXT, name_));
      found_ = found;
    }
    return found(arguments...);
  }

 private:
  const char* const name_;
  std::atomic<Function*> found_ = nullptr;
};

std::string Variable(const char* name) {
  const char* const value = std::getenv(name);
  return value == nullptr ? "" : value;
}

struct Layer {
  const std::string folder = Variable(kFaultFolderVariable);
  const std::string own = Variable(kFaultOwnVariable);
  const bool has_disk = !Variable(kFaultDiskVariable).empty();
  FaultControl* control = own.empty() ? nullptr : MapFaultControl(FaultControlFile(own));
};

// None until this library is ready: making it calls what stands below.
std::atomic<const Layer*> the_layer = nullptr;

__attribute__((constructor)) void MakeLayer() { the_layer = new Layer(); }

// Until the library is ready no memory is asked for: a sanitizer's runtime, which makes calls of
// its own while it starts, could not give any.
bool IsReady() {
  const Layer* const layer = the_layer;
  return layer != nullptr && layer->control != nullptr;
}

bool IsConcerned(std::string_view path) {
  return IsReady() && path.starts_with(the_layer.load()->folder);
}

std::string PathOf(int fd) {
  std::array<char, PATH_MAX> path;
  const std::string link = "/proc/self/fd/" + std::to_string(fd);
  const ssize_t size = readlink(link.c_str(), path.data(), path.size());
  return size < 0 ? "" : std::string(path.data(), static_cast<size_t>(size));
}
bool IsConcerned(int fd) { return IsReady() && IsConcerned(PathOf(fd)); }

// Whether this call is one of those that fail; then errno says how.
bool Fails(FaultyCall call) {
  FaultControl& control = *the_layer.load()->control;
  if (control.is_off) raise(SIGKILL);
  if (control.call != call) return false;
  const int64_t number = ++control.num_calls;
  if (number < control.first || number >= control.first + control.num_failing) return false;
  ++control.num_failed;
  errno = control.error_number;
  return true;
}

// A full disk takes a part before it takes nothing.
size_t Part(size_t size) {
  const FaultControl& control = *the_layer.load()->control;
  const bool is_before =
      control.call == FaultyCall::kWrite && control.num_calls + 1 == control.first;
  return is_before && control.error_number == ENOSPC && size > 1 ? size / 2 : size;
}

// What is below the folder. Files may come and go meanwhile.
int64_t UsedBytes() {
  namespace fs = std::filesystem;
  int64_t num_bytes = 0;
  std::error_code error;
  for (fs::recursive_directory_iterator entry(the_layer.load()->folder, error), end;
       !error && entry != end; entry.increment(error)) {
    std::error_code gone;
    const bool is_file = entry->is_regular_file(gone);
    const uintmax_t size = is_file ? entry->file_size(gone) : 0;
    if (!gone) num_bytes += static_cast<int64_t>(size);
  }
  return num_bytes;
}

// How much of a write the disk takes; 0: it is full.
size_t TakenBy(size_t size) {
  FaultControl& control = *the_layer.load()->control;
  const int64_t disk_bytes = control.disk_bytes;
  if (disk_bytes == 0) return size;
  const int64_t num_free = disk_bytes - UsedBytes();
  if (num_free > 0) return std::min(size, static_cast<size_t>(num_free));
  ++control.num_failed;
  errno = ENOSPC;
  return 0;
}

// Flushes by `flush`, and tells the disk; one program at a time, so that the power goes for all at
// once.
template <typename Flush>
int SyncTo(int fd, const Flush& flush) {
  if (!IsConcerned(fd)) return flush();
  if (Fails(FaultyCall::kSync)) return -1;
  const Layer& layer = *the_layer.load();
  if (!layer.has_disk) return flush();
  const int turn = open((layer.own + "/turn").c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0644);
  flock(turn, LOCK_EX);
  FaultControl& control = *layer.control;
  if (++control.num_syncs == control.off_at_sync) control.is_off = true;
  if (control.is_off) raise(SIGKILL);
  const int result = flush();
  struct stat info = {};
  const bool is_folder = fstat(fd, &info) == 0 && S_ISDIR(info.st_mode);
  (is_folder ? KeepFolder : KeepFile)(FaultDiskFolder(layer.own), PathOf(fd));
  close(turn);
  return result;
}

int64_t AheadUs() {
  const Layer* const layer = the_layer;
  return layer == nullptr || layer->control == nullptr ? 0 : layer->control->clock_ahead_us.load();
}

timespec RealTime() {
  timespec time = {};
  syscall(SYS_clock_gettime, CLOCK_REALTIME, &time);
  const int64_t us = time.tv_nsec / 1000 + AheadUs();
  const int64_t seconds = us >= 0 ? us / 1000000 : -((-us + 999999) / 1000000);
  time.tv_sec += seconds;
  time.tv_nsec = (us - seconds * 1000000) * 1000;
  return time;
}

bool IsBefore(const timespec& a, const timespec& b) {
  return a.tv_sec != b.tv_sec ? a.tv_sec < b.tv_sec : a.tv_nsec < b.tv_nsec;
}

// What the kernel does with a wait until a time of day: the clock may be set meanwhile.
template <typename Wait>
long WaitUntil(const timespec& end, const Wait& wait) {
  constexpr long kSliceNs = 10'000'000;
  while (IsBefore(RealTime(), end)) {
    timespec slice = {};
    syscall(SYS_clock_gettime, CLOCK_REALTIME, &slice);
    slice.tv_nsec += kSliceNs;
    if (slice.tv_nsec >= 1'000'000'000) {
      slice.tv_nsec -= 1'000'000'000;
      ++slice.tv_sec;
    }
    const long result = wait(&slice);
    if (result == 0 || errno != ETIMEDOUT) return result;
  }
  errno = ETIMEDOUT;
  return -1;
}

bool IsNew(const char* path) {
  struct stat info = {};
  return lstat(path, &info) != 0;
}

using OpenCall = int(const char*, int, ...);

int OpenBy(Next<OpenCall>& next, const char* path, int flags, int mode) {
  const bool is_new = (flags & O_CREAT) != 0 && IsConcerned(path) && IsNew(path);
  if (is_new && Fails(FaultyCall::kCreate)) return -1;
  return next(path, flags, mode);
}

int ModeOf(int flags, va_list arguments) {
  return (flags & O_CREAT) != 0 ? va_arg(arguments, int) : 0;
}

}  // namespace
}  // namespace liquidblend::e2e

using namespace liquidblend::e2e;  // NOLINT: what follows has to be outside of it

extern "C" {

ssize_t write(int fd, const void* bytes, size_t size) {
  const bool is_concerned = IsConcerned(fd);
  if (is_concerned) size = Part(size);
  if (is_concerned && Fails(FaultyCall::kWrite)) return -1;
  if (is_concerned && size > 0 && (size = TakenBy(size)) == 0) return -1;
  static constinit Next<ssize_t(int, const void*, size_t)> next("write");
  return next(fd, bytes, size);
}

ssize_t pwrite64(int fd, const void* bytes, size_t size, off_t offset) {
  const bool is_concerned = IsConcerned(fd);
  if (is_concerned) size = Part(size);
  if (is_concerned && Fails(FaultyCall::kWrite)) return -1;
  static constinit Next<ssize_t(int, const void*, size_t, off_t)> next("pwrite64");
  return next(fd, bytes, size, offset);
}
ssize_t pwrite(int fd, const void* bytes, size_t size, off_t offset) {
  return pwrite64(fd, bytes, size, offset);
}

int ftruncate64(int fd, off_t size) noexcept {
  if (IsConcerned(fd) && Fails(FaultyCall::kWrite)) return -1;
  static constinit Next<int(int, off_t)> next("ftruncate64");
  return next(fd, size);
}
int ftruncate(int fd, off_t size) noexcept { return ftruncate64(fd, size); }

int fsync(int fd) {
  static constinit Next<int(int)> next("fsync");
  return SyncTo(fd, [&] { return next(fd); });
}
int fdatasync(int fd) {
  static constinit Next<int(int)> next("fdatasync");
  return SyncTo(fd, [&] { return next(fd); });
}

int rename(const char* from, const char* to) noexcept {
  if (IsConcerned(to) && Fails(FaultyCall::kRename)) return -1;
  static constinit Next<int(const char*, const char*)> next("rename");
  return next(from, to);
}
int unlink(const char* path) noexcept {
  if (IsConcerned(path) && Fails(FaultyCall::kRename)) return -1;
  static constinit Next<int(const char*)> next("unlink");
  return next(path);
}

int mkdir(const char* path, mode_t mode) noexcept {
  if (IsConcerned(path) && IsNew(path) && Fails(FaultyCall::kCreate)) return -1;
  static constinit Next<int(const char*, mode_t)> next("mkdir");
  return next(path, mode);
}
int open(const char* path, int flags, ...) {
  va_list arguments;
  va_start(arguments, flags);
  const int mode = ModeOf(flags, arguments);
  va_end(arguments);
  static constinit Next<OpenCall> next("open");
  return OpenBy(next, path, flags, mode);
}
int open64(const char* path, int flags, ...) {
  va_list arguments;
  va_start(arguments, flags);
  const int mode = ModeOf(flags, arguments);
  va_end(arguments);
  static constinit Next<OpenCall> next("open64");
  return OpenBy(next, path, flags, mode);
}

int clock_gettime(clockid_t clock, timespec* time) noexcept {
  if (clock != CLOCK_REALTIME || AheadUs() == 0) {
    static constinit Next<int(clockid_t, timespec*)> next("clock_gettime");
    return next(clock, time);
  }
  *time = RealTime();
  return 0;
}
int gettimeofday(timeval* time, void*) noexcept {
  const timespec now = RealTime();
  *time = {now.tv_sec, now.tv_nsec / 1000};
  return 0;
}
time_t time(time_t* where) noexcept {
  const time_t now = RealTime().tv_sec;
  if (where != nullptr) *where = now;
  return now;
}

// Abseil waits until times of day.
long syscall(long number, ...) noexcept {
  using Call = long(long, long, long, long, long, long, long);
  static constinit Next<Call> next("syscall");
  long a[6];
  va_list arguments;
  va_start(arguments, number);
  for (long& argument : a) argument = va_arg(arguments, long);
  va_end(arguments);
  const auto* const end = reinterpret_cast<const timespec*>(a[3]);
  if (number != SYS_futex || (a[1] & FUTEX_CLOCK_REALTIME) == 0 || end == nullptr) {
    return next(number, a[0], a[1], a[2], a[3], a[4], a[5]);
  }
  return WaitUntil(*end, [&](const timespec* slice) {
    return next(number, a[0], a[1], a[2], reinterpret_cast<long>(slice), a[4], a[5]);
  });
}

}  // extern "C"
