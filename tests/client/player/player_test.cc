#include "client/player/player.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <functional>
#include <mutex>
#include <set>
#include <stdexcept>
#include <thread>
#include <vector>

namespace liquidblend::player {
namespace {

using Clock = std::chrono::steady_clock;

constexpr size_t kVertices = 3000;

// A source whose frames take no time, unless it is held.
class FakeSource final : public FrameSource {
 public:
  explicit FakeSource(double duration_s) {
    facts_.name = "splash";
    facts_.targets = {"b"};
    facts_.duration_s = duration_s;
    facts_.frames_per_second = 24.0;
    facts_.num_levels = 3;
  }
  const FamilyFacts& facts() const override { return facts_; }
  absl::Status Get(const FrameSpec& spec, FramePool& pool, FrameMesh& out, FrameCost&) override {
    ++num_calls;
    std::this_thread::sleep_for(delay.load());
    if (throws) throw std::length_error("of a library");
    const absl::Status status = error();
    if (!status.ok()) return status;
    // The size differs from frame to frame.
    const size_t count = kVertices + static_cast<size_t>(num_calls.load() * 7919 % 1000);
    if (absl::Status room = out.Resize(count, 2 * count, {true, true, true}, pool); !room.ok()) {
      return room;
    }
    std::fill_n(out.memory().positions, 3 * count, static_cast<float>(spec.time_s));
    out.UpdateBounds();
    out.facts.time_s = spec.time_s;
    out.facts.weights = spec.blend.weights;
    out.facts.level_of_detail = spec.surface.level_of_detail;
    return absl::OkStatus();
  }
  absl::Status error() const {
    const std::lock_guard lock(mutex_);
    return error_;
  }
  void SetError(absl::Status error) {
    const std::lock_guard lock(mutex_);
    error_ = std::move(error);
  }
  std::atomic<int> num_calls = 0;
  std::atomic<bool> throws = false;
  std::atomic<std::chrono::milliseconds> delay = std::chrono::milliseconds(0);

 private:
  FamilyFacts facts_;
  mutable std::mutex mutex_;
  absl::Status error_;
};

struct CountedMemory {
  std::atomic<int> num_allocated = 0;
  std::atomic<int> num_held = 0;

  Allocator allocator() {
    return {[](void* user, size_t bytes) {
              auto* self = static_cast<CountedMemory*>(user);
              ++self->num_allocated;
              ++self->num_held;
              return std::malloc(bytes);
            },
            [](void* user, void* memory) {
              --static_cast<CountedMemory*>(user)->num_held;
              std::free(memory);
            },
            this};
  }
};

class PlayerTest : public ::testing::Test {
 protected:
  void Start(PlayerOptions options = {}, double duration_s = 2.0) {
    auto source = std::make_unique<FakeSource>(duration_s);
    source_ = source.get();
    player_ = std::make_unique<Player>(std::move(source), options);
  }

