#include "server/admin/plan.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>

#include "server/admin/print.h"

namespace liquidblend::admin {
namespace {

using testing::HasSubstr;

TEST(Plan, MoreOfALoadNeedsMore) {
  const Load load = {.families = 20};
  const Plan plan = MakePlan(load);
  const auto with = [&](auto change) {
    Load other = load;
    change(other);
    return MakePlan(other);
  };
  EXPECT_GT(with([](Load& more) { more.vertices *= 2; }).frame_ms, plan.frame_ms);
  EXPECT_GT(with([](Load& more) { more.frames *= 2; }).family_bytes, plan.family_bytes);
  EXPECT_GT(with([](Load& more) { more.targets = 3; }).registration_core_s,
            plan.registration_core_s);
  EXPECT_GT(with([](Load& more) { more.families *= 2; }).bucket_bytes, plan.bucket_bytes);
  EXPECT_NEAR(with([](Load& more) { more.clients *= 2; }).server_busy_cores,
              2 * plan.server_busy_cores, 0.05);
  EXPECT_DOUBLE_EQ(with([](Load& more) { more.frames_per_second *= 2; }).network_bytes_per_s,
                   2 * plan.network_bytes_per_s);
  EXPECT_LT(with([](Load& less) { less.cached = 0.9; }).server_busy_cores, plan.server_busy_cores);
  EXPECT_LT(with([](Load& less) { less.families_in_use = 2; }).server_memory_bytes,
            plan.server_memory_bytes);
  EXPECT_DOUBLE_EQ(with([](Load& fast) { fast.core_speed = 2; }).server_busy_cores,
                   plan.server_busy_cores / 2);
  EXPECT_DOUBLE_EQ(with([](Load& more) { more.registrations_per_day *= 3; }).worker_busy_cores,
                   3 * plan.worker_busy_cores);
}

TEST(Plan, CoresAreBusyForAShareOfTheTime) {
  const Plan plan = MakePlan({.clients = 100});
  EXPECT_EQ(plan.server_cores, std::ceil(plan.server_busy_cores / kBusyShare));
  const Plan idle = MakePlan({.clients = 0, .registrations_per_day = 0});
  EXPECT_EQ(idle.server_cores, 0);
  EXPECT_EQ(idle.worker_cores, 0);
  EXPECT_EQ(idle.network_bytes_per_s, 0);
}

TEST(Plan, NoMoreFamiliesAreInUseThanThereAre) {
  EXPECT_EQ(MakePlan({.families = 3, .families_in_use = 30}).cache_disk_bytes,
            MakePlan({.families = 3}).cache_disk_bytes);
}

TEST(Plan, ALoadOutOfRangeIsRefusedByName) {
  const auto message = [](const Load& load) { return std::string(load.Validate().message()); };
  EXPECT_TRUE(Load().Validate().ok());
  EXPECT_THAT(message({.vertices = 0}), HasSubstr("vertices"));
  EXPECT_THAT(message({.vertices = std::numeric_limits<double>::infinity()}),
              HasSubstr("vertices"));
  EXPECT_THAT(message({.frames = 0}), HasSubstr("frames"));
  EXPECT_THAT(message({.targets = 17}), HasSubstr("targets"));
  EXPECT_THAT(message({.families = -1}), HasSubstr("families"));
  EXPECT_THAT(message({.families_in_use = -1}), HasSubstr("families_in_use"));
  EXPECT_THAT(message({.clients = -1}), HasSubstr("clients"));
  EXPECT_THAT(message({.frames_per_second = std::nan("")}), HasSubstr("frames_per_second"));
  EXPECT_THAT(message({.cached = 1.1}), HasSubstr("cached"));
  EXPECT_THAT(message({.registrations_per_day = -1}), HasSubstr("registrations_per_day"));
  EXPECT_THAT(message({.core_speed = 0}), HasSubstr("core_speed"));
}

TEST(Plan, IsPrintedForPeopleAndPrograms) {
  const Plan plan = MakePlan({.families = 7});
  const std::string text = Print(plan, Format::kText);
  for (const char* part : {"servers", "workers", "bucket", "database"}) {
    EXPECT_THAT(text, HasSubstr(part));
  }
  const auto object = nlohmann::json::parse(Print(plan, Format::kJson));
  EXPECT_EQ(object["bucket_bytes"], plan.bucket_bytes);
  EXPECT_EQ(object["server_cores"], plan.server_cores);
  EXPECT_EQ(object.size(), 14);
}

}  // namespace
}  // namespace liquidblend::admin
