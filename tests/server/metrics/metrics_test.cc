#include "server/metrics/metrics.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdlib>
#include <memory>
#include <thread>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/time/clock.h"
#include "core/base/version.h"
#include "server/metrics/process.h"
#include "tests/allocation_testing.h"

namespace liquidblend::metrics {
namespace {

using testing::HasSubstr;
using testing::Not;

StageTimes Times(int slice_ms, int finish_ms, int encode_ms) {
  return {absl::Milliseconds(slice_ms), absl::Milliseconds(finish_ms),
          absl::Milliseconds(encode_ms)};
}

TEST(Metrics, FramesAreCountedByFamilyAndPreset) {
  Metrics metrics;
  metrics.CountFrame("splash", "fastest", 1000, Times(1, 0, 2));
  metrics.CountFrame("splash", "fastest", 500, Times(1, 0, 2));
  metrics.CountFrame("splash", "smallest", 10, Times(1, 0, 2));
  const std::string text = metrics.Text({});
  EXPECT_THAT(text,
              HasSubstr("liquidblend_frames_total{family=\"splash\",preset=\"fastest\"} 2\n"));
  EXPECT_THAT(
      text, HasSubstr("liquidblend_frame_bytes_total{family=\"splash\",preset=\"fastest\"} 1500"));
  EXPECT_THAT(text,
              HasSubstr("liquidblend_frames_total{family=\"splash\",preset=\"smallest\"} 1\n"));
}

TEST(Metrics, StagesHaveHistogramsInSeconds) {
  Metrics metrics;
  metrics.CountFrame("splash", "fastest", 1, Times(2, 0, 4));
  metrics.ObserveStage(Stage::kQueue, absl::Milliseconds(30));
  const std::string text = metrics.Text({});
  EXPECT_THAT(text, HasSubstr("# TYPE liquidblend_frame_stage_seconds histogram"));
  EXPECT_THAT(text, HasSubstr("liquidblend_frame_stage_seconds_sum{stage=\"slice\"} 0.002\n"));
  EXPECT_THAT(text, HasSubstr("liquidblend_frame_stage_seconds_sum{stage=\"encode\"} 0.004\n"));
  EXPECT_THAT(text,
              HasSubstr("liquidblend_frame_stage_seconds_bucket{stage=\"encode\",le=\"0.003\"} 0"));
  EXPECT_THAT(text,
              HasSubstr("liquidblend_frame_stage_seconds_bucket{stage=\"encode\",le=\"0.005\"} 1"));
  EXPECT_THAT(text, HasSubstr("liquidblend_frame_stage_seconds_count{stage=\"queue\"} 1\n"));
  EXPECT_THAT(text, HasSubstr("liquidblend_frame_stage_seconds_count{stage=\"write\"} 0\n"));
}

TEST(Metrics, RequestsAreCountedByProtocolMethodAndCode) {
  Metrics metrics;
  metrics.CountRequest({"grpc", "GetFrame", "OK", absl::Milliseconds(3)});
  metrics.CountRequest({"grpc", "GetFrame", "NOT_FOUND", absl::Milliseconds(1)});
  metrics.CountRequest({"http", "GET /metrics", "200", absl::Milliseconds(1)});
  const std::string text = metrics.Text({});
  for (const char* line :
       {"liquidblend_requests_total{code=\"OK\",method=\"GetFrame\",protocol=\"grpc\"} 1\n",
        "liquidblend_requests_total{code=\"NOT_FOUND\",method=\"GetFrame\",protocol=\"grpc\"} 1\n",
        "liquidblend_requests_total{code=\"200\",method=\"GET /metrics\",protocol=\"http\"} 1\n",
        "liquidblend_request_seconds_count{method=\"GetFrame\",protocol=\"grpc\"} 2\n"}) {
    EXPECT_THAT(text, HasSubstr(line));
  }
}

TEST(Metrics, DropsAndConnectionsAreCounted) {
  Metrics metrics;
  metrics.CountDroppedFrames("splash", 3);
  metrics.CountDroppedFrames("splash", 4);
  metrics.AddConnections("websocket", 1);
  metrics.AddConnections("websocket", 1);
  metrics.AddConnections("websocket", -1);
  metrics.CountRefusedConnection();
  const std::string text = metrics.Text({});
  EXPECT_THAT(text, HasSubstr("liquidblend_frames_dropped_total{family=\"splash\"} 7\n"));
  EXPECT_THAT(text, HasSubstr("liquidblend_http_connections{kind=\"websocket\"} 1\n"));
  EXPECT_THAT(text, HasSubstr("liquidblend_http_connections_refused_total 1\n"));
}

TEST(Metrics, ASnapshotIsShownAsItIs) {
  const Metrics metrics;
  Snapshot now;
  now.family_bytes = {{"splash", 4096}, {"dam", 100}};
  now.catalog = CatalogFigures{
      .jobs = {{"queued", 2}, {"running", 1}},
      .workers = {{"ready", 4}},
      .jobs_within_memory = {{"running", {{"4GiB", 7}, {"any", 8}}}},
      .queue = {.num_paused = 1, .num_too_large = 3, .oldest_wait = absl::Milliseconds(2500)}};
  now.waiting_calls = {{"io", 5}};
  now.frame_cache = {7, 8, 3, 900};
  now.frame_queue = {5000, 6};
  now.disks = {{"/data", {.free_bytes = 123, .size_bytes = 456, .reserve_bytes = 7}}};
  now.is_reachable = {{"catalog", true}, {"blobs", false}};
  now.spans = {11, {{"rate", 12}, {"queue", 0}}};
  now.certificate_expiry = absl::FromUnixSeconds(1700000000);
  const std::string text = metrics.Text(now);
  for (const char* line : {"liquidblend_family_bytes{family=\"dam\"} 100\n",
                           "liquidblend_family_bytes{family=\"splash\"} 4096\n",
                           "liquidblend_families_loaded 2\n",
                           "liquidblend_jobs{state=\"queued\"} 2\n",
                           "liquidblend_jobs_within_memory{memory=\"4GiB\",state=\"running\"} 7\n",
                           "liquidblend_waiting_calls{pool=\"io\"} 5\n",
                           "# TYPE liquidblend_frame_cache_hits_total counter",
                           "liquidblend_frame_cache_hits_total 7\n",
                           "liquidblend_frame_cache_misses_total 8\n",
                           "liquidblend_frame_cache_frames 3\n",
                           "liquidblend_frame_cache_bytes 900\n",
                           "liquidblend_frame_queue_cells 5000\n",
                           "liquidblend_frames_refused_total 6\n",
                           "liquidblend_jobs_paused 1\n",
                           "liquidblend_jobs_too_large 3\n",
                           "liquidblend_oldest_queued_job_seconds 2.5\n",
                           "liquidblend_workers{state=\"ready\"} 4\n",
                           "liquidblend_disk_free_bytes{disk=\"/data\"} 123\n",
                           "liquidblend_disk_size_bytes{disk=\"/data\"} 456\n",
                           "liquidblend_disk_reserve_bytes{disk=\"/data\"} 7\n",
                           "liquidblend_spans_exported_total 11\n",
                           "liquidblend_spans_dropped_total{reason=\"rate\"} 12\n",
                           "liquidblend_spans_dropped_total{reason=\"queue\"} 0\n",
                           "liquidblend_store_reachable{store=\"catalog\"} 1\n",
                           "liquidblend_store_reachable{store=\"blobs\"} 0\n",
                           "liquidblend_tls_certificate_expiry_timestamp_seconds 1700000000\n"}) {
    EXPECT_THAT(text, HasSubstr(line));
  }
}

TEST(Metrics, WhatASnapshotDoesNotKnowIsLeftOut) {
  const std::string text = Metrics().Text({});
  for (const char* name : {"liquidblend_jobs{", "liquidblend_jobs_paused", "liquidblend_owner_",
                           "liquidblend_max_stored_bytes ", "liquidblend_tls_"}) {
    EXPECT_THAT(text, Not(HasSubstr(absl::StrCat("\n", name)))) << name;
  }
}

TEST(Metrics, OwnersAreShownWithTheLimitsThatTheyHave) {
  Snapshot now;
  now.max_stored_bytes = 5000;
  now.owners = {
      {"studio", 1000, 2, {.max_stored_bytes = 2000, .max_queued_jobs = 0}},
      {"farm", 10, 0, {.max_stored_bytes = 0, .max_queued_jobs = 50}},
  };
  const std::string text = Metrics().Text(now);
  for (const char* line : {"liquidblend_owner_stored_bytes{owner=\"studio\"} 1000\n",
                           "liquidblend_owner_stored_bytes{owner=\"farm\"} 10\n",
                           "liquidblend_owner_queued_jobs{owner=\"studio\"} 2\n",
                           "liquidblend_owner_max_stored_bytes{owner=\"studio\"} 2000\n",
                           "liquidblend_owner_max_queued_jobs{owner=\"farm\"} 50\n",
                           "liquidblend_max_stored_bytes 5000\n"}) {
    EXPECT_THAT(text, HasSubstr(line));
  }
  EXPECT_THAT(text, Not(HasSubstr("liquidblend_owner_max_stored_bytes{owner=\"farm\"}")));
  EXPECT_THAT(text, Not(HasSubstr("liquidblend_owner_max_queued_jobs{owner=\"studio\"}")));
}

// Prometheus sees no growth in the first value of a counter.
TEST(Metrics, CountersBeginAtZero) {
  Metrics metrics;
  metrics.CountFrame("splash", "fastest", 1, {});
  const std::string text = metrics.Text({});
  for (const char* line :
       {"liquidblend_frames_dropped_total{family=\"splash\"} 0\n",
        "liquidblend_http_connections{kind=\"websocket\"} 0\n", "liquidblend_streams 0\n",
        "liquidblend_jobs_ended_total{code=\"INTERNAL\",kind=\"import\"} 0\n",
        "liquidblend_job_attempts_failed_total{kind=\"registration\",reason=\"worker_lost\"} 0\n",
        "liquidblend_job_seconds_count{kind=\"registration\",phase=\"work\"} 0\n",
        "liquidblend_collections_total{result=\"failed\"} 0\n",
        "liquidblend_collected_bytes_total 0\n"}) {
    EXPECT_THAT(text, HasSubstr(line));
  }
}

// Whatever code a job ends with first, an alert sees that it has ended.
TEST(Metrics, JobsAreCountedFromZeroForEveryCode) {
  const std::string text = Metrics().Text({});
  for (int code = 0; code <= 16; ++code) {
    const std::string name = absl::StatusCodeToString(static_cast<absl::StatusCode>(code));
    EXPECT_NE(name, "");
    for (const char* kind : {"import", "registration"}) {
      EXPECT_THAT(text, HasSubstr(absl::StrCat("\nliquidblend_jobs_ended_total{code=\"", name,
                                               "\",kind=\"", kind, "\"} 0\n")));
    }
  }
}

TEST(Metrics, JobsAreCountedByKindAndCode) {
  Metrics metrics;
  metrics.CountJob({.kind = "import",
                    .code = absl::StatusCode::kOk,
                    .waited = absl::Seconds(2),
                    .worked = absl::Seconds(20),
                    .num_lost = 2,
                    .num_failed = 1});
  EndedJob without_times;
  without_times.kind = "import";
  without_times.code = absl::StatusCode::kCancelled;
  metrics.CountJob(without_times);
  without_times.kind = "registration";
  without_times.code = absl::StatusCode::kUnimplemented;
  metrics.CountJob(without_times);
  const std::string text = metrics.Text({});
  for (const char* line :
       {"liquidblend_jobs_ended_total{code=\"OK\",kind=\"import\"} 1\n",
        "liquidblend_jobs_ended_total{code=\"CANCELLED\",kind=\"import\"} 1\n",
        "liquidblend_jobs_ended_total{code=\"UNIMPLEMENTED\",kind=\"registration\"} 1\n",
        "liquidblend_job_seconds_sum{kind=\"import\",phase=\"wait\"} 2\n",
        "liquidblend_job_seconds_sum{kind=\"import\",phase=\"work\"} 20\n",
        "liquidblend_job_seconds_count{kind=\"import\",phase=\"work\"} 1\n",
        "liquidblend_job_attempts_failed_total{kind=\"import\",reason=\"worker_lost\"} 2\n",
        "liquidblend_job_attempts_failed_total{kind=\"import\",reason=\"error\"} 1\n"}) {
    EXPECT_THAT(text, HasSubstr(line));
  }
}

TEST(Metrics, CollectionsAndStreamsAreCounted) {
  Metrics metrics;
  metrics.CountCollection({.is_ok = true, .num_blobs = 3, .num_bytes = 500});
  metrics.CountCollection({.is_ok = false});
  metrics.AddStreams(1);
  metrics.AddStreams(1);
  metrics.AddStreams(-1);
  const std::string text = metrics.Text({});
  for (const char* line : {"liquidblend_collections_total{result=\"ok\"} 1\n",
                           "liquidblend_collections_total{result=\"failed\"} 1\n",
                           "liquidblend_collected_blobs_total 3\n",
                           "liquidblend_collected_bytes_total 500\n", "liquidblend_streams 1\n"}) {
    EXPECT_THAT(text, HasSubstr(line));
  }
}

TEST(Metrics, VersionAndStartAreShown) {
  const absl::Time before = absl::Now();
  const std::string text = Metrics().Text({});
  EXPECT_THAT(text, HasSubstr(absl::StrCat("liquidblend_build_info{version=\"", base::Version(),
                                           "\"} 1\n")));
  const std::string name = "\nprocess_start_time_seconds ";
  const size_t at = text.find(name);
  ASSERT_NE(at, std::string::npos);
  const double start = std::strtod(text.c_str() + at + name.size(), nullptr);
  EXPECT_NEAR(start, absl::ToDoubleSeconds(before - absl::UnixEpoch()), 60.0);
}

TEST(Metrics, ManyFamiliesShareOneLabelInTheEnd) {
  Metrics metrics;
  for (int i = 0; i < 300; ++i) metrics.CountFrame(absl::StrCat("f", i), "fastest", 1, {});
  metrics.CountFrame("f0", "fastest", 1, {});
  const std::string text = metrics.Text({});
  EXPECT_THAT(text, HasSubstr("liquidblend_frames_total{family=\"f0\",preset=\"fastest\"} 2\n"));
  EXPECT_THAT(text, HasSubstr("liquidblend_frames_total{family=\"f255\",preset=\"fastest\"} 1\n"));
  EXPECT_THAT(text,
              HasSubstr("liquidblend_frames_total{family=\"other\",preset=\"fastest\"} 44\n"));
}

TEST(Metrics, ThreadsCountTogether) {
  Metrics metrics;
  {
    std::vector<std::jthread> threads;
    for (int i = 0; i < 4; ++i) {
      threads.emplace_back([&] {
        for (int k = 0; k < 500; ++k) metrics.CountFrame("splash", "fastest", 1, Times(1, 1, 1));
        metrics.Text({});
      });
    }
  }
  EXPECT_THAT(metrics.Text({}),
              HasSubstr("liquidblend_frames_total{family=\"splash\",preset=\"fastest\"} 2000\n"));
}

TEST(ProcessFigures, KnowWhatIsAllocated) {
  if (LIQUIDBLEND_SANITIZED_HEAP != 0) GTEST_SKIP() << "sanitizers have a heap of their own";
  constexpr int64_t kSize = 50'000'000;
  const int64_t before = ReadProcessFigures().heap.used;
  auto block = std::make_unique<char[]>(kSize);
  const int64_t with_block = ReadProcessFigures().heap.used;
  EXPECT_GE(with_block, before + kSize) << block.get();
  block.reset();
  EXPECT_LE(ReadProcessFigures().heap.used, with_block - kSize);
  EXPECT_THAT(Metrics().Text({}), HasSubstr("liquidblend_heap_bytes{state=\"used\"} "));
}

TEST(ProcessFigures, AreThoseOfARunningProgram) {
  const ProcessFigures figures = ReadProcessFigures();
  EXPECT_GT(figures.resident_bytes, 100'000);
  EXPECT_GE(figures.virtual_bytes, figures.resident_bytes);
  EXPECT_GE(figures.cpu_s, 0.0);
  EXPECT_GE(figures.num_open_files, 3);
  EXPECT_GE(figures.max_open_files, figures.num_open_files);
  EXPECT_GE(figures.num_threads, 1);
  EXPECT_THAT(Metrics().Text({}), HasSubstr("process_resident_memory_bytes "));
}

}  // namespace
}  // namespace liquidblend::metrics
