#include "server/api/handlers.h"

#include <limits>
#include <string>
#include <vector>

#include "tests/server/api/handlers_testing.h"

namespace liquidblend::server::handlers_test {
namespace {

using store::Fails;
using store::Succeeds;
using testing::ElementsAre;

constexpr absl::StatusCode kInvalid = absl::StatusCode::kInvalidArgument;
constexpr absl::StatusCode kOutOfRange = absl::StatusCode::kOutOfRange;
constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

// A request with one mistake: what it is, the answer, its code, and the field that it must blame.
struct Refusal {
  const char* what;
  absl::Status status;
  absl::StatusCode code;
  std::string field;
};

void ExpectRefusals(const std::vector<Refusal>& refusals) {
  for (const Refusal& refusal : refusals) {
    EXPECT_EQ(refusal.status.code(), refusal.code) << refusal.what << ": " << refusal.status;
    EXPECT_THAT(BlamedFields(refusal.status), ElementsAre(refusal.field)) << refusal.what;
  }
}

TEST_F(HandlersTest, MistakesInNamesAndPagesAreBlamed) {
  const auto get_animation = [&](const char* name) {
    v1::GetAnimationRequest request;
    request.set_name(name);
    return GetAnimation(backends_, request).status();
  };
  const auto list_animations = [&](int size, const char* token) {
    v1::ListAnimationsRequest request;
    request.set_page_size(size);
    request.set_page_token(token);
    return ListAnimations(backends_, request).status();
  };
  v1::DeleteAnimationRequest delete_animation;
  delete_animation.set_name("families/a");
  v1::GetFamilyRequest get_family;
  get_family.set_name("animations/splash");
  v1::DeleteFamilyRequest delete_family;
  delete_family.set_name("families/");
  v1::ListFamiliesRequest list_families;
  list_families.set_page_size(-5);
  ExpectRefusals({
      {"animation without name", get_animation(""), kInvalid, "name"},
      {"animation of another kind", get_animation("families/a"), kInvalid, "name"},
      {"animation with a path", get_animation("animations/../x"), kInvalid, "name"},
      {"negative page", list_animations(-1, ""), kInvalid, "page_size"},
      {"foreign token", list_animations(0, "bm9uc2Vuc2U"), kInvalid, "page_token"},
      {"delete another kind", DeleteAnimation(backends_, delete_animation).status(), kInvalid,
       "name"},
      {"family of another kind", GetFamily(backends_, get_family).status(), kInvalid, "name"},
      {"family without id", DeleteFamily(backends_, delete_family).status(), kInvalid, "name"},
      {"negative family page", ListFamilies(backends_, list_families).status(), kInvalid,
       "page_size"},
  });
}

TEST_F(HandlersTest, MistakesInCallsOfOperationsAreBlamed) {
  lro::GetOperationRequest get_operation;
  get_operation.set_name("operations/a/b");
  lro::CancelOperationRequest cancel_operation;
  lro::DeleteOperationRequest delete_operation;
  lro::ListOperationsRequest list_operations;
  list_operations.set_name("animations");
  lro::ListOperationsRequest filtered;
  filtered.set_filter("done=true");
  lro::ListOperationsRequest wrong_token;
  wrong_token.set_page_token("%%%");
  ExpectRefusals({
      {"operation with a path", GetOperation(backends_, get_operation).status(), kInvalid, "name"},
      {"cancel nothing", CancelOperation(backends_, cancel_operation).status(), kInvalid, "name"},
      {"delete nothing", DeleteOperation(backends_, delete_operation).status(), kInvalid, "name"},
      {"list elsewhere", ListOperations(backends_, list_operations).status(), kInvalid, "name"},
      {"filter", ListOperations(backends_, filtered).status(), kInvalid, "filter"},
      {"wrong token", ListOperations(backends_, wrong_token).status(), kInvalid, "page_token"},
  });
}

TEST_F(HandlersTest, MistakesInAnimationsOfARegistrationAreBlamed) {
  PublishSplash();
  ExpectRefusals({
      {"no family id", Register([](auto& r) { r.clear_family_id(); }), kInvalid, "family_id"},
      {"no source", Register([](auto& r) { r.clear_source(); }), kInvalid, "source"},
      {"source of another kind", Register([](auto& r) { r.set_source("families/a"); }), kInvalid,
       "source"},
      {"no targets", Register([](auto& r) { r.clear_targets(); }), kInvalid, "targets"},
      {"target of another kind", Register([](auto& r) {
         r.clear_targets();
         r.add_targets(std::string("families/b"));
       }),
       kInvalid, "targets[0]"},
      {"source as target", Register([](auto& r) { r.add_targets("animations/a"); }), kInvalid,
       "targets[1]"},
      {"source as target, by its id", Register([](auto& r) { r.add_targets("a"); }), kInvalid,
       "targets[1]"},
      {"target twice", Register([](auto& r) { r.add_targets("animations/b"); }), kInvalid,
       "targets[1]"},
      {"too many targets", Register([](auto& r) {
         for (const char* id : {"c", "d", "e"}) r.add_targets(std::string("animations/") + id);
       }),
       kInvalid, "targets"},
  });
}

TEST_F(HandlersTest, MistakesInOptionsOfARegistrationAreBlamed) {
  PublishSplash();
  ExpectRefusals({
      {"iterations", Register([](auto& r) { r.mutable_options()->set_max_iterations(201); }),
       kInvalid, "options.max_iterations"},
      {"spacing", Register([](auto& r) { r.mutable_options()->set_node_spacing_edges(kNan); }),
       kInvalid, "options.node_spacing_edges"},
      {"share", Register([](auto& r) { r.mutable_options()->set_sample_share(1.5); }), kInvalid,
       "options.sample_share"},
      {"smoothness", Register([](auto& r) { r.mutable_options()->set_final_smoothness(-1); }),
       kInvalid, "options.final_smoothness"},
      {"thin sheets", Register([](auto& r) { r.mutable_options()->set_thin_sheets_from(1.25); }),
       kInvalid, "options.thin_sheets_from"},
      {"connectivity", Register([](auto& r) {
         r.mutable_space_time()->set_connectivity(static_cast<v1::Connectivity>(9));
       }),
       kInvalid, "space_time.connectivity"},
      {"grid", Register([](auto& r) { r.mutable_space_time()->set_spacing_edges(0.1); }), kInvalid,
       "space_time.spacing_edges"},
      {"droplets", Register([](auto& r) { r.mutable_space_time()->set_droplet_vertices(-5); }),
       kInvalid, "space_time.droplet_vertices"},
      {"sheets", Register([](auto& r) { r.mutable_space_time()->set_sheet_thickness_edges(kNan); }),
       kInvalid, "space_time.sheet_thickness_edges"},
      {"levels", Register([](auto& r) { r.mutable_space_time()->set_coarser_levels(7); }), kInvalid,
       "space_time.coarser_levels"},
      {"coarsest level", Register([](auto& r) { r.mutable_space_time()->set_spacing_edges(3); }),
       kInvalid, "space_time.coarser_levels"},
  });
}

TEST_F(HandlersTest, MistakesInCorrespondencesAreBlamed) {
  PublishSplash();
  ExpectRefusals({
      {"request id", Register([](auto& r) { r.set_request_id(std::string(129, 'r')); }), kInvalid,
       "request_id"},
      {"list per target", Register([](auto& r) {
         r.add_correspondences();
         r.add_correspondences();
       }),
       kInvalid, "correspondences"},
      {"too many correspondences", Register([](auto& r) {
         auto& list = *r.add_correspondences();
         for (int k = 0; k < 3; ++k) list.add_correspondences();
       }),
       kInvalid, "correspondences[0].correspondences"},
      {"too many correspondences in all", Register([](auto& r) {
         r.add_targets("animations/c");
         v1::Correspondence correspondence;
         correspondence.set_kind(v1::Correspondence::POINT);
         correspondence.mutable_source()->mutable_position();
         correspondence.mutable_target()->mutable_position();
         for (int k = 0; k < 4; ++k) {
           auto& list = k % 2 == 0 ? *r.add_correspondences() : *r.mutable_correspondences(k / 2);
           *list.add_correspondences() = correspondence;
         }
       }),
       kInvalid, "correspondences"},
      {"kind", RegisterWith([](auto& c) { c.clear_kind(); }), kInvalid,
       "correspondences[0].correspondences[0].kind"},
      {"source event", RegisterWith([](auto& c) { c.clear_source(); }), kInvalid,
       "correspondences[0].correspondences[0].source.position"},
      {"target position",
       RegisterWith([](auto& c) { c.mutable_target()->mutable_position()->set_y(kNan); }), kInvalid,
       "correspondences[0].correspondences[0].target.position"},
      {"target time", RegisterWith([](auto& c) { c.mutable_target()->set_time_s(-1); }), kInvalid,
       "correspondences[0].correspondences[0].target.time_s"},
      {"length", RegisterWith([](auto& c) { c.set_length_s(kNan); }), kInvalid,
       "correspondences[0].correspondences[0].length_s"},
  });
}

TEST_F(HandlersTest, MistakesInFramesAreBlamed) {
  PublishSplash();
  ExpectRefusals({
      {"no family", Frame([](auto& r) { r.clear_family(); }).status(), kInvalid, "family"},
      {"negative version", Frame([](auto& r) { r.set_version(-1); }).status(), kInvalid, "version"},
      {"no weights", Frame([](auto& r) { r.clear_weights(); }).status(), kInvalid, "weights"},
      {"too many weights", Frame([](auto& r) { r.add_weights(0); }).status(), kInvalid, "weights"},
      {"weight too large", Frame([](auto& r) { r.set_weights(0, 2.1); }).status(), kInvalid,
       "weights"},
      {"weight not a number", Frame([](auto& r) { r.set_weights(0, kNan); }).status(), kInvalid,
       "weights"},
      {"before the start", Frame([](auto& r) { r.set_time_s(-0.1); }).status(), kOutOfRange,
       "time_s"},
      {"after the end", Frame([](auto& r) { r.set_time_s(9); }).status(), kOutOfRange, "time_s"},
      {"time not a number", Frame([](auto& r) { r.set_time_s(kNan); }).status(), kOutOfRange,
       "time_s"},
      {"bits", Frame([](auto& r) { r.mutable_encoding()->set_position_bits(21); }).status(),
       kInvalid, "encoding.position_bits"},
      {"format", Frame([](auto& r) {
                   r.mutable_encoding()->set_format(static_cast<v1::Encoding::Format>(7));
                 }).status(),
       kInvalid, "encoding.format"},
      {"preset", Frame([](auto& r) {
                   r.mutable_encoding()->set_preset(static_cast<v1::Encoding::Preset>(9));
                 }).status(),
       kInvalid, "encoding.preset"},
      {"level", Frame([](auto& r) { r.mutable_surface()->set_level_of_detail(1); }).status(),
       kInvalid, "surface.level_of_detail"},
      {"passes", Frame([](auto& r) { r.mutable_surface()->set_smoothing_passes(33); }).status(),
       kInvalid, "surface.smoothing_passes"},
      {"strength",
       Frame([](auto& r) { r.mutable_surface()->set_smoothing_strength(kNan); }).status(), kInvalid,
       "surface.smoothing_strength"},
      {"kind of smoothing", Frame([](auto& r) {
                              r.mutable_surface()->set_smoothing(
                                  static_cast<v1::SurfaceOptions::Smoothing>(9));
                            }).status(),
       kInvalid, "surface.smoothing"},
      {"temporal",
       Frame([](auto& r) { r.mutable_surface()->set_temporal_smoothing(1.5); }).status(), kInvalid,
       "surface.temporal_smoothing"},
      {"attribute", Frame([](auto& r) {
                      r.mutable_surface()->add_attributes(
                          v1::SurfaceOptions::ATTRIBUTE_UNSPECIFIED);
                    }).status(),
       kInvalid, "surface.attributes"},
  });
}

TEST_F(HandlersTest, MistakesInStreamsAreBlamed) {
  PublishSplash();
  ExpectRefusals({
      {"stream level", Stream([](auto& r) { r.mutable_surface()->set_level_of_detail(-1); }),
       kInvalid, "surface.level_of_detail"},
      {"stream of nothing", Stream([](auto& r) { r.clear_family(); }), kInvalid, "family"},
      {"stream weights", Stream([](auto& r) { r.add_weights(1); }), kInvalid, "weights"},
      {"stream time", Stream([](auto& r) { r.set_time_s(9); }), kOutOfRange, "time_s"},
      {"stream rate", Stream([](auto& r) { r.set_rate(kNan); }), kInvalid, "rate"},
      {"stream frame rate", Stream([](auto& r) { r.set_frames_per_second(0); }), kInvalid,
       "frames_per_second"},
      {"stream frame rate", Stream([](auto& r) { r.set_frames_per_second(241); }), kInvalid,
       "frames_per_second"},
      {"stream that never ends", Stream([](auto& r) {
         r.set_lossless(true);
         r.set_rate(0);
       }),
       kInvalid, "rate"},
  });
}

TEST_F(HandlersTest, WhatIsNotThereIsNotFound) {
  const auto not_found = absl::StatusCode::kNotFound;
  v1::GetAnimationRequest animation;
  animation.set_name("animations/none");
  EXPECT_THAT(GetAnimation(backends_, animation), Fails(not_found, "none"));
  v1::DeleteAnimationRequest delete_animation;
  delete_animation.set_name("animations/none");
  EXPECT_THAT(DeleteAnimation(backends_, delete_animation), Fails(not_found, "none"));
  v1::GetFamilyRequest family;
  family.set_name("families/none");
  EXPECT_THAT(GetFamily(backends_, family), Fails(not_found, "none"));
  v1::DeleteFamilyRequest delete_family;
  delete_family.set_name("families/none");
  EXPECT_THAT(DeleteFamily(backends_, delete_family), Fails(not_found, "none"));
  lro::GetOperationRequest operation;
  operation.set_name("operations/none");
  EXPECT_THAT(GetOperation(backends_, operation), Fails(not_found, "none"));
  lro::CancelOperationRequest cancel;
  cancel.set_name("operations/none");
  EXPECT_THAT(CancelOperation(backends_, cancel), Fails(not_found, "none"));
  lro::DeleteOperationRequest delete_operation;
  delete_operation.set_name("operations/none");
  EXPECT_THAT(DeleteOperation(backends_, delete_operation), Fails(not_found, "none"));
  EXPECT_THAT(Frame([](auto&) {}), Fails(not_found, "splash"));
  EXPECT_THAT(RegisterFamily(backends_, Registration()), Fails(not_found, "a"));
}

TEST_F(HandlersTest, TakesNamesWithAndWithoutTheirCollection) {
  PublishSplash();
  for (const std::string family : {"splash", "families/splash"}) {
    v1::GetFamilyRequest get;
    get.set_name(family);
    EXPECT_THAT(GetFamily(backends_, get), Succeeds()) << family;
    EXPECT_THAT(Frame([&](auto& r) { r.set_family(family); }), Succeeds()) << family;
    EXPECT_EQ(Frame([&](auto& r) { r.set_family(family); })->family(), "families/splash");
    EXPECT_THAT(Stream([&](auto& r) { r.set_family(family); }), Succeeds()) << family;
  }
  for (const std::string animation : {"a", "animations/a"}) {
    v1::GetAnimationRequest get;
    get.set_name(animation);
    EXPECT_THAT(GetAnimation(backends_, get), Succeeds()) << animation;
  }
  v1::RegisterFamilyRequest request = Registration();
  request.set_family_id("families/other");
  request.set_source("a");
  request.clear_targets();
  request.add_targets("b");
  const auto operation = RegisterFamily(backends_, request);
  ASSERT_THAT(operation, Succeeds());
  const std::string id = operation->name().substr(operation->name().find('/') + 1);
  EXPECT_EQ(catalog_->GetJob(id)->register_family().family(), "other");
  EXPECT_EQ(catalog_->GetJob(id)->register_family().source(), "a");
  lro::GetOperationRequest get;
  for (const std::string& name : {id, operation->name()}) {
    get.set_name(name);
    EXPECT_EQ(GetOperation(backends_, get)->name(), operation->name());
  }
}

TEST_F(HandlersTest, WhatIsNeededIsNotDeleted) {
  PublishSplash();
  v1::DeleteAnimationRequest request;
  request.set_name("animations/b");
  EXPECT_THAT(DeleteAnimation(backends_, request),
              Fails(absl::StatusCode::kFailedPrecondition, "splash"));
  v1::DeleteFamilyRequest family;
  family.set_name("families/splash");
  EXPECT_THAT(DeleteFamily(backends_, family), Succeeds());
  EXPECT_THAT(DeleteAnimation(backends_, request), Succeeds());
}

// Families in memory are served without a look into the catalog.
TEST_F(HandlersTest, ADeletedFamilyIsNotServedFromMemory) {
  PublishSplash();
  v1::DeleteFamilyRequest request;
  request.set_name("families/splash");
  EXPECT_THAT(Frame([](auto&) {}), Succeeds());
  EXPECT_THAT(DeleteFamily(backends_, request), Succeeds());
  EXPECT_THAT(Frame([](auto&) {}), Fails(absl::StatusCode::kNotFound, "splash"));
}

// A call that is made again, say: the first one's answer was lost, and so was what it did here.
TEST_F(HandlersTest, AFamilyThatIsFoundDeletedIsNotServedFromMemory) {
  PublishSplash();
  v1::DeleteFamilyRequest request;
  request.set_name("families/splash");
  EXPECT_THAT(Frame([](auto&) {}), Succeeds());
  ASSERT_THAT(catalog_->DeleteFamily("splash"), Succeeds());
  EXPECT_THAT(Frame([](auto&) {}), Succeeds());
  EXPECT_THAT(DeleteFamily(backends_, request), Fails(absl::StatusCode::kNotFound, "splash"));
  EXPECT_THAT(Frame([](auto&) {}), Fails(absl::StatusCode::kNotFound, "splash"));
}

TEST_F(HandlersTest, PagesGiveEachAnimationOnce) {
  for (const char* id : {"a", "b", "c", "d", "e"}) ImportAnimation(id);
  std::vector<std::string> names;
  v1::ListAnimationsRequest request;
  request.set_page_size(2);
  do {
    const auto page = ListAnimations(backends_, request);
    ASSERT_THAT(page, Succeeds());
    EXPECT_LE(page->animations_size(), 2);
    for (const v1::Animation& animation : page->animations()) names.push_back(animation.name());
    request.set_page_token(page->next_page_token());
  } while (!request.page_token().empty());
  EXPECT_THAT(names, ElementsAre("animations/a", "animations/b", "animations/c", "animations/d",
                                 "animations/e"));
}

TEST_F(HandlersTest, AFamilySaysWhatItIsMadeOf) {
  PublishSplash();
  v1::GetFamilyRequest request;
  request.set_name("families/splash");
  const auto family = GetFamily(backends_, request);
  ASSERT_THAT(family, Succeeds());
  EXPECT_EQ(family->version(), 1);
  EXPECT_EQ(family->source(), "animations/a");
  EXPECT_THAT(family->targets(), ElementsAre("animations/b"));
  EXPECT_DOUBLE_EQ(family->duration_s(), (kFamilyFrames - 1) / family->frames_per_second());
  EXPECT_GT(family->num_cells(), 0);
  EXPECT_LT(family->bounds().min().x(), family->bounds().max().x());
}

TEST_F(HandlersTest, AKeptVersionIsDescribedAsItWas) {
  keep_versions_ = 2;
  PublishSplash();
  ImportAnimation("c");
  PublishFamily("splash", "a", "c", 2);
  v1::GetFamilyRequest request;
  request.set_name("families/splash");
  request.set_version(1);
  const auto kept = GetFamily(backends_, request);
  ASSERT_THAT(kept, Succeeds());
  EXPECT_EQ(kept->version(), 1);
  EXPECT_THAT(kept->targets(), ElementsAre("animations/b"));
  request.set_version(2);
  EXPECT_THAT(GetFamily(backends_, request)->targets(), ElementsAre("animations/c"));
  request.set_version(3);
  EXPECT_THAT(GetFamily(backends_, request), Fails(absl::StatusCode::kNotFound, "no version 3"));
  request.set_version(-1);
  EXPECT_THAT(BlamedFields(GetFamily(backends_, request).status()), ElementsAre("version"));
}

}  // namespace
}  // namespace liquidblend::server::handlers_test
