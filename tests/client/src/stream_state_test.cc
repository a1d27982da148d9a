#include "client/src/stream_state.h"

#include <gtest/gtest.h>

namespace liquidblend::client {
namespace {

v1::StreamFramesRequest FirstRequest() {
  v1::StreamFramesRequest request;
  request.set_family("families/drops");
  request.add_weights(0.5);
  return request;
}

v1::StreamFramesResponse Response(int64_t index, double next_time_s, int64_t num_requests = 1) {
  v1::StreamFramesResponse response;
  response.mutable_frame()->set_version(3);
  response.set_frame_index(index);
  response.set_next_time_s(next_time_s);
  response.set_num_requests(num_requests);
  return response;
}

TEST(StreamState, BeginsAgainAtTheFrameAfterTheLastWithItsVersion) {
  StreamState state(FirstRequest());
  EXPECT_EQ(state.Begin().SerializeAsString(), FirstRequest().SerializeAsString());
  state.Take(Response(0, 0.25));
  const v1::StreamFramesRequest again = state.Begin();
  EXPECT_EQ(again.family(), "families/drops");
  EXPECT_EQ(again.weights(0), 0.5);
  EXPECT_EQ(again.time_s(), 0.25);
  EXPECT_EQ(again.version(), 3);
}

TEST(StreamState, NumbersFramesThroughAllCalls) {
  StreamState state(FirstRequest());
  state.Begin();
  const auto with_dropped = [](v1::StreamFramesResponse response, int64_t num_dropped) {
    response.set_num_dropped(num_dropped);
    return response;
  };
  state.Take(with_dropped(Response(0, 0.1), 0));
  EXPECT_EQ(state.Take(with_dropped(Response(1, 0.3), 1)).frame_index, 1);
  state.Begin();
  const StreamedFrame streamed = state.Take(with_dropped(Response(0, 0.6), 2));
  EXPECT_EQ(streamed.frame_index, 2);
  EXPECT_EQ(streamed.num_dropped, 3);
}

TEST(StreamState, AsksAgainForATimeThatNoFrameHasShown) {
  StreamState state(FirstRequest());
  state.Begin();
  state.Take(Response(0, 0.1));
  v1::StreamFramesRequest seek;
  seek.set_time_s(0.75);
  state.Change(seek);
  state.Take(Response(1, 0.2, /*num_requests=*/1));  // made before
  EXPECT_EQ(state.Begin().time_s(), 0.75);
  state.Take(Response(0, 0.85));
  EXPECT_EQ(state.Begin().time_s(), 0.85);
}

TEST(StreamState, KeepsEarlierChanges) {
  StreamState state(FirstRequest());
  state.Begin();
  v1::StreamFramesRequest change;
  change.add_weights(0.75);
  change.set_rate(2.0);
  state.Change(change);
  state.Take(Response(0, 0.1, /*num_requests=*/2));
  const v1::StreamFramesRequest again = state.Begin();
  ASSERT_EQ(again.weights_size(), 1);
  EXPECT_EQ(again.weights(0), 0.75);
  EXPECT_EQ(again.rate(), 2.0);
}

TEST(StreamState, DoesNotAskForTheVersionOfAnotherFamily) {
  StreamState state(FirstRequest());
  state.Begin();
  state.Take(Response(0, 0.1));
  v1::StreamFramesRequest change;
  change.set_family("families/splash");
  state.Change(change);
  state.Take(Response(1, 0.2, /*num_requests=*/1));  // of the former family
  EXPECT_EQ(state.Begin().version(), 0);
}

TEST(StreamState, AsksForTheVersionThatItsUserHasAskedFor) {
  StreamState state(FirstRequest());
  state.Begin();
  state.Take(Response(0, 0.1));
  v1::StreamFramesRequest change;
  change.set_min_version(4);
  state.Change(change);  // version 3 is sent until it is there
  const v1::StreamFramesRequest again = state.Begin();
  EXPECT_EQ(again.version(), 0);
  EXPECT_EQ(again.min_version(), 4);
  EXPECT_FALSE(state.AllowNewerVersion());
}

TEST(StreamState, AllowsANewerVersionOnceIfItsOwnIsGone) {
  StreamState state(FirstRequest());
  state.Begin();
  state.Take(Response(0, 0.1));
  EXPECT_TRUE(state.AllowNewerVersion());
  const v1::StreamFramesRequest again = state.Begin();
  EXPECT_EQ(again.version(), 0);
  EXPECT_EQ(again.min_version(), 3);
  EXPECT_FALSE(state.AllowNewerVersion());  // the family is gone
}

TEST(StreamState, IsCompleteAfterTheLastFrameUnlessSomethingWasChanged) {
  StreamState state(FirstRequest());
  state.Begin();
  v1::StreamFramesResponse last = Response(0, 0);
  last.clear_next_time_s();
  state.Take(v1::StreamFramesResponse(last));
  EXPECT_TRUE(state.IsComplete());
  v1::StreamFramesRequest back;
  back.set_time_s(0.0);
  state.Change(back);
  EXPECT_FALSE(state.IsComplete());
  EXPECT_TRUE(state.CanGoOn());
}

TEST(StreamState, CannotGoOnAfterFramesOfAnOlderServer) {
  StreamState state(FirstRequest());
  EXPECT_TRUE(state.CanGoOn());
  state.Begin();
  EXPECT_TRUE(state.CanGoOn());  // nothing has come yet
  v1::StreamFramesResponse old;
  old.mutable_frame()->set_version(3);
  state.Take(std::move(old));
  EXPECT_FALSE(state.CanGoOn());
  EXPECT_FALSE(state.IsComplete());
}

}  // namespace
}  // namespace liquidblend::client
