// The C API without a server: players of files, structs, errors.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <cmath>
#include <cstddef>
#include <cstring>
#include <string>
#include <thread>
#include <vector>

#include "core/store/files/files.h"
#include "tests/client/c/c_testing.h"
#include "tests/core/store/store_testing.h"
#include "tests/synthetic/families.h"

namespace liquidblend {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

class FilePlayerTest : public ::testing::Test {
 protected:
  FilePlayerTest() {
    synthetic::ComplexOptions options;
    options.num_frames = 8;
    options.velocity_m_per_frame = {0.05F, 0.02F, 0.04F};
    store::MemoryWriter writer;
    const mesh::RegisteredFamily family = synthetic::MakeFamily(
        synthetic::HexahedralSphere(6, options), {{synthetic::SmoothWarp(1, 0.1F, 0.5F), {}}});
    EXPECT_TRUE(store::WriteFamily(family, writer).ok());
    store::WriteFile(path_, writer.content);
  }
  ~FilePlayerTest() override { lb_player_free(player_); }

  void Open(uint32_t attributes) {
    auto surface = Sized<lb_surface>();
    surface.attributes = attributes;
    auto options = Sized<lb_player_options>();
    options.file = path_.c_str();
    options.surface = &surface;
    ASSERT_EQ(lb_player_open(&options, &player_), LB_OK) << LastError();
  }

  lb_frame* Exact(double time_s) {
    lb_frame* frame = nullptr;
    EXPECT_EQ(lb_player_wait_exact(player_, time_s, 10.0, &frame), LB_OK) << LastError();
    return frame;
  }

