#include "server/frames/stream_session.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "absl/time/clock.h"
#include "tests/server/backends_testing.h"
#include "tests/server/extremes.h"

namespace liquidblend::server::stream_session_test {
namespace {

using testing::ElementsAre;

// Generous for machines that are busy; nothing waits that long when all is well.
constexpr absl::Duration kPatience = absl::Seconds(20);

// A client that takes each frame after `delay`, or when the test says so.
class TestSink : public StreamSession::Sink {
 public:
  void Send(const StreamedFrame& streamed) override {
    absl::MutexLock lock(&mutex_);
    EXPECT_FALSE(is_writing_) << "two writes at once";
    is_writing_ = true;
    v1::StreamFramesResponse& response = responses_.emplace_back();
    EXPECT_TRUE(response.ParseFromString(ResponsePrefix(streamed) + *streamed.frame));
    EXPECT_EQ(response.level_of_detail(), streamed.level_of_detail);
  }

  void End(const absl::Status& status) override {
    absl::MutexLock lock(&mutex_);
    EXPECT_FALSE(end_.has_value()) << "ended twice";
    end_ = status;
  }

  std::string account() const override { return "client"; }
  void GiveUp() override {}

  // Waits for response n.
  v1::StreamFramesResponse Await(size_t n) {
    absl::MutexLock lock(&mutex_);
    const auto is_there = [&]() ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_) {
      return responses_.size() > n;
    };
    EXPECT_TRUE(mutex_.AwaitWithTimeout(absl::Condition(&is_there), kPatience));
    return responses_.size() > n ? responses_[n] : v1::StreamFramesResponse();
  }

  absl::Status AwaitEnd() {
    absl::MutexLock lock(&mutex_);
    const auto has_ended = [&]() ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_) { return end_.has_value(); };
    EXPECT_TRUE(mutex_.AwaitWithTimeout(absl::Condition(&has_ended), kPatience));
    return end_.value_or(absl::UnknownError("has not ended"));
  }

  // Takes what is being written.
  void Take(StreamSession& session) {
    {
      absl::MutexLock lock(&mutex_);
      if (!std::exchange(is_writing_, false)) return;
    }
    session.OnWritten();
  }

  size_t num_sent() {
    absl::MutexLock lock(&mutex_);
    return responses_.size();
  }

  bool has_ended() {
    absl::MutexLock lock(&mutex_);
    return end_.has_value();
  }

 private:
  absl::Mutex mutex_;
  std::vector<v1::StreamFramesResponse> responses_ ABSL_GUARDED_BY(mutex_);
  std::optional<absl::Status> end_ ABSL_GUARDED_BY(mutex_);
  bool is_writing_ ABSL_GUARDED_BY(mutex_) = false;
};

class StreamSessionTest : public RpcTest {
 protected:
  StreamSessionTest() : sink_(std::make_shared<TestSink>()) { Start(SmallBackends()); }
  ~StreamSessionTest() override {
    session_->Stop();
    backends_->Stop();
  }

  void Start(const BackendsOptions& options) {
    session_.reset();  // before the backends, which outlive it
    backends_ = std::make_unique<Backends>(*catalog_, *blobs_, families_, options);
    session_ = std::make_shared<StreamSession>(*backends_, "test", sink_);
  }

  static v1::StreamFramesRequest Request() {
    v1::StreamFramesRequest request;
    request.set_family("families/splash");
    request.add_weights(0.5);
    return request;
  }

  // A client that takes each frame `delay` after it was sent.
  std::jthread TakeAll(absl::Duration delay) {
    return std::jthread([this, delay](const std::stop_token& stop) {
      size_t num_taken = 0;
      while (!stop.stop_requested() && !sink_->has_ended()) {
        if (sink_->num_sent() > num_taken) {
          absl::SleepFor(delay);
          ++num_taken;
          sink_->Take(*session_);
        } else {
          absl::SleepFor(absl::Microseconds(200));
        }
      }
    });
  }

