#include "server/frames/frame_cache.h"

#include <gtest/gtest.h>

#include <memory>
#include <string>
#include <utility>

#include "tests/synthetic/families.h"

namespace liquidblend::server {
namespace {

std::shared_ptr<catalog::LoadedFamily> Load(const std::string& name, int64_t version) {
  mesh::RegisteredFamily family = synthetic::MakeFamily(
      synthetic::MixedSphere(1), {{synthetic::SmoothWarp(1, 0.0F, 0.0F), {}}});
  family.name = name;
  family.version = version;
  auto loaded = std::make_shared<catalog::LoadedFamily>(std::move(family), std::nullopt);
  loaded->generation = name + "/" + std::to_string(version);
  return loaded;
}

FramePtr Frame(size_t size = 1000) {
  return std::make_shared<const std::string>(std::string(size, 'x'));
}

FrameQuery Query(double weight, double time_s = 0.0) {
  FrameQuery query;
  query.weights = {weight};
  query.time_s = time_s;
  return query;
}

TEST(FrameCache, GivesTheVeryFrameThatWasKept) {
  const auto family = Load("a", 1);
  FrameCache cache(1 << 20);
  const FrameKey key = KeyOf(*family, Query(0.5));
  EXPECT_EQ(cache.Find(key), nullptr);
  const FramePtr frame = Frame();
  cache.Insert(key, frame);
  EXPECT_EQ(cache.Find(key), frame);  // not a copy
  EXPECT_EQ(cache.stats().num_hits, 1);
  EXPECT_EQ(cache.stats().num_misses, 1);
  EXPECT_EQ(cache.stats().num_frames, 1);
}

TEST(FrameCache, KeysDifferInWhateverChangesTheFrame) {
  const auto family = Load("a", 1);
  const FrameKey key = KeyOf(*family, Query(0.5));
  EXPECT_NE(KeyOf(*Load("a", 2), Query(0.5)), key);
  EXPECT_NE(KeyOf(*family, Query(0.5000000001)), key);
  EXPECT_NE(KeyOf(*family, Query(0.5, 1e-9)), key);
  FrameQuery query = Query(0.5);
  query.is_extrapolated = true;
  EXPECT_NE(KeyOf(*family, query), key);
  query = Query(0.5);
  query.is_clamped = true;
  EXPECT_NE(KeyOf(*family, query), key);
  query = Query(0.5);
  query.encoding.set_position_bits(12);
  EXPECT_NE(KeyOf(*family, query), key);
  query = Query(0.5);
  query.encoding.set_preset(v1::Encoding::BALANCED);
  EXPECT_NE(KeyOf(*family, query), key);
  query = Query(0.5);
  query.surface.set_smoothing_passes(1);
  EXPECT_NE(KeyOf(*family, query), key);
}

TEST(FrameCache, WhatIsNotSetIsTheSameAsTheDefault) {
  const auto family = Load("a", 1);
  FrameQuery query = Query(0.5);
  query.encoding.set_format(v1::Encoding::DRACO);
  query.encoding.set_preset(v1::Encoding::FASTEST);
  query.encoding.set_position_bits(14);
  EXPECT_EQ(KeyOf(*family, query), KeyOf(*family, Query(0.5)));
}

TEST(FrameCache, AStepIsTheSameAsTheBitsThatItTakes) {
  const auto family = Load("a", 1);
  FrameQuery bits = Query(0.5), step = Query(0.5);
  bits.encoding.set_position_bits(11);
  step.encoding.set_position_step_m(frames::StepOf(family->grid, 11));
  EXPECT_EQ(KeyOf(*family, step), KeyOf(*family, bits));
  step.encoding.set_position_step_m(frames::StepOf(family->grid, 10) * 0.999);
  EXPECT_EQ(KeyOf(*family, step), KeyOf(*family, bits));
  step.encoding.set_position_step_m(frames::StepOf(family->grid, 10));
  EXPECT_NE(KeyOf(*family, step), KeyOf(*family, bits));
}

TEST(FrameCache, TheLeastRecentlyUsedGoesWhenItIsFull) {
  const auto family = Load("a", 1);
  FrameCache cache(3 * 1500);
  for (const double weight : {0.0, 0.1, 0.2}) cache.Insert(KeyOf(*family, Query(weight)), Frame());
  EXPECT_NE(cache.Find(KeyOf(*family, Query(0.0))), nullptr);
  cache.Insert(KeyOf(*family, Query(0.3)), Frame());
  EXPECT_EQ(cache.stats().num_frames, 3);
  EXPECT_LE(cache.stats().size_bytes, 3 * 1500);
  EXPECT_EQ(cache.Find(KeyOf(*family, Query(0.1))), nullptr);
  EXPECT_NE(cache.Find(KeyOf(*family, Query(0.0))), nullptr);
  EXPECT_NE(cache.Find(KeyOf(*family, Query(0.3))), nullptr);
}

TEST(FrameCache, AFrameLargerThanTheBudgetIsNotKept) {
  const auto family = Load("a", 1);
  FrameCache cache(1000);
  cache.Insert(KeyOf(*family, Query(0.0)), Frame(1000));
  EXPECT_EQ(cache.stats().num_frames, 0);
  EXPECT_EQ(cache.stats().size_bytes, 0);
}

TEST(FrameCache, FramesOfAReplacedVersionGo) {
  const auto old_family = Load("a", 1);
  const auto new_family = Load("a", 2);
  const auto other = Load("b", 1);
  FrameCache cache(1 << 20);
  cache.Announce(*old_family);
  cache.Insert(KeyOf(*old_family, Query(0.5)), Frame());
  cache.Insert(KeyOf(*other, Query(0.5)), Frame());
  cache.Announce(*new_family);
  EXPECT_EQ(cache.Find(KeyOf(*old_family, Query(0.5))), nullptr);
  EXPECT_NE(cache.Find(KeyOf(*other, Query(0.5))), nullptr);
  cache.Insert(KeyOf(*old_family, Query(0.5)), Frame());  // a stream that still shows it
  EXPECT_EQ(cache.Find(KeyOf(*old_family, Query(0.5))), nullptr);
  EXPECT_EQ(cache.stats().num_frames, 1);
}

TEST(FrameCache, AVersionThatIsServedForALittleLongerIsNoNewOne) {
  const auto new_family = Load("a", 2);
  FrameCache cache(1 << 20);
  cache.Announce(*new_family);
  cache.Insert(KeyOf(*new_family, Query(0.5)), Frame());
  cache.Announce(*Load("a", 1));
  EXPECT_NE(cache.Find(KeyOf(*new_family, Query(0.5))), nullptr);
}

}  // namespace
}  // namespace liquidblend::server