  // Polls as the clock goes on, until a frame of a later time is there.
  lb_frame* PollPast(double time_s) {
    for (int k = 0; k < 5000; ++k) {
      lb_frame* const frame = lb_player_poll(player_, now_ += 1.0 / 60);
      auto info = Sized<lb_frame_info>();
      lb_frame_describe(frame, &info);
      if (frame != nullptr && info.time_s > time_s) return frame;
      lb_frame_free(frame);
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
    return nullptr;
  }

  const store::TemporaryFolder folder_;
  const std::string path_ = folder_.path() + "/sphere.lbf";
  lb_player* player_ = nullptr;
  double now_ = 5.0;
};

TEST_F(FilePlayerTest, DescribesItsFamily) {
  Open(0);
  auto info = Sized<lb_family_info>();
  lb_player_describe(player_, &info);
  EXPECT_EQ(info.num_targets, 1u);
  EXPECT_STREQ(info.targets[0], "animations/target-1");
  EXPECT_GT(info.duration_s, 0.2);
  EXPECT_EQ(info.num_levels, 1);
  EXPECT_EQ(info.num_parameters, 0u);
  EXPECT_LT(info.bounds_min[0], -0.9);
}

TEST_F(FilePlayerTest, PlaysAndPausesAndScalesVelocities) {
  Open(LB_VELOCITIES);
  lb_player_set_loop(player_, 1);
  lb_player_play(player_);
  ASSERT_EQ(lb_player_set_rate(player_, 0.25), LB_OK);
  lb_frame* frame = PollPast(0.05);
  ASSERT_NE(frame, nullptr);
  auto info = Sized<lb_frame_info>();
  lb_frame_describe(frame, &info);
  EXPECT_EQ(info.velocity_scale, 0.25);
  EXPECT_NE(info.velocities, nullptr);
  EXPECT_EQ(info.normals, nullptr);
  lb_frame_free(frame);
  lb_player_pause(player_);
  // A poll that meets another thread gives what the one before it gave.
  for (int k = 0; k < 5000 && info.velocity_scale != 0.0; ++k) {
    frame = lb_player_poll(player_, now_ += 1.0 / 60);
    lb_frame_describe(frame, &info);
    lb_frame_free(frame);
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  EXPECT_EQ(info.velocity_scale, 0.0);
  auto statistics = Sized<lb_player_info>();
  lb_player_statistics(player_, &statistics);
  EXPECT_GT(statistics.num_shown, 0);
  EXPECT_EQ(statistics.status, LB_OK);
}

TEST_F(FilePlayerTest, GivesTheSameHandleUntilThereIsANewerFrame) {
  Open(0);
  lb_player_play(player_);
  lb_frame* frame = PollPast(0.05);
  ASSERT_NE(frame, nullptr);
  lb_player_pause(player_);
  bool is_same = false;
  for (int k = 0; k < 5000 && !is_same; ++k) {
    lb_frame* const next = lb_player_poll(player_, now_ += 1.0 / 60);
    is_same = next == frame;  // which is still held, so that no other frame has its address
    lb_frame_free(frame);
    frame = next;
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  EXPECT_TRUE(is_same);
  lb_frame_free(frame);
}

TEST_F(FilePlayerTest, GivesTheExactFrameOfTheWeightsThatWereSet) {
  Open(0);
  const double weight = 0.75;
  ASSERT_EQ(lb_player_set_weights(player_, 1, &weight, 0.0), LB_OK);
  lb_frame* const frame = Exact(0.125);
  auto info = Sized<lb_frame_info>();
  lb_frame_describe(frame, &info);
  EXPECT_EQ(info.time_s, 0.125);
  ASSERT_EQ(info.num_weights, 1u);
  EXPECT_EQ(info.weights[0], 0.75);
  EXPECT_GT(info.num_triangles, 100u);
  lb_frame_free(frame);
}

TEST_F(FilePlayerTest, AFrameOutlivesItsPlayer) {
  Open(0);
  lb_frame* const frame = Exact(0.1);
  lb_frame_retain(frame);
  lb_frame_free(frame);
  lb_player_free(player_);
  player_ = nullptr;
  auto info = Sized<lb_frame_info>();
  lb_frame_describe(frame, &info);
  float sum = 0.0F;
  for (uint32_t i = 0; i < 3 * info.num_vertices; ++i) sum += info.positions[i];
  EXPECT_TRUE(std::isfinite(sum));
  lb_frame_free(frame);
}

TEST_F(FilePlayerTest, CopiesIntoInterleavedMemoryWithSmallIndices) {
  Open(LB_NORMALS | LB_REST_POSITIONS);
  lb_frame* const frame = Exact(0.1);
  auto info = Sized<lb_frame_info>();
  lb_frame_describe(frame, &info);
  struct Vertex {
    float rest[4];
    float position[3];
    float normal[3];
    uint32_t mine;
  };
  std::vector<Vertex> vertices(info.num_vertices);
  for (Vertex& vertex : vertices) vertex.mine = 7;
  std::vector<uint16_t> indices(3 * info.num_triangles);
  auto layout = Sized<lb_layout>();
  layout.vertices = vertices.data();
  layout.vertices_size = vertices.size() * sizeof(Vertex);
  layout.stride = sizeof(Vertex);
  layout.position_offset = offsetof(Vertex, position);
  layout.normal_offset = offsetof(Vertex, normal);
  layout.velocity_offset = -1;
  layout.rest_offset = offsetof(Vertex, rest);
  layout.indices = indices.data();
  layout.indices_size = indices.size() * sizeof(uint16_t);
  layout.index_bytes = 2;
  ASSERT_EQ(lb_frame_copy(frame, &layout), LB_OK) << LastError();
  for (uint32_t v = 0; v < info.num_vertices; ++v) {
    ASSERT_EQ(std::memcmp(vertices[v].position, info.positions + 3 * v, 12), 0) << v;
    ASSERT_EQ(std::memcmp(vertices[v].normal, info.normals + 3 * v, 12), 0) << v;
    ASSERT_EQ(std::memcmp(vertices[v].rest, info.rest_positions + 4 * v, 16), 0) << v;
    ASSERT_EQ(vertices[v].mine, 7u) << v;
  }
  for (uint32_t i = 0; i < 3 * info.num_triangles; ++i) ASSERT_EQ(indices[i], info.triangles[i]);
  layout.vertices_size -= 24;
  EXPECT_EQ(lb_frame_copy(frame, &layout), LB_OUT_OF_RANGE);
  EXPECT_THAT(LastError(), HasSubstr("the vertices need"));
  layout.velocity_offset = 0;
  EXPECT_EQ(lb_frame_copy(frame, &layout), LB_INVALID_ARGUMENT);
  EXPECT_THAT(LastError(), HasSubstr("velocities"));
  layout.velocity_offset = -1;
  layout.rest_offset = 0;
  layout.position_offset = 12;
  EXPECT_EQ(lb_frame_copy(frame, &layout), LB_INVALID_ARGUMENT);
  EXPECT_THAT(LastError(), HasSubstr("rest positions and positions overlap"));
  layout.position_offset = offsetof(Vertex, position);
  layout.stride = SIZE_MAX / 2;
  EXPECT_EQ(lb_frame_copy(frame, &layout), LB_OUT_OF_RANGE);
  layout.stride = sizeof(Vertex);
  layout.rest_offset = 40;
  EXPECT_EQ(lb_frame_copy(frame, &layout), LB_INVALID_ARGUMENT);
  EXPECT_THAT(LastError(), HasSubstr("rest positions end at byte 56"));
  lb_frame_free(frame);
}

TEST_F(FilePlayerTest, AnOlderProgramsShorterStructsWork) {
  auto options = Sized<lb_player_options>();
  options.struct_size = offsetof(lb_player_options, surface);
  options.file = path_.c_str();
  // Beyond the size there is what the older program does not know: no option.
  options.num_threads = -5;
  ASSERT_EQ(lb_player_open(&options, &player_), LB_OK) << LastError();
  lb_frame* const frame = Exact(0.1);
  auto info = Sized<lb_frame_info>();
  info.struct_size = offsetof(lb_frame_info, time_s);
  info.time_s = -1.0;
  lb_frame_describe(frame, &info);
  EXPECT_GT(info.num_vertices, 0u);
  EXPECT_EQ(info.time_s, -1.0) << "written beyond the struct's end";
  lb_frame_free(frame);
}

TEST_F(FilePlayerTest, NamesWhatIsWrong) {
  auto options = Sized<lb_player_options>();
  EXPECT_EQ(lb_player_open(&options, &player_), LB_INVALID_ARGUMENT);
  EXPECT_THAT(LastError(), HasSubstr("options.file"));
  const std::string none = folder_.path() + "/none";
  options.file = none.c_str();
  EXPECT_EQ(lb_player_open(&options, &player_), LB_NOT_FOUND);
  EXPECT_THAT(LastError(), HasSubstr(none));
  EXPECT_EQ(player_, nullptr);
  options.struct_size = 0;
  EXPECT_EQ(lb_player_open(&options, &player_), LB_INVALID_ARGUMENT);
  EXPECT_THAT(LastError(), HasSubstr("struct_size"));
  Open(0);
  const double weights[] = {1.0, std::nan("")};
  EXPECT_EQ(lb_player_set_weights(player_, 2, weights, 0.0), LB_INVALID_ARGUMENT);
  EXPECT_EQ(lb_player_set_weights(player_, 1, weights + 1, 0.0), LB_INVALID_ARGUMENT);
  EXPECT_THAT(LastError(), HasSubstr("finite"));
  const double too_large = 2.5;
  EXPECT_EQ(lb_player_set_weights(player_, 1, &too_large, 0.0), LB_INVALID_ARGUMENT);
  EXPECT_THAT(LastError(), HasSubstr("weights[0] is 2.5"));
  const lb_parameter height = {"height", std::nan("")};
  EXPECT_EQ(lb_player_set_parameters(player_, 1, &height, 0, 0.0), LB_INVALID_ARGUMENT);
  EXPECT_THAT(LastError(), HasSubstr("height is not finite"));
  EXPECT_EQ(lb_player_poll(player_, 1e20), nullptr);
  EXPECT_EQ(lb_player_set_rate(player_, std::nan("")), LB_INVALID_ARGUMENT);
  std::thread([] { EXPECT_STREQ(lb_last_error(), "") << "of another thread"; }).join();
  EXPECT_STREQ(lb_status_name(LB_NOT_FOUND), "NOT_FOUND");
  EXPECT_STREQ(lb_status_name(static_cast<lb_status>(31)), "UNKNOWN");
}

TEST(CApi, NullIsAnErrorAndNeverACrash) {
  EXPECT_EQ(lb_client_connect(nullptr, nullptr), LB_INVALID_ARGUMENT);
  lb_family* family = nullptr;
  lb_text* text = nullptr;
  lb_operation* operation = nullptr;
  lb_frame* frame = nullptr;
  EXPECT_EQ(lb_client_get_family(nullptr, "a", 0, &family), LB_INVALID_ARGUMENT);
  EXPECT_EQ(lb_client_list_families(nullptr, &text), LB_INVALID_ARGUMENT);
  EXPECT_EQ(lb_client_import(nullptr, nullptr, &operation), LB_INVALID_ARGUMENT);
  EXPECT_EQ(lb_client_register(nullptr, nullptr, &operation), LB_INVALID_ARGUMENT);
  EXPECT_EQ(lb_client_watch(nullptr, nullptr, nullptr, nullptr, &operation), LB_INVALID_ARGUMENT);
  EXPECT_EQ(lb_client_watch_for(nullptr, nullptr, 0.0, nullptr, nullptr, &operation),
            LB_INVALID_ARGUMENT);
  EXPECT_EQ(lb_client_get_frame(nullptr, nullptr, &frame), LB_INVALID_ARGUMENT);
  EXPECT_EQ(lb_player_open(nullptr, nullptr), LB_INVALID_ARGUMENT);
  EXPECT_EQ(lb_player_seek(nullptr, 0), LB_INVALID_ARGUMENT);
  EXPECT_EQ(lb_player_poll(nullptr, 0), nullptr);
  lb_stream* stream = nullptr;
  EXPECT_EQ(lb_stream_open(nullptr, nullptr, &stream), LB_INVALID_ARGUMENT);
  EXPECT_EQ(lb_stream_next(nullptr, &frame), LB_INVALID_ARGUMENT);
  EXPECT_EQ(lb_client_rollback_family(nullptr, "a", 1, &family), LB_INVALID_ARGUMENT);
  lb_stream_cancel(nullptr);
  lb_stream_free(nullptr);
  lb_client_free(nullptr);
  lb_family_free(nullptr);
  lb_text_free(nullptr);
  lb_operation_free(nullptr);
  lb_frame_free(nullptr);
  lb_player_free(nullptr);
  lb_family_describe(nullptr, nullptr);
}

}  // namespace
}  // namespace liquidblend
