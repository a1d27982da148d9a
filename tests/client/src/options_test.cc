#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "liquidblend/client.h"

namespace liquidblend {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

TEST(Options, DefaultsAreInRange) {
  EXPECT_TRUE(ImportOptions().Validate().ok());
  EXPECT_TRUE(RegistrationOptions().Validate().ok());
  EXPECT_TRUE(ConnectOptions().Validate().ok());
}

TEST(Options, ValidateNamesTheFieldAndItsValue) {
  ImportOptions import;
  import.voxel_size_m = -0.5;
  EXPECT_THAT(import.Validate().ToString(), HasSubstr("voxel_size_m is -0.5"));
  import.voxel_size_m = std::nan("");
  EXPECT_THAT(import.Validate().ToString(), HasSubstr("voxel_size_m is nan"));
  import.voxel_size_m = 0;
  import.frame_times = {0, 2, 1};
  EXPECT_THAT(import.Validate().ToString(), HasSubstr("frame_times[2] is 1"));
  import.frame_times = {0, 1, 2.5};
  EXPECT_TRUE(import.Validate().ok());
  RegistrationOptions registration;
  registration.sample_share = -1.5;
  registration.thin_sheets_from = -1;
  EXPECT_THAT(registration.Validate().ToString(), HasSubstr("sample_share is -1.5"));
  registration.sample_share = 1.5;
  registration.thin_sheets_from = std::nan("");
  EXPECT_THAT(registration.Validate().ToString(), HasSubstr("thin_sheets_from is nan"));
  SpaceTimeOptions space_time;
  EXPECT_TRUE(space_time.Validate().ok());
  space_time.coarser_levels = -1;
  EXPECT_THAT(space_time.Validate().ToString(), HasSubstr("coarser_levels is -1"));
  SecurityOptions security;
  security.tls_cert = "client.crt";
  EXPECT_THAT(security.Validate().ToString(), HasSubstr("tls_cert is given without tls_key"));
  security.tls_key = "client.key";
  EXPECT_TRUE(security.Validate().ok());
  security.token = "secret\n";
  EXPECT_THAT(security.Validate().ToString(), HasSubstr("token must be"));
  EXPECT_THAT(security.Validate().ToString(), Not(HasSubstr("secret")));
  ConnectOptions connect;
  connect.call_timeout = absl::ZeroDuration();
  EXPECT_THAT(connect.Validate().ToString(), HasSubstr("call_timeout"));
  connect.call_timeout = absl::Seconds(1);
  connect.keepalive = absl::Milliseconds(1);
  EXPECT_THAT(connect.Validate().ToString(), HasSubstr("keepalive (seconds) is 0.001"));
  connect = ConnectOptions();
  connect.target = "a:1,https://b:1";
  EXPECT_THAT(connect.Validate().ToString(), HasSubstr("HOST:PORT, without https://"));
}

}  // namespace
}  // namespace liquidblend
