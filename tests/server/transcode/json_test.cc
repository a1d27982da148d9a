#include "server/transcode/json.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "absl/strings/str_cat.h"
#include "google/rpc/status.pb.h"
#include "liquidblend/v1/liquidblend.pb.h"
#include "tests/server/backends_testing.h"

namespace liquidblend::transcode {
namespace {

using server::BlamedFields;
using server::ReasonOf;
using testing::ElementsAre;
using testing::HasSubstr;

TEST(ParseJson, TakesBothSpellingsAndAllKinds) {
  v1::RegisterFamilyRequest request;
  ASSERT_TRUE(ParseJson(R"({"familyId": "f", "targets": ["a", "b"], "refine": true,
                            "options": {"seed": "7", "sample_share": 0.5},
                            "requiredGrade": "GOOD",
                            "correspondences": [{"correspondences": [{"hard": true}]}]})",
                        request)
                  .ok());
  EXPECT_EQ(request.family_id(), "f");
  EXPECT_THAT(request.targets(), ElementsAre("a", "b"));
  EXPECT_EQ(request.options().seed(), 7U);
  EXPECT_EQ(request.options().sample_share(), 0.5);
  EXPECT_EQ(request.required_grade(), v1::Verdict::GOOD);
  EXPECT_TRUE(request.correspondences(0).correspondences(0).hard());
}

TEST(ParseJson, TakesNothingForAnEmptyMessage) {
  v1::GetFamilyRequest request;
  request.set_name("before");
  EXPECT_TRUE(ParseJson("", request).ok());
  EXPECT_EQ(request.name(), "");
  EXPECT_TRUE(ParseJson(" {}\n", request).ok());
}

TEST(ParseJson, NamesTheFieldAtFault) {
  for (const auto& [json, field] : std::vector<std::pair<std::string, std::string>>{
           {R"({"options": {"seed": "x"}})", "options.seed"},
           {R"({"options": {"seeds": 1}})", "options.seeds"},
           {R"({"correspondences": [{}, {"correspondences": [{"source": {"time": 1}}]}]})",
            "correspondences[1].correspondences[0].source.time"},
           {R"({"family": 1})", "family"},
           {R"({"familyId": 1.5, "priority": 1e99})", "priority"},
           {R"({"requiredGrade": "SPLENDID"})", "required_grade"},
           {R"({"refine": "maybe"})", "refine"}}) {
    v1::RegisterFamilyRequest request;
    const absl::Status status = ParseJson(json, request);
    EXPECT_TRUE(absl::IsInvalidArgument(status)) << json;
    EXPECT_THAT(BlamedFields(status), ElementsAre(field)) << json << " " << status;
  }
}

TEST(ParseJson, TellsWhatIsNoJson) {
  for (const std::string& text :
       {std::string("{"), std::string("[]"), std::string("nothing"), std::string("{\"name\": }"),
        std::string("{} {}"), std::string("\0", 1), std::string("{\"name\": \"\xff\"}"),
        std::string("{\"name\": 1,,}")}) {
    v1::GetFamilyRequest request;
    const absl::Status status = ParseJson(text, request);
    EXPECT_TRUE(absl::IsInvalidArgument(status)) << text;
    EXPECT_EQ(ReasonOf(status), "REQUEST_MALFORMED") << text << " " << status;
    EXPECT_THAT(std::string(status.message()), HasSubstr("GetFamilyRequest"));
    EXPECT_LT(status.message().size(), 400U);
  }
}

TEST(ParseJson, OfANameThatComesTwiceTakesTheLast) {
  v1::GetFamilyRequest request;
  ASSERT_TRUE(ParseJson(R"({"version": 1, "version": 2})", request).ok());
  EXPECT_EQ(request.version(), 2);
}

// The depth of the stack must not follow the text.
TEST(ParseJson, RefusesWhatIsNestedTooDeeply) {
  constexpr int kDepth = 200'000;
  for (const char* open : {"[", "{\"options\":", "{\"x\":[", "{\"correspondences\":[{\"a\":"}) {
    std::string text = "{\"correspondences\":";
    for (int k = 0; k < kDepth; ++k) absl::StrAppend(&text, open);
    v1::RegisterFamilyRequest request;
    EXPECT_TRUE(absl::IsInvalidArgument(ParseJson(text, request))) << open;
  }
}

TEST(ParseJson, TakesNumbersOfAnySize) {
  for (const char* number :
       {"1e999", "-1e999", "\"NaN\"", "\"Infinity\"", "1e-999", "123456789012345678901234567890"}) {
    v1::GetFrameRequest request;
    (void)ParseJson(absl::StrCat("{\"timeS\": ", number, ", \"version\": ", number, "}"), request);
  }
}

TEST(JsonOf, IsReadAgain) {
  v1::Family family;
  family.set_name("families/<b>");
  family.set_version(7);
  family.set_duration_s(2.5);
  const std::string json = JsonOf(family, JsonLayout::kOneLine).value();
  EXPECT_THAT(json, HasSubstr(R"("version":"7")"));
  EXPECT_EQ(json.find('\n'), std::string::npos);
  v1::Family again;
  ASSERT_TRUE(ParseJson(json, again).ok());
  EXPECT_EQ(again.SerializeAsString(), family.SerializeAsString());
}

TEST(JsonOf, TellsWhatHasNoJson) {
  google::rpc::Status status;
  status.set_message("torn");
  auto& detail = *status.add_details();
  detail.set_type_url("type.googleapis.com/a.newer.Detail");
  detail.set_value("\x08\x01");
  const auto json = JsonOf(status);
  EXPECT_EQ(json.status().code(), absl::StatusCode::kInternal);
  EXPECT_THAT(std::string(json.status().message()), HasSubstr("Status cannot be written"));
}

}  // namespace
}  // namespace liquidblend::transcode