  int64_t NumMade() { return backends_->frame_cache.stats().num_frames; }

  bool AwaitMade(int64_t count) {
    const absl::Time give_up = absl::Now() + kPatience;
    while (absl::Now() < give_up && NumMade() < count) absl::SleepFor(absl::Milliseconds(1));
    return NumMade() >= count;
  }

  std::shared_ptr<TestSink> sink_;
  std::unique_ptr<Backends> backends_;
  std::shared_ptr<StreamSession> session_;
};

mesh::RegisteredFamily TinyFamily(double frames_per_second) {
  synthetic::ComplexOptions options;
  options.num_frames = kFamilyFrames;
  mesh::RegisteredFamily family = synthetic::MakeFamily(
      synthetic::MixedSphere(3, options), {{synthetic::SmoothWarp(1, 0.1F, 0.3F), {}}});
  family.name = "splash";
  family.frames_per_second = frames_per_second;
  return family;
}

// Refers to `loaded`, which must live longer.
catalog::FamilyPtr Unowned(const catalog::LoadedFamily& loaded) {
  return catalog::FamilyPtr(catalog::FamilyPtr(), &loaded);
}

TEST_F(StreamSessionTest, ALosslessStreamSendsEveryFrameAndEnds) {
  PublishSplash();
  const std::jthread client = TakeAll(absl::ZeroDuration());
  v1::StreamFramesRequest request = Request();
  request.set_lossless(true);
  session_->OnRequest(request);
  session_->OnHalfClosed();
  EXPECT_TRUE(sink_->AwaitEnd().ok());
  ASSERT_EQ(sink_->num_sent(), static_cast<size_t>(kFamilyFrames));
  for (int k = 0; k < kFamilyFrames; ++k) {
    const v1::StreamFramesResponse response = sink_->Await(k);
    EXPECT_EQ(response.frame_index(), k);
    EXPECT_EQ(response.num_dropped(), 0);
    EXPECT_NEAR(response.frame().time_s(), k / 24.0, 1e-9);
  }
}

TEST_F(StreamSessionTest, EachFrameSaysWhichOneFollows) {
  PublishSplash();
  const std::jthread client = TakeAll(absl::ZeroDuration());
  v1::StreamFramesRequest request = Request();
  request.set_lossless(true);
  session_->OnRequest(request);
  session_->OnHalfClosed();
  EXPECT_TRUE(sink_->AwaitEnd().ok());
  for (int k = 0; k + 1 < kFamilyFrames; ++k) {
    EXPECT_EQ(sink_->Await(k).next_time_s(), sink_->Await(k + 1).frame().time_s()) << k;
  }
  EXPECT_FALSE(sink_->Await(kFamilyFrames - 1).has_next_time_s());
}

TEST_F(StreamSessionTest, EachFrameSaysHowManyMessagesItShows) {
  PublishSplash();
  v1::StreamFramesRequest request = Request();
  request.set_rate(0);
  request.set_frames_per_second(100);
  session_->OnRequest(request);
  EXPECT_EQ(sink_->Await(0).num_requests(), 1);
  for (const double time_s : {0.1, 0.2}) {
    v1::StreamFramesRequest seek;
    seek.set_time_s(time_s);
    session_->OnRequest(seek);
  }
  sink_->Take(*session_);
  // One made ahead may have been sent already.
  for (size_t n = 1; sink_->Await(n).num_requests() < 3; ++n) {
    EXPECT_NE(sink_->Await(n).frame().time_s(), 0.2);
    sink_->Take(*session_);
  }
  const v1::StreamFramesResponse last = sink_->Await(sink_->num_sent() - 1);
  EXPECT_EQ(last.num_requests(), 3);
  EXPECT_EQ(last.frame().time_s(), 0.2);
  EXPECT_EQ(last.next_time_s(), 0.2);
}

