#include "server/metrics/metrics.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <memory>
#include <thread>
#include <vector>

#include "absl/strings/str_cat.h"
#include "server/metrics/process.h"
#include "tests/allocation_testing.h"

namespace liquidblend::metrics {
namespace {

using testing::HasSubstr;

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
  now.catalog.jobs = {{"queued", 2}, {"running", 1}};
  now.catalog.jobs_within_memory = {{"running", {{"4GiB", 7}, {"any", 8}}}};
  now.waiting_calls = {{"io", 5}};
  now.frame_cache = {7, 8, 3, 900};
  now.frame_queue = {5000, 6};
  now.disk_free_bytes = {{"/data", 123}};
  now.spans = {11, {{"rate", 12}, {"queue", 0}}};
  const std::string text = metrics.Text(now);
  for (const char* line :
       {"liquidblend_family_bytes{family=\"dam\"} 100\n",
        "liquidblend_family_bytes{family=\"splash\"} 4096\n", "liquidblend_families_loaded 2\n",
        "liquidblend_jobs{state=\"queued\"} 2\n",
        "liquidblend_jobs_within_memory{memory=\"4GiB\",state=\"running\"} 7\n",
        "liquidblend_waiting_calls{pool=\"io\"} 5\n",
        "# TYPE liquidblend_frame_cache_hits_total counter",
        "liquidblend_frame_cache_hits_total 7\n", "liquidblend_frame_cache_misses_total 8\n",
        "liquidblend_frame_cache_frames 3\n", "liquidblend_frame_cache_bytes 900\n",
        "liquidblend_frame_queue_cells 5000\n", "liquidblend_frames_refused_total 6\n",
        "liquidblend_disk_free_bytes{disk=\"/data\"} 123\n",
        "liquidblend_spans_exported_total 11\n",
        "liquidblend_spans_dropped_total{reason=\"rate\"} 12\n",
        "liquidblend_spans_dropped_total{reason=\"queue\"} 0\n"}) {
    EXPECT_THAT(text, HasSubstr(line));
  }
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
