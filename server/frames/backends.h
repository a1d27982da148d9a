// Backends of the methods: stores, families, caches and thread pools. Knows no gRPC.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/time/time.h"
#include "core/store/blobs/blob_store.h"
#include "core/store/catalog/catalog.h"
#include "core/trace/tracer.h"
#include "server/access/call_log.h"
#include "server/access/upload_tally.h"
#include "server/base/operation_looks.h"
#include "server/base/work_pool.h"
#include "server/catalog/families.h"
#include "server/catalog/family_uses.h"
#include "server/catalog/preloader.h"
#include "server/frames/frame_cache.h"
#include "server/frames/frame_maker.h"
#include "server/frames/frame_pool.h"
#include "server/frames/open_files.h"
#include "server/frames/unread_answers.h"
#include "server/metrics/metrics.h"

namespace liquidblend::server {

// Limits of requests and of the store.
struct Limits {
  int max_upload_files = 20'000;                            // >= 1
  int64_t max_upload_bytes = int64_t{64} << 30;             // >= 1; all files of an upload
  int64_t max_chunk_bytes = int64_t{1} << 20;               // >= 1
  int max_targets = 16;                                     // >= 1; of a family
  int max_correspondences = 10'000;                         // >= 0; per target
  int max_all_correspondences = 50'000;                     // >= 0; of a registration
  absl::Duration watch_interval = absl::Milliseconds(150);  // > 0; between two looks at a job
  // >= 0; of a stream, the frame under way and the one made ahead. A frame by itself may be larger.
  int64_t max_stream_bytes = int64_t{16} << 20;
  // >= 0; the largest job that the server's own workers take. 0: not known, and no job is refused.
  int64_t worker_memory_bytes = 0;
  int keep_versions = 2;           // >= 1; of a family, the published one counted
  int64_t max_stored_bytes = 0;    // >= 0; of all owners together; 0: as much as there is room for
  std::string disk;                // a folder on the disk of the store; empty: not known
  int64_t disk_reserve_bytes = 0;  // >= 0; with less free there, nothing more is accepted; 0: none
  absl::Status Validate() const;   // names the first field out of range, and its value
};

// Options of the backends: limits, numbers of threads, memory.
struct BackendsOptions {
  Limits limits;
  // When the server's certificate expires; empty: no TLS.
  std::function<absl::StatusOr<absl::Time>()> certificate_expiry;
  int num_io_threads = 4;                          // >= 1; for the catalog, and again for blobs
  int num_frame_threads = 2;                       // >= 1
  int max_waiting_calls = 1000;                    // >= 1; for an io thread; more are refused
  FrameQueueOptions queue;                         // of frames to be made
  int64_t frame_cache_bytes = int64_t{256} << 20;  // >= 0
  UnreadAnswersOptions unread;                     // answers on their way to clients
  // Tracer of calls; null: they are not traced.
  std::shared_ptr<const trace::Tracer> tracer;
};

// Backends that all calls share. It outlives every call.
struct Backends {
  // The stores and families outlive it.
  Backends(store::Catalog& catalog, store::BlobStore& blobs,
           liquidblend::catalog::Families& families, const BackendsOptions& options);
  // Stop(): threads of one pool use the others to their end.
  ~Backends() { Stop(); }
  Backends(const Backends&) = delete;
  Backends& operator=(const Backends&) = delete;

  // Runs accepted work, then ends all threads. Idempotent.
  void Stop();

  store::Catalog& catalog;
  store::BlobStore& blobs;
  liquidblend::catalog::Families& families;
  const Limits limits;
  const std::shared_ptr<const trace::Tracer> tracer;  // never null
  liquidblend::catalog::FamilyUses uses;
  const std::shared_ptr<liquidblend::catalog::Preloader> preloader;
  const std::function<absl::StatusOr<absl::Time>()> certificate_expiry;
  FrameCache frame_cache;
  UnreadAnswers unread;
  FrameBufferPool buffers;
  metrics::Metrics metrics;
  CallLog call_log;
  UploadTally uploads;
  OpenAnimations animations;
  OpenBlobs open_blobs;
  OperationLooks operation_looks;
  WorkPool io;         // waits for the catalog, and never for blobs
  WorkPool transfers;  // waits for blobs, which may be far away: uploads and signed urls
  WorkPool loads;      // loads families
  WorkPool probes;     // asks the stores for probes and metrics
  WorkPool steps;      // decides what streams send next; never waits
  FramePool frames;    // computes
  FrameMaker maker;
};

}  // namespace liquidblend::server