TEST_F(StreamSessionTest, ASlowClientGetsOneFrameAtATimeAndTheNewestOne) {
  PublishSplash();
  v1::StreamFramesRequest request = Request();
  request.set_frames_per_second(100);
  request.set_loop(true);
  session_->OnRequest(request);
  sink_->Await(0);
  absl::SleepFor(absl::Milliseconds(105));  // ten more are due
  EXPECT_EQ(sink_->num_sent(), 1U);
  sink_->Take(*session_);
  const v1::StreamFramesResponse second = sink_->Await(1);
  EXPECT_GE(second.num_dropped(), 8);
  EXPECT_EQ(second.frame_index(), 1);
}

TEST_F(StreamSessionTest, TheNewestValuesOfSeveralMessagesCount) {
  PublishSplash();
  v1::StreamFramesRequest request = Request();
  request.set_rate(0);
  request.set_frames_per_second(100);
  session_->OnRequest(request);
  sink_->Await(0);
  for (const double weight : {0.1, 0.2, 0.3}) {
    v1::StreamFramesRequest change;
    change.add_weights(weight);
    session_->OnRequest(change);
  }
  sink_->Take(*session_);
  EXPECT_THAT(sink_->Await(1).frame().weights(), ElementsAre(0.3));
}

TEST_F(StreamSessionTest, TheNextFrameIsMadeWhileTheClientConsumesThisOne) {
  PublishSplash();
  v1::StreamFramesRequest request = Request();
  request.set_rate(0.2);
  request.set_frames_per_second(1);  // few, as a stream that is late makes none ahead
  request.set_loop(true);
  session_->OnRequest(request);
  sink_->Await(0);
  sink_->Take(*session_);
  sink_->Await(1);  // from here on, values are steady
  EXPECT_TRUE(AwaitMade(3));
  EXPECT_EQ(sink_->num_sent(), 2U);
}

TEST_F(StreamSessionTest, WhatWasMadeAheadIsDroppedWhenValuesChange) {
  PublishSplash();
  v1::StreamFramesRequest request = Request();
  request.set_rate(0.2);
  request.set_frames_per_second(1);  // few, as a stream that is late makes none ahead
  request.set_loop(true);
  session_->OnRequest(request);
  sink_->Await(0);
  sink_->Take(*session_);
  sink_->Await(1);
  ASSERT_TRUE(AwaitMade(3));
  v1::StreamFramesRequest change;
  change.add_weights(0.75);
  session_->OnRequest(change);
  sink_->Take(*session_);
  const v1::StreamFramesResponse response = sink_->Await(2);
  EXPECT_THAT(response.frame().weights(), ElementsAre(0.75));
  EXPECT_EQ(response.num_dropped(), 0);
}

// Frames are not taken before they are looked at, so that none is sent earlier however busy the
// machine is.
TEST_F(StreamSessionTest, WhatChangesOnceAFrameIsMadeAheadOnceItHasChanged) {
  PublishSplash();
  v1::StreamFramesRequest request = Request();
  request.set_rate(0);  // a frame that comes late is skipped, but shows the same
  request.set_frames_per_second(1);
  session_->OnRequest(request);
  const auto change_to = [&](double weight) {
    v1::StreamFramesRequest change;
    change.add_weights(weight);
    session_->OnRequest(change);
  };
  sink_->Await(0);
  change_to(0.1);
  EXPECT_TRUE(AwaitMade(2));
  EXPECT_EQ(sink_->num_sent(), 1U);
  sink_->Take(*session_);
  EXPECT_THAT(sink_->Await(1).frame().weights(), ElementsAre(0.1));
  EXPECT_EQ(NumMade(), 2) << "none that was not sent";
  // One change more than there was before: the next frame shows it, not what was made ahead.
  change_to(0.2);
  EXPECT_TRUE(AwaitMade(3));
  EXPECT_EQ(sink_->num_sent(), 2U);
  change_to(0.3);
  sink_->Take(*session_);
  EXPECT_THAT(sink_->Await(2).frame().weights(), ElementsAre(0.3));
}