  // Polls as the clock goes on, until the frame is right or too much time has passed.
  bool PollUntil(const std::function<bool(const PolledFrame&)>& is_right) {
    const Clock::time_point give_up = Clock::now() + std::chrono::seconds(20);
    while (Clock::now() < give_up) {
      now_ += 1.0 / 60;
      if (is_right(player_->Poll(now_))) return true;
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
    return false;
  }

  double now_ = 50.0;
  FakeSource* source_ = nullptr;
  std::unique_ptr<Player> player_;
};

TEST_F(PlayerTest, ShowsTheFirstFrameWhilePausedAndPlaysWhenAsked) {
  Start();
  ASSERT_TRUE(PollUntil([](const PolledFrame& polled) { return polled.frame != nullptr; }));
  EXPECT_EQ(player_->Poll(now_).velocity_scale, 0.0);
  player_->SetRate(0.5);
  player_->SetPlaying(true);
  ASSERT_TRUE(PollUntil([](const PolledFrame& p) { return p.frame->facts.time_s > 0.5; }));
  EXPECT_EQ(player_->Poll(now_).velocity_scale, 0.5);
  player_->SetPlaying(false);
  // A poll that meets another thread shows what the one before it did.
  EXPECT_TRUE(PollUntil([](const PolledFrame& p) { return p.velocity_scale == 0.0; }));
}

TEST_F(PlayerTest, AFrameStaysAsItIsUntilItIsReleased) {
  Start();
  player_->SetPlaying(true);
  ASSERT_TRUE(PollUntil([](const PolledFrame& p) { return p.frame != nullptr; }));
  const FramePtr held = player_->Poll(now_).frame;
  const auto time_s = static_cast<float>(held->facts.time_s);
  ASSERT_TRUE(PollUntil([](const PolledFrame& p) { return p.frame->facts.time_s > 1.5; }));
  for (size_t i = 0; i < 3 * held->num_vertices(); ++i) {
    ASSERT_EQ(held->memory().positions[i], time_s);
  }
  player_.reset();  // a frame may outlive its player
  EXPECT_EQ(held->bounds_min()[0], time_s);
}

TEST_F(PlayerTest, AllocatesNothingOnceItHasWarmedUp) {
  CountedMemory memory;
  {
    PlayerOptions options;
    options.allocator = memory.allocator();
    Start(options);
    player_->SetLoop(true);
    player_->SetPlaying(true);
    double time_s = -1.0;
    const auto play = [&](int num_frames) {
      for (int n = 0; n < num_frames; ++n) {
        ASSERT_TRUE(PollUntil([&](const PolledFrame& p) {
          return p.frame != nullptr && p.frame->facts.time_s != time_s;
        }));
        time_s = player_->Poll(now_).frame->facts.time_s;
      }
    };
    // Until as many frames have been held as ever are, which threads decide.
    int num_stretches = 0, before = -1;
    while (memory.num_allocated != before && num_stretches < 20) {
      before = memory.num_allocated;
      play(300);
      ++num_stretches;
    }
    EXPECT_LT(num_stretches, 20);
    EXPECT_GT(memory.num_allocated, 10);   // each frame's buffer is seen
    EXPECT_LT(memory.num_allocated, 300);  // of 6,000 frames at most
  }
  player_.reset();
  EXPECT_EQ(memory.num_held, 0);
}

TEST_F(PlayerTest, GoesOnByItselfWhenTheSourceComesBack) {
  Start();
  player_->SetPlaying(true);
  player_->SetLoop(true);
  ASSERT_TRUE(PollUntil([](const PolledFrame& p) { return p.frame != nullptr; }));
  source_->SetError(absl::UnavailableError("gone"));
  ASSERT_TRUE(
      PollUntil([&](const PolledFrame&) { return !player_->statistics().last_error.ok(); }));
  const int num_calls = source_->num_calls;
  for (int k = 0; k < 100; ++k) PollUntil([](const PolledFrame&) { return true; });
  EXPECT_LT(source_->num_calls - num_calls, 50) << "it waits between attempts";
  source_->SetError(absl::OkStatus());
  ASSERT_TRUE(PollUntil([&](const PolledFrame&) { return player_->statistics().last_error.ok(); }));
}

TEST_F(PlayerTest, SurvivesWhatALibraryThrows) {
  Start();
  source_->throws = true;
  ASSERT_TRUE(PollUntil([](const PolledFrame& p) { return absl::IsInternal(p.error); }));
  EXPECT_TRUE(absl::IsInternal(player_->WaitExact(1.0, 10.0).status()));
  source_->throws = false;
  EXPECT_TRUE(PollUntil([](const PolledFrame& p) { return p.frame != nullptr && p.error.ok(); }));
}

TEST_F(PlayerTest, AFamilyWithoutADurationIsOneFrameThatIsGotOnce) {
  for (const double duration_s : {double{NAN}, -1.0, double{INFINITY}}) {
    Start({}, duration_s);
    player_->SetLoop(true);
    player_->SetPlaying(true);
    ASSERT_TRUE(PollUntil([](const PolledFrame& p) { return p.frame != nullptr; }));
    for (int k = 0; k < 100; ++k) PollUntil([](const PolledFrame&) { return true; });
    EXPECT_EQ(player_->Poll(now_).frame->facts.time_s, 0.0);
    EXPECT_LE(source_->num_calls, 5) << duration_s;
  }
}

TEST_F(PlayerTest, WaitsForTheExactFrame) {
  Start();
  BlendSpec blend;
  blend.weights = {0.75};
  player_->SetBlend(blend, 0.0);
  const auto frame = player_->WaitExact(1.25, 1.0);
  ASSERT_TRUE(frame.ok()) << frame.status();
  EXPECT_EQ((*frame)->facts.time_s, 1.25);
  EXPECT_EQ((*frame)->facts.weights, std::vector<double>{0.75});
  source_->SetError(absl::UnavailableError("gone"));
  EXPECT_TRUE(absl::IsDeadlineExceeded(player_->WaitExact(1.0, 0.1).status()));
  source_->SetError(absl::InvalidArgumentError("wrong"));
  EXPECT_TRUE(absl::IsInvalidArgument(player_->WaitExact(1.0, 10.0).status()));
}

TEST_F(PlayerTest, AChangeIsTriedAtOnceAfterFailures) {
  PlayerOptions options;
  options.num_threads = 1;
  Start(options);
  source_->SetError(absl::InvalidArgumentError("wrong weights"));
  ASSERT_TRUE(PollUntil([&](const PolledFrame& p) { return !p.error.ok(); }));
  Clock::duration shortest = std::chrono::hours(1);
  for (int k = 0; k < 5 && shortest > std::chrono::milliseconds(500); ++k) {  // or it is busy
    const Clock::time_point long_enough = Clock::now() + std::chrono::milliseconds(1600);
    PollUntil([&](const PolledFrame&) { return Clock::now() > long_enough; });
    // From now on it waits for a second after each failure.
    const int num_before = source_->num_calls;
    ASSERT_TRUE(PollUntil([&](const PolledFrame&) { return source_->num_calls > num_before; }));
    const int num_failed = source_->num_calls;
    BlendSpec blend;
    blend.weights = {0.1 * (k + 1)};
    player_->SetBlend(blend, 0.0);
    const Clock::time_point start = Clock::now();
    ASSERT_TRUE(PollUntil([&](const PolledFrame&) { return source_->num_calls > num_failed; }));
    shortest = std::min(shortest, Clock::now() - start);
  }
  EXPECT_LT(shortest, std::chrono::milliseconds(500));
  source_->SetError(absl::OkStatus());
  EXPECT_TRUE(PollUntil([](const PolledFrame& p) { return p.frame != nullptr; }));
}

TEST_F(PlayerTest, TheLevelOfDetailFollowsWhatIsMissed) {
  Start();
  source_->delay = std::chrono::milliseconds(100);
  player_->SetLoop(true);
  player_->SetPlaying(true);
  ASSERT_TRUE(PollUntil([](const PolledFrame& p) {
    return p.frame != nullptr && p.frame->facts.level_of_detail == 2;
  }));
  EXPECT_EQ(player_->statistics().level_of_detail, 2);
}

TEST_F(PlayerTest, OptionsOutOfRangeAreNamed) {
  PlayerOptions options;
  EXPECT_TRUE(options.Validate().ok());
  options.num_threads = 0;
  EXPECT_NE(options.Validate().message().find("num_threads"), std::string::npos);
  options = {};
  options.schedule.frames_per_second = NAN;
  EXPECT_NE(options.Validate().message().find("frames_per_second"), std::string::npos);
  options = {};
  options.schedule.look_ahead_s = -1;
  EXPECT_NE(options.Validate().message().find("look_ahead_s"), std::string::npos);
  options = {};
  options.position_bits = 17;
  EXPECT_NE(options.Validate().message().find("position_bits"), std::string::npos);
}

}  // namespace
}  // namespace liquidblend::player
