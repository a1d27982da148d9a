#include "server/frames/backends.h"

#include <functional>
#include <utility>

#include "absl/strings/str_cat.h"

namespace liquidblend::server {
namespace {

constexpr int kNumLoadThreads = 2;  // so that a small family need not wait for a large one
// Threads for probes: one for each shared question to the stores (SharedLook), and one that never
// waits for a store.
constexpr int kNumProbeThreads = 4;

absl::Status OutOfRange(absl::string_view field, int64_t value) {
  return absl::InvalidArgumentError(absl::StrCat("limit ", field, " is out of range: ", value));
}

}  // namespace

absl::Status Limits::Validate() const {
  if (max_upload_files < 1) return OutOfRange("max_upload_files", max_upload_files);
  if (max_upload_bytes < 1) return OutOfRange("max_upload_bytes", max_upload_bytes);
  if (max_chunk_bytes < 1) return OutOfRange("max_chunk_bytes", max_chunk_bytes);
  if (max_targets < 1) return OutOfRange("max_targets", max_targets);
  if (max_correspondences < 0) return OutOfRange("max_correspondences", max_correspondences);
  if (max_all_correspondences < 0) {
    return OutOfRange("max_all_correspondences", max_all_correspondences);
  }
  if (worker_memory_bytes < 0) return OutOfRange("worker_memory_bytes", worker_memory_bytes);
  if (keep_versions < 1) return OutOfRange("keep_versions", keep_versions);
  if (max_stored_bytes < 0) return OutOfRange("max_stored_bytes", max_stored_bytes);
  if (disk_reserve_bytes < 0) return OutOfRange("disk_reserve_bytes", disk_reserve_bytes);
  if (max_stream_bytes < 0) return OutOfRange("max_stream_bytes", max_stream_bytes);
  if (watch_interval <= absl::ZeroDuration()) {
    return absl::InvalidArgumentError(absl::StrCat("limit watch_interval is out of range: ",
                                                   absl::FormatDuration(watch_interval)));
  }
  return absl::OkStatus();
}

Backends::Backends(store::Catalog& catalog_store, store::BlobStore& blob_store,
                   liquidblend::catalog::Families& loaded_families, const BackendsOptions& options)
    : catalog(catalog_store),
      blobs(blob_store),
      families(loaded_families),
      limits(options.limits),
      tracer(options.tracer != nullptr ? options.tracer : std::make_shared<const trace::Tracer>()),
      preloader(std::make_shared<liquidblend::catalog::Preloader>(catalog, families)),
      certificate_expiry(options.certificate_expiry),
      frame_cache(options.frame_cache_bytes),
      unread(options.unread),
      call_log([this](absl::Duration delay, std::function<void()> work) {
        steps.PostAfter(delay, std::move(work));
      }),
      animations(blob_store),
      open_blobs(blob_store),
      operation_looks(io, steps, limits.watch_interval),
      io(options.num_io_threads, options.max_waiting_calls),
      transfers(options.num_io_threads, options.max_waiting_calls),
      loads(kNumLoadThreads, options.max_waiting_calls),
      probes(kNumProbeThreads, options.max_waiting_calls),
      steps(1, options.max_waiting_calls),
      frames(options.num_frame_threads, options.queue),
      maker(frame_cache, frames, buffers, uses, metrics) {}

void Backends::Stop() {
  io.Stop();
  transfers.Stop();
  loads.Stop();
  probes.Stop();
  frames.Stop();
  steps.Stop();
  call_log.Flush();
}

}  // namespace liquidblend::server