TEST_F(StreamSessionTest, NothingIsMadeAheadBeyondTheByteCap) {
  BackendsOptions options = SmallBackends();
  options.limits.max_stream_bytes = 0;
  Start(options);
  PublishSplash();
  const std::jthread client = TakeAll(absl::ZeroDuration());
  v1::StreamFramesRequest request = Request();
  request.set_frames_per_second(50);
  session_->OnRequest(request);
  int64_t most_ahead = 0;
  while (!sink_->has_ended()) {
    const int64_t num_made = NumMade();
    if (sink_->num_sent() > 0) {
      most_ahead = std::max(most_ahead, num_made - static_cast<int64_t>(sink_->num_sent()));
    }
  }
  EXPECT_LE(most_ahead, 1);  // the one that is due, between its making and its sending
  EXPECT_TRUE(sink_->AwaitEnd().ok());
}

TEST_F(StreamSessionTest, TheLevelOfDetailFollowsTheConnectionIfAskedTo) {
  ImportAnimation("a");
  ImportAnimation("b");
  PublishFamily("splash", "a", "b", 1, {}, 2);
  const std::jthread client = TakeAll(absl::Milliseconds(40));
  v1::StreamFramesRequest request = Request();
  request.set_frames_per_second(50);
  request.set_loop(true);
  session_->OnRequest(request);
  EXPECT_EQ(sink_->Await(10).level_of_detail(), 0);
  v1::StreamFramesRequest adapt;
  adapt.set_adapt_level_of_detail(true);
  session_->OnRequest(adapt);
  const size_t before = sink_->num_sent();
  const v1::StreamFramesResponse coarse = sink_->Await(before + 20);
  EXPECT_EQ(coarse.level_of_detail(), 2);
  EXPECT_LT(coarse.frame().num_triangles(), sink_->Await(0).frame().num_triangles());
}

TEST_F(StreamSessionTest, AMistakeEndsTheStream) {
  PublishSplash();
  const std::jthread client = TakeAll(absl::ZeroDuration());
  v1::StreamFramesRequest request = Request();
  request.set_loop(true);  // else it may have ended by itself
  session_->OnRequest(request);
  sink_->Await(0);
  v1::StreamFramesRequest mistake;
  mistake.add_weights(7);
  session_->OnRequest(mistake);
  EXPECT_THAT(BlamedFields(sink_->AwaitEnd()), ElementsAre("weights"));
}

TEST_F(StreamSessionTest, WithoutAFamilyThereIsNoStream) {
  session_->OnHalfClosed();
  EXPECT_THAT(BlamedFields(sink_->AwaitEnd()), ElementsAre("family"));
}

TEST_F(StreamSessionTest, AfterStopNothingIsSentOrMade) {
  PublishSplash();
  v1::StreamFramesRequest request = Request();
  request.set_frames_per_second(100);
  request.set_loop(true);
  session_->OnRequest(request);
  sink_->Await(0);
  session_->Stop();
  sink_->Take(*session_);
  backends_->Stop();
  EXPECT_EQ(sink_->num_sent(), 1U);
  EXPECT_FALSE(sink_->has_ended());
}

// They used to be appended to what the stream keeps, for as long as it lived.
TEST(MergeRequest, UnknownFieldsAreNotKept) {
  v1::StreamFramesRequest kept;
  for (int k = 0; k < 100; ++k) {
    v1::StreamFramesRequest request;
    request.add_parameters()->set_name("height");
    request.mutable_encoding()->set_position_bits(12);
    request.mutable_surface()->set_smoothing_passes(1);
    AddUnknownFields(request, std::string(1000, 'x'));
    MergeRequest(request, kept);
  }
  EXPECT_EQ(kept.parameters_size(), 1);
  EXPECT_LT(kept.ByteSizeLong(), 100U);
  EXPECT_LT(kept.SpaceUsedLong(), 2000U);
}

