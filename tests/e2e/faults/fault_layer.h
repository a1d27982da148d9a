// What a preloaded library (fault_layer.cc) does to a program under test: calls on files that fail,
// a disk that loses what was not flushed, a clock that is set. The driver says when, through a file
// that both have mapped.
#pragma once

#include <atomic>
#include <cstdint>
#include <string>
#include <vector>

namespace liquidblend::e2e {

// Which calls fail; the others of the program are not counted.
enum class FaultyCall : int {
  kNone,
  kWrite,   // write, pwrite, ftruncate
  kSync,    // fsync, fdatasync
  kRename,  // rename, unlink
  kCreate,  // open of what is not there, mkdir
};

// All of it may change while programs run. All zero: no fault.
struct FaultControl {
  // Calls on what is below the folder, of all programs together. `first` counts from 1.
  std::atomic<FaultyCall> call;
  std::atomic<int> error_number;
  std::atomic<int64_t> first;
  std::atomic<int64_t> num_failing;  // from the first on
  std::atomic<int64_t> num_calls;    // so far
  std::atomic<int64_t> num_failed;
  // Writes fail with ENOSPC, too, once what is below the folder takes so many bytes. 0: never.
  std::atomic<int64_t> disk_bytes;
  // Instead of this flush all programs are killed: the power is off. 0: never.
  std::atomic<int64_t> off_at_sync;
  std::atomic<int64_t> num_syncs;
  std::atomic<bool> is_off;
  // What CLOCK_REALTIME is ahead of the machine's.
  std::atomic<int64_t> clock_ahead_us;
};

// The driver's side.  Threads: safe.
class FaultLayer {
 public:
  //   folder    whose files are concerned
  //   own       a folder for what the library keeps, outside of `folder`
  //   has_disk  whether to remember what was flushed (fault_disk.h)
  FaultLayer(const std::string& folder, const std::string& own, bool has_disk);
  ~FaultLayer();
  FaultLayer(const FaultLayer&) = delete;
  FaultLayer& operator=(const FaultLayer&) = delete;

  // For the programs that are to have it, as NAME=VALUE.
  std::vector<std::string> environment() const;
  FaultControl& control() { return *control_; }
  // The `disk` of fault_disk.h.
  std::string disk() const;
  // From now on the calls from the first-th of this kind on fail, num_failing of them.
  void FailCalls(FaultyCall call, int error_number, int64_t first, int64_t num_failing);
  void Heal() { control_->call = FaultyCall::kNone; }

 private:
  const std::string folder_;
  const std::string own_;
  const bool has_disk_;
  FaultControl* control_ = nullptr;
};

// The file below `own` that both sides map, and the folder of fault_disk.h.
std::string FaultControlFile(const std::string& own);
std::string FaultDiskFolder(const std::string& own);
FaultControl* MapFaultControl(const std::string& path);

inline constexpr char kFaultFolderVariable[] = "LIQUIDBLEND_FAULT_FOLDER";
inline constexpr char kFaultOwnVariable[] = "LIQUIDBLEND_FAULT_OWN";
inline constexpr char kFaultDiskVariable[] = "LIQUIDBLEND_FAULT_DISK";

}  // namespace liquidblend::e2e