TEST(MergeRequest, RepeatedFieldsReplaceTheFormerOnes) {
  v1::StreamFramesRequest kept;
  v1::StreamFramesRequest request;
  for (int k = 0; k < 10; ++k) request.add_weights(k);
  request.mutable_surface()->add_attributes(v1::SurfaceOptions::NORMALS);
  for (int k = 0; k < 100; ++k) MergeRequest(request, kept);
  EXPECT_EQ(kept.weights_size(), 10);
  EXPECT_EQ(kept.surface().attributes_size(), 1);
}

TEST_F(StreamSessionTest, PacesThatNobodyCanWatchAreRefused) {
  PublishSplash();
  for (const double fps : {0.0, -1.0, 1e-320, 1e-15, 1e-10, 0.00099, 240.1, 1e300}) {
    sink_ = std::make_shared<TestSink>();
    Start(SmallBackends());
    v1::StreamFramesRequest request = Request();
    request.set_frames_per_second(fps);
    session_->OnRequest(request);
    EXPECT_THAT(BlamedFields(sink_->AwaitEnd()), ElementsAre("frames_per_second")) << fps;
  }
}

TEST_F(StreamSessionTest, AClientThatChangesItsPaceAllTheTimeLeavesOneAlarm) {
  PublishSplash();
  const auto await_steps = [this] {
    absl::Notification done;
    ASSERT_TRUE(backends_->steps.PostMore([&] { done.Notify(); }));
    done.WaitForNotification();
  };
  const int64_t num_others = backends_->steps.num_timers();
  v1::StreamFramesRequest request = Request();
  request.set_frames_per_second(0.01);
  request.set_rate(0);
  session_->OnRequest(request);
  sink_->Await(0);
  sink_->Take(*session_);
  await_steps();
  for (int k = 1; k <= 100; ++k) {  // each frame is due earlier than the one before it was
    v1::StreamFramesRequest change;
    change.set_frames_per_second(0.01 * (1 + 0.01 * k));
    session_->OnRequest(change);
    await_steps();
  }
  EXPECT_EQ(backends_->steps.num_timers(), num_others + 1);
  session_->Stop();
  await_steps();
  EXPECT_EQ(backends_->steps.num_timers(), num_others);
}

// On the clock, its frames are due as fast as a client may ask for; a lossless stream has them all.
TEST_F(StreamSessionTest, AFamilyOfAnyFrameRateCanBeStreamed) {
  for (const double fps : {1e-9, 1e10, 1e300}) {
    catalog::LoadedFamily loaded(TinyFamily(fps), std::nullopt);
    FrameStream stream;
    v1::StreamFramesRequest request = Request();
    ASSERT_TRUE(stream.Change(request, Unowned(loaded), absl::ZeroDuration()).ok());
    EXPECT_GE(stream.period(), absl::Seconds(1) / 240.0) << fps;
    EXPECT_LE(stream.period(), absl::Seconds(1000)) << fps;
    request.set_lossless(true);
    ASSERT_TRUE(stream.Change(request, Unowned(loaded), absl::ZeroDuration()).ok());
    EXPECT_GT(stream.period(), absl::ZeroDuration()) << fps;
    const auto tick = stream.Next(absl::Seconds(1e6));
    ASSERT_TRUE(tick.has_value()) << fps;
    EXPECT_TRUE(std::isfinite(tick->time_s)) << fps;
  }
}

TEST_F(StreamSessionTest, SendsNoMoreThanTheClientsCredit) {
  PublishSplash();
  v1::StreamFramesRequest request = Request();
  request.set_rate(0.001);  // so that no time comes again: a frame that is cached is not made
  request.set_frames_per_second(2);
  request.set_credit(2);
  session_->OnRequest(request);
  const std::jthread client = TakeAll(absl::ZeroDuration());
  const int64_t num_late = sink_->Await(1).num_dropped();
  const absl::Time begin = absl::Now();
  // A stream that is late makes none ahead.
  EXPECT_TRUE(num_late > 0 || AwaitMade(3)) << "the next one is made ahead";
  absl::SleepFor(absl::Seconds(2));  // four more are due
  EXPECT_EQ(sink_->num_sent(), 2U);
  const double num_periods = absl::ToDoubleSeconds(absl::Now() - begin) * 2;
  v1::StreamFramesRequest more;
  more.set_credit(1);
  session_->OnRequest(more);
  EXPECT_GE(static_cast<double>(sink_->Await(2).num_dropped()), num_periods - 2);
  session_->OnRequest(more);
  session_->OnRequest(more);
  const int64_t num_late_before = sink_->Await(3).num_dropped();
  EXPECT_TRUE(sink_->Await(4).num_dropped() > num_late_before || AwaitMade(6));
  EXPECT_EQ(sink_->num_sent(), 5U) << "credits add up";
}

TEST_F(StreamSessionTest, EndsWithItsCreditOnceNoMoreCanCome) {
  PublishSplash();
  v1::StreamFramesRequest request = Request();
  request.set_loop(true);
  request.set_credit(1);
  session_->OnRequest(request);
  session_->OnHalfClosed();
  const std::jthread client = TakeAll(absl::ZeroDuration());
  EXPECT_TRUE(sink_->AwaitEnd().ok());
  EXPECT_EQ(sink_->num_sent(), 1U);
}

TEST_F(StreamSessionTest, WhatComesWhileTheFamilyIsLoadedIsTakenWithoutCredit) {
  PublishSplash();
  absl::Notification release;
  const auto wait = [&] { release.WaitForNotification(); };
  ASSERT_TRUE(backends_->io.Post(wait).ok());
  ASSERT_TRUE(backends_->loads.Post(wait).ok());
  const auto num_waiting = [&] {
    return backends_->io.num_waiting() + backends_->loads.num_waiting();
  };
  while (num_waiting() > 0) std::this_thread::yield();
  v1::StreamFramesRequest request = Request();
  request.set_credit(0);
  session_->OnRequest(request);
  while (num_waiting() == 0) std::this_thread::yield();  // for the family to be looked up
  v1::StreamFramesRequest more;
  more.set_rate(0.5);
  session_->OnRequest(more);
  session_->OnHalfClosed();
  release.Notify();
  EXPECT_TRUE(sink_->AwaitEnd().ok());
  EXPECT_EQ(sink_->num_sent(), 0U);
}

TEST_F(StreamSessionTest, ACreditIsANumberOfFrames) {
  PublishSplash();
  v1::StreamFramesRequest request = Request();
  request.set_credit(-1);
  session_->OnRequest(request);
  EXPECT_THAT(BlamedFields(sink_->AwaitEnd()), ElementsAre("credit"));
}

TEST(MergeRequest, CreditsAddUpAndStayInRange) {
  v1::StreamFramesRequest request;
  v1::StreamFramesRequest newer;
  MergeRequest(newer, request);
  EXPECT_FALSE(request.has_credit());
  newer.set_credit(3);
  MergeRequest(newer, request);
  MergeRequest(newer, request);
  EXPECT_EQ(request.credit(), 6);
  newer.set_credit(std::numeric_limits<int32_t>::max());
  MergeRequest(newer, request);
  MergeRequest(newer, request);
  EXPECT_EQ(request.credit(), std::numeric_limits<int32_t>::max());
  newer.set_credit(-5);
  MergeRequest(newer, request);
  newer.set_credit(10);
  MergeRequest(newer, request);
  EXPECT_EQ(request.credit(), -5) << "it is to be refused";
}

}  // namespace
}  // namespace liquidblend::server::stream_session_test
