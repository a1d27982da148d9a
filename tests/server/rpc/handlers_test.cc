#include "server/rpc/handlers.h"

#include <cmath>
#include <functional>
#include <set>
#include <string>
#include <vector>

#include "server/rpc/api_messages.h"
#include "tests/server/rpc/rpc_testing.h"

namespace liquidblend::rpc {
namespace {

using store::Fails;
using store::Succeeds;
using testing::ElementsAre;

class HandlersTest : public RpcTest {
 protected:
  HandlersTest() : backends_(*catalog_, *blobs_, families_, SmallBackends()) {}

  static v1::RegisterFamilyRequest Registration() {
    v1::RegisterFamilyRequest request;
    request.set_family_id("splash");
    request.set_source("animations/a");
    request.add_targets("animations/b");
    return request;
  }

  // A registration with one thing changed.
  absl::Status Register(const std::function<void(v1::RegisterFamilyRequest&)>& change) {
    v1::RegisterFamilyRequest request = Registration();
    change(request);
    return RegisterFamily(backends_, request).status();
  }

  absl::Status RegisterWith(const std::function<void(v1::Correspondence&)>& change) {
    return Register([&](v1::RegisterFamilyRequest& request) {
      v1::Correspondence& correspondence = *request.add_correspondences()->add_correspondences();
      correspondence.set_kind(v1::Correspondence::POINT);
      correspondence.mutable_source()->mutable_position()->set_x(1);
      correspondence.mutable_target()->mutable_position()->set_x(2);
      change(correspondence);
    });
  }

  absl::StatusOr<v1::Frame> Frame(const std::function<void(v1::GetFrameRequest&)>& change) {
    v1::GetFrameRequest request;
    request.set_family("families/splash");
    request.add_weights(0.5);
    request.set_time_s(0.1);
    change(request);
    return GetFrame(backends_, request);
  }

  absl::Status Stream(const std::function<void(v1::StreamFramesRequest&)>& change) {
    v1::StreamFramesRequest request;
    request.set_family("families/splash");
    request.add_weights(0.5);
    change(request);
    SimpleStream stream(families_);
    return stream.Change(request);
  }

  Backends backends_;
};

TEST_F(HandlersTest, EveryMistakeIsRefusedByName) {
  PublishSplash();
  struct Case {
    const char* what;
    absl::Status status;
    absl::StatusCode code;
    std::string field;
  };
  const auto invalid = absl::StatusCode::kInvalidArgument;
  const auto out_of_range = absl::StatusCode::kOutOfRange;
  const double nan = std::nan("");
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
  get_family.set_name("splash");
  v1::DeleteFamilyRequest delete_family;
  delete_family.set_name("families/");
  v1::ListFamiliesRequest list_families;
  list_families.set_page_size(-5);
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
  const std::vector<Case> cases = {
      {"animation without name", get_animation(""), invalid, "name"},
      {"animation of another kind", get_animation("families/a"), invalid, "name"},
      {"animation with a path", get_animation("animations/../x"), invalid, "name"},
      {"negative page", list_animations(-1, ""), invalid, "page_size"},
      {"foreign token", list_animations(0, "bm9uc2Vuc2U"), invalid, "page_token"},
      {"delete another kind", DeleteAnimation(backends_, delete_animation).status(), invalid,
       "name"},
      {"family by its id", GetFamily(backends_, get_family).status(), invalid, "name"},
      {"family without id", DeleteFamily(backends_, delete_family).status(), invalid, "name"},
      {"negative family page", ListFamilies(backends_, list_families).status(), invalid,
       "page_size"},
      {"operation with a path", GetOperation(backends_, get_operation).status(), invalid, "name"},
      {"cancel nothing", CancelOperation(backends_, cancel_operation).status(), invalid, "name"},
      {"delete nothing", DeleteOperation(backends_, delete_operation).status(), invalid, "name"},
      {"list elsewhere", ListOperations(backends_, list_operations).status(), invalid, "name"},
      {"filter", ListOperations(backends_, filtered).status(), invalid, "filter"},
      {"wrong token", ListOperations(backends_, wrong_token).status(), invalid, "page_token"},

      {"no family id", Register([](auto& r) { r.clear_family_id(); }), invalid, "family_id"},
      {"no source", Register([](auto& r) { r.clear_source(); }), invalid, "source"},
      {"source by its id", Register([](auto& r) { r.set_source("a"); }), invalid, "source"},
      {"no targets", Register([](auto& r) { r.clear_targets(); }), invalid, "targets"},
      {"target by its id", Register([](auto& r) {
         r.clear_targets();
         r.add_targets(std::string("b"));
       }),
       invalid, "targets[0]"},
      {"source as target", Register([](auto& r) { r.add_targets("animations/a"); }), invalid,
       "targets[1]"},
      {"target twice", Register([](auto& r) { r.add_targets("animations/b"); }), invalid,
       "targets[1]"},
      {"too many targets", Register([](auto& r) {
         for (const char* id : {"c", "d", "e"}) r.add_targets(std::string("animations/") + id);
       }),
       invalid, "targets"},
      {"iterations", Register([](auto& r) { r.mutable_options()->set_max_iterations(201); }),
       invalid, "options.max_iterations"},
      {"spacing", Register([&](auto& r) { r.mutable_options()->set_node_spacing_edges(nan); }),
       invalid, "options.node_spacing_edges"},
      {"share", Register([](auto& r) { r.mutable_options()->set_sample_share(1.5); }), invalid,
       "options.sample_share"},
      {"smoothness", Register([](auto& r) { r.mutable_options()->set_final_smoothness(-1); }),
       invalid, "options.final_smoothness"},
      {"thin sheets", Register([](auto& r) { r.mutable_options()->set_thin_sheets_from(1.25); }),
       invalid, "options.thin_sheets_from"},
      {"connectivity", Register([](auto& r) {
         r.mutable_space_time()->set_connectivity(static_cast<v1::Connectivity>(9));
       }),
       invalid, "space_time.connectivity"},
      {"grid", Register([](auto& r) { r.mutable_space_time()->set_spacing_edges(0.1); }), invalid,
       "space_time.spacing_edges"},
      {"droplets", Register([](auto& r) { r.mutable_space_time()->set_droplet_vertices(-5); }),
       invalid, "space_time.droplet_vertices"},
      {"sheets", Register([&](auto& r) { r.mutable_space_time()->set_sheet_thickness_edges(nan); }),
       invalid, "space_time.sheet_thickness_edges"},
      {"levels", Register([](auto& r) { r.mutable_space_time()->set_coarser_levels(7); }), invalid,
       "space_time.coarser_levels"},
      {"coarsest level", Register([](auto& r) { r.mutable_space_time()->set_spacing_edges(3); }),
       invalid, "space_time.coarser_levels"},
      {"request id", Register([](auto& r) { r.set_request_id(std::string(129, 'r')); }), invalid,
       "request_id"},
      {"list per target", Register([](auto& r) {
         r.add_correspondences();
         r.add_correspondences();
       }),
       invalid, "correspondences"},
      {"too many correspondences", Register([](auto& r) {
         auto& list = *r.add_correspondences();
         for (int k = 0; k < 3; ++k) list.add_correspondences();
       }),
       invalid, "correspondences[0].correspondences"},
      {"kind", RegisterWith([](auto& c) { c.clear_kind(); }), invalid,
       "correspondences[0].correspondences[0].kind"},
      {"source event", RegisterWith([](auto& c) { c.clear_source(); }), invalid,
       "correspondences[0].correspondences[0].source.position"},
      {"target position",
       RegisterWith([&](auto& c) { c.mutable_target()->mutable_position()->set_y(nan); }), invalid,
       "correspondences[0].correspondences[0].target.position"},
      {"target time", RegisterWith([](auto& c) { c.mutable_target()->set_time_s(-1); }), invalid,
       "correspondences[0].correspondences[0].target.time_s"},
      {"length", RegisterWith([&](auto& c) { c.set_length_s(nan); }), invalid,
       "correspondences[0].correspondences[0].length_s"},

      {"no family", Frame([](auto& r) { r.clear_family(); }).status(), invalid, "family"},
      {"negative version", Frame([](auto& r) { r.set_version(-1); }).status(), invalid, "version"},
      {"no weights", Frame([](auto& r) { r.clear_weights(); }).status(), invalid, "weights"},
      {"too many weights", Frame([](auto& r) { r.add_weights(0); }).status(), invalid, "weights"},
      {"weight too large", Frame([](auto& r) { r.set_weights(0, 2.1); }).status(), invalid,
       "weights"},
      {"weight not a number", Frame([&](auto& r) { r.set_weights(0, nan); }).status(), invalid,
       "weights"},
      {"before the start", Frame([](auto& r) { r.set_time_s(-0.1); }).status(), out_of_range,
       "time_s"},
      {"after the end", Frame([](auto& r) { r.set_time_s(9); }).status(), out_of_range, "time_s"},
      {"time not a number", Frame([&](auto& r) { r.set_time_s(nan); }).status(), out_of_range,
       "time_s"},
      {"bits", Frame([](auto& r) { r.mutable_encoding()->set_position_bits(21); }).status(),
       invalid, "encoding.position_bits"},
      {"format", Frame([](auto& r) {
                   r.mutable_encoding()->set_format(static_cast<v1::Encoding::Format>(7));
                 }).status(),
       invalid, "encoding.format"},
      {"preset", Frame([](auto& r) {
                   r.mutable_encoding()->set_preset(static_cast<v1::Encoding::Preset>(9));
                 }).status(),
       invalid, "encoding.preset"},

      {"level", Frame([](auto& r) { r.mutable_surface()->set_level_of_detail(1); }).status(),
       invalid, "surface.level_of_detail"},
      {"passes", Frame([](auto& r) { r.mutable_surface()->set_smoothing_passes(33); }).status(),
       invalid, "surface.smoothing_passes"},
      {"strength",
       Frame([&](auto& r) { r.mutable_surface()->set_smoothing_strength(nan); }).status(), invalid,
       "surface.smoothing_strength"},
      {"kind of smoothing",
       Frame([](auto& r) {
         r.mutable_surface()->set_smoothing(static_cast<v1::SurfaceOptions::Smoothing>(9));
       }).status(),
       invalid, "surface.smoothing"},
      {"temporal",
       Frame([](auto& r) { r.mutable_surface()->set_temporal_smoothing(1.5); }).status(), invalid,
       "surface.temporal_smoothing"},
      {"attribute",
       Frame([](auto& r) {
         r.mutable_surface()->add_attributes(v1::SurfaceOptions::ATTRIBUTE_UNSPECIFIED);
       }).status(),
       invalid, "surface.attributes"},
      {"stream level", Stream([](auto& r) { r.mutable_surface()->set_level_of_detail(-1); }),
       invalid, "surface.level_of_detail"},

      {"stream of nothing", Stream([](auto& r) { r.clear_family(); }), invalid, "family"},
      {"stream weights", Stream([](auto& r) { r.add_weights(1); }), invalid, "weights"},
      {"stream time", Stream([](auto& r) { r.set_time_s(9); }), out_of_range, "time_s"},
      {"stream rate", Stream([&](auto& r) { r.set_rate(nan); }), invalid, "rate"},
      {"stream frame rate", Stream([](auto& r) { r.set_frames_per_second(0); }), invalid,
       "frames_per_second"},
      {"stream frame rate", Stream([](auto& r) { r.set_frames_per_second(241); }), invalid,
       "frames_per_second"},
      {"stream that never ends", Stream([](auto& r) {
         r.set_lossless(true);
         r.set_rate(0);
       }),
       invalid, "rate"},
  };
  for (const Case& c : cases) {
    EXPECT_EQ(c.status.code(), c.code) << c.what << ": " << c.status;
    EXPECT_THAT(BlamedFields(c.status), ElementsAre(c.field)) << c.what;
  }
}

TEST_F(HandlersTest, AFrameIsFinishedAsAskedFor) {
  PublishSplash();
  const std::string plain = Frame([](auto&) {})->data();
  std::set<std::string> frames = {plain};
  const std::vector<std::function<void(v1::SurfaceOptions&)>> changes = {
      [](auto& s) { s.set_smoothing_passes(2); },
      [](auto& s) {
        s.set_smoothing_passes(2);
        s.set_smoothing(v1::SurfaceOptions::LAPLACIAN);
      },
      [](auto& s) {
        s.set_smoothing_passes(2);
        s.set_smoothing_strength(0.25);
      },
      [](auto& s) { s.set_temporal_smoothing(1); },
      [](auto& s) { s.add_attributes(v1::SurfaceOptions::NORMALS); },
      [](auto& s) { s.add_attributes(v1::SurfaceOptions::VELOCITIES); }};
  for (const auto& change : changes) {
    const auto ask = [&](v1::GetFrameRequest& request) { change(*request.mutable_surface()); };
    const absl::StatusOr<v1::Frame> frame = Frame(ask);
    ASSERT_THAT(frame, Succeeds());
    EXPECT_EQ(frame->data(), Frame(ask)->data());
    frames.insert(frame->data());
  }
  EXPECT_EQ(frames.size(), 1 + changes.size());  // all differ
  EXPECT_EQ(Frame([](auto& r) { r.mutable_surface(); })->data(), plain);
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

TEST_F(HandlersTest, AnAnimationThatIsNotReadyIsNotRegistered) {
  ImportAnimation("a");
  SubmitImport("b");
  EXPECT_THAT(RegisterFamily(backends_, Registration()),
              Fails(absl::StatusCode::kFailedPrecondition, "b"));
}

TEST_F(HandlersTest, AnOptionOutOfRangeIsToldWithItsValueAndRange) {
  v1::RegisterFamilyRequest request = Registration();
  request.mutable_options()->set_thin_sheets_from(1.25);
  request.mutable_space_time()->set_spacing_edges(3);
  request.mutable_space_time()->set_droplet_vertices(-5);
  const absl::Status status = RegisterFamily(backends_, request).status();
  EXPECT_THAT(status, Fails(absl::StatusCode::kInvalidArgument,
                            "options.thin_sheets_from: must be in [0, 1], got 1.25"));
  EXPECT_THAT(status, Fails(absl::StatusCode::kInvalidArgument,
                            "space_time.droplet_vertices: must be in [0, 10000], got -5"));
  EXPECT_THAT(status, Fails(absl::StatusCode::kInvalidArgument,
                            "space_time.coarser_levels: with 2 and spacing_edges 3, the coarsest "
                            "level has a spacing of 6 mean edges, above 4"));
}

TEST_F(HandlersTest, OptionsAndCorrespondencesReachTheJob) {
  ImportAnimation("a");
  ImportAnimation("b");
  v1::RegisterFamilyRequest request = Registration();
  request.mutable_options()->set_max_iterations(7);
  request.mutable_options()->set_seed(42);
  request.mutable_options()->set_thin_sheets_from(0.5);
  request.mutable_options()->set_automatic_correspondences(false);
  request.mutable_space_time()->set_connectivity(v1::REBUILT);
  request.mutable_space_time()->set_spacing_edges(1.25);
  request.mutable_space_time()->set_droplet_vertices(0);
  request.mutable_space_time()->set_coarser_levels(1);
  v1::Correspondence& correspondence = *request.add_correspondences()->add_correspondences();
  correspondence.set_kind(v1::Correspondence::SPACE);
  correspondence.set_hard(true);
  correspondence.mutable_source()->mutable_position()->set_z(3);
  correspondence.mutable_source()->set_time_s(0.25);
  correspondence.mutable_target()->mutable_position()->set_y(-2);
  ASSERT_THAT(RegisterFamily(backends_, request), Succeeds());
  const store::pb::RegisterJob job = TakeJob().job.register_family();
  EXPECT_EQ(job.options().max_iterations(), 7);
  EXPECT_EQ(job.options().seed(), 42U);
  EXPECT_EQ(job.options().thin_sheets_from(), 0.5);
  EXPECT_TRUE(job.options().has_automatic_correspondences());
  EXPECT_FALSE(job.options().automatic_correspondences());
  EXPECT_EQ(job.space_time().connectivity(), store::pb::REBUILT);
  EXPECT_EQ(job.space_time().spacing_edges(), 1.25);
  EXPECT_TRUE(job.space_time().has_droplet_vertices());
  EXPECT_FALSE(job.space_time().has_sheet_thickness_edges());
  EXPECT_EQ(job.space_time().coarser_levels(), 1);
  const store::pb::Correspondence& record = job.correspondences(0).correspondences(0);
  EXPECT_EQ(record.kind(), store::pb::Correspondence::SPACE);
  EXPECT_TRUE(record.hard());
  EXPECT_THAT(record.source(), ElementsAre(0, 0, 3, 0.25));
  EXPECT_THAT(record.target(), ElementsAre(0, -2, 0, 0));
}

TEST_F(HandlersTest, ARefinementTakesTheFamilysAnimationsAndNewestVersion) {
  PublishSplash();
  v1::RegisterFamilyRequest request;
  request.set_family_id("splash");
  request.set_refine(true);
  ASSERT_THAT(RegisterFamily(backends_, request), Succeeds());
  const store::pb::RegisterJob job = TakeJob().job.register_family();
  EXPECT_EQ(job.source(), "a");
  EXPECT_THAT(job.targets(), ElementsAre("b"));
  EXPECT_EQ(job.refine_version(), 1);
}

TEST_F(HandlersTest, ARefinementOfOtherAnimationsOrOfNothingIsRefused) {
  PublishSplash();
  const auto refine = [&](const char* family, const char* source) {
    v1::RegisterFamilyRequest request;
    request.set_family_id(family);
    request.set_source(source);
    request.set_refine(true);
    return RegisterFamily(backends_, request).status();
  };
  EXPECT_THAT(refine("splash", "animations/b"),
              Fails(absl::StatusCode::kInvalidArgument,
                    "source: the family to be refined has animations/a, got animations/b"));
  EXPECT_THAT(refine("none", ""), Fails(absl::StatusCode::kNotFound, "none"));
  ASSERT_THAT(Register([](auto& r) { r.set_family_id("unfinished"); }), Succeeds());
  EXPECT_THAT(refine("unfinished", ""),
              Fails(absl::StatusCode::kFailedPrecondition, "no finished version yet"));
}

TEST(ApiMessages, AFamilyTellsWhatBecameOfItsCorrespondences) {
  store::pb::FamilyRecord record;
  store::pb::CorrespondenceReport& report =
      *record.mutable_manifest()->add_reports()->add_correspondences();
  report.mutable_correspondence()->set_kind(store::pb::Correspondence::TRAJECTORY);
  for (const double value : {1.0, 2.0, 3.0, 0.5}) {
    report.mutable_correspondence()->add_source(value);
    report.mutable_correspondence()->add_target(2 * value);
  }
  report.set_residual_m(0.25);
  report.set_residual_frames(1.5);
  report.set_num_nodes(4);
  report.set_overruled(true);
  report.set_automatic(true);
  report.set_confidence(0.75);
  const v1::CorrespondenceReport told = ToFamily(record).reports(0).correspondences(0);
  EXPECT_EQ(told.outcome(), v1::CorrespondenceReport::OVERRULED);
  EXPECT_EQ(told.correspondence().kind(), v1::Correspondence::TRAJECTORY);
  EXPECT_EQ(told.correspondence().source().time_s(), 0.5);
  EXPECT_EQ(told.correspondence().target().position().z(), 6);
  EXPECT_EQ(told.residual_m(), 0.25);
  EXPECT_EQ(told.residual_frames(), 1.5);
  EXPECT_EQ(told.num_nodes(), 4);
  EXPECT_TRUE(told.automatic());
  EXPECT_EQ(told.confidence(), 0.75);
}

TEST_F(HandlersTest, APriorityOutOfRangeIsNamed) {
  for (const int priority : {-101, 101}) {
    EXPECT_THAT(Register([&](auto& request) { request.set_priority(priority); }),
                Fails(absl::StatusCode::kInvalidArgument,
                      absl::StrCat("priority: must be in [-100, 100], got ", priority)));
  }
}

TEST_F(HandlersTest, ARegistrationKnowsWhoseItIsAndHowUrgent) {
  ImportAnimation("a");
  ImportAnimation("b");
  v1::RegisterFamilyRequest request = Registration();
  request.set_priority(-7);
  Principal principal;
  principal.name = "studio";
  const auto operation = RegisterFamily(backends_, request, principal);
  ASSERT_THAT(operation, Succeeds());
  const store::pb::JobRecord job = catalog_->ListJobs(1, "")->records[0];
  EXPECT_EQ(job.owner(), "studio");
  EXPECT_EQ(job.priority(), -7);
  v1::RegisterFamilyMetadata metadata;
  EXPECT_TRUE(operation->metadata().UnpackTo(&metadata));
  EXPECT_EQ(metadata.progress().priority(), -7);
}

TEST_F(HandlersTest, AnOperationThatNobodyTakesSaysWhatItWaitsFor) {
  store::pb::JobRecord job;
  job.set_state(store::pb::JobRecord::QUEUED);  // since 1970
  job.mutable_import_animation()->set_animation("drop");
  job.set_memory_bytes(int64_t{12} << 30);
  ASSERT_TRUE(catalog_->LeaseJob("small", absl::Minutes(1), int64_t{8} << 30).ok());
  const auto progress = [&] {
    const auto operation = ToOperation(job, *catalog_);
    EXPECT_THAT(operation, Succeeds());
    v1::ImportAnimationMetadata metadata;
    EXPECT_TRUE(operation->metadata().UnpackTo(&metadata));
    return metadata.progress();
  };
  EXPECT_EQ(progress().waiting_for(),
            "needs about 12.0 GiB of memory; no worker that asked lately can hold it");
  EXPECT_EQ(progress().memory_bytes(), int64_t{12} << 30);
  job.mutable_update_time()->set_seconds(absl::ToUnixSeconds(absl::Now()));
  EXPECT_EQ(progress().waiting_for(), "");  // not yet
}

TEST_F(HandlersTest, AnOperationThatIsTriedAgainSaysWhenAndWhy) {
  const store::pb::JobRecord job = SubmitImport("drop");
  ASSERT_THAT(catalog_->FailJob(TakeJob().lease_id, absl::UnavailableError("no S3"), true),
              Succeeds());
  lro::GetOperationRequest request;
  request.set_name("operations/" + job.id());
  const auto operation = GetOperation(backends_, request);
  ASSERT_THAT(operation, Succeeds());
  EXPECT_FALSE(operation->done());
  v1::ImportAnimationMetadata metadata;
  EXPECT_TRUE(operation->metadata().UnpackTo(&metadata));
  const v1::Progress& progress = metadata.progress();
  EXPECT_EQ(progress.stage(), "queued");
  EXPECT_EQ(progress.attempt(), 1);
  EXPECT_EQ(progress.last_failure().code(), 14);
  EXPECT_EQ(progress.last_failure().message(), "no S3");
  EXPECT_EQ(progress.next_attempt_time().seconds(),
            catalog_->GetJob(job.id())->next_attempt_time().seconds());
  EXPECT_GT(progress.next_attempt_time().seconds(), 0);
}

TEST_F(HandlersTest, ARepeatedRequestIdGivesTheFirstOperation) {
  ImportAnimation("a");
  ImportAnimation("b");
  v1::RegisterFamilyRequest request = Registration();
  request.set_request_id("once");
  const auto first = RegisterFamily(backends_, request);
  const auto second = RegisterFamily(backends_, request);
  ASSERT_THAT(first, Succeeds());
  ASSERT_THAT(second, Succeeds());
  EXPECT_EQ(first->name(), second->name());
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

TEST_F(HandlersTest, AnOperationTellsItsWholeLife) {
  const store::pb::JobRecord job = SubmitImport("drop");
  lro::GetOperationRequest request;
  request.set_name("operations/" + job.id());
  v1::ImportAnimationMetadata metadata;

  auto queued = GetOperation(backends_, request);
  ASSERT_THAT(queued, Succeeds());
  EXPECT_FALSE(queued->done());
  ASSERT_TRUE(queued->metadata().UnpackTo(&metadata));
  EXPECT_EQ(metadata.animation(), "animations/drop");
  EXPECT_EQ(metadata.progress().stage(), "queued");

  const store::Lease lease = TakeJob();
  store::pb::JobProgress progress;
  progress.set_stage("reading frames");
  progress.set_fraction(0.25);
  ASSERT_TRUE(catalog_->Heartbeat(lease.lease_id, absl::Hours(1), progress).ok());
  auto running = GetOperation(backends_, request);
  ASSERT_TRUE(running->metadata().UnpackTo(&metadata));
  EXPECT_EQ(metadata.progress().stage(), "reading frames");
  EXPECT_EQ(metadata.progress().fraction(), 0.25);
  EXPECT_EQ(metadata.progress().attempt(), 1);
  EXPECT_EQ(metadata.progress().worker(), "test");

  store::pb::AnimationRecord record;
  record.set_id("drop");
  record.mutable_manifest()->set_num_frames(3);
  ASSERT_TRUE(catalog_->PublishAnimation(lease.lease_id, record).ok());
  auto done = GetOperation(backends_, request);
  EXPECT_TRUE(done->done());
  v1::Animation animation;
  ASSERT_TRUE(done->response().UnpackTo(&animation));
  EXPECT_EQ(animation.name(), "animations/drop");
  EXPECT_EQ(animation.state(), v1::Animation::READY);
  EXPECT_EQ(animation.num_frames(), 3);

  ASSERT_TRUE(catalog_->DeleteAnimation("drop").ok());
  ASSERT_TRUE(GetOperation(backends_, request)->response().UnpackTo(&animation));
  EXPECT_EQ(animation.name(), "animations/drop");
  EXPECT_EQ(animation.state(), v1::Animation::STATE_UNSPECIFIED);
}

TEST_F(HandlersTest, ARegistrationOfSeveralTargetsIsOneOperation) {
  for (const std::string id : {"a", "b", "c"}) ImportAnimation(id);
  v1::RegisterFamilyRequest registration = Registration();
  registration.clear_targets();
  for (const std::string id : {"b", "c"}) registration.add_targets("animations/" + id);
  const auto submitted = RegisterFamily(backends_, registration);
  ASSERT_THAT(submitted, Succeeds());
  EXPECT_EQ(ListOperations(backends_, {})->operations_size(), 4);  // with three imports
  lro::GetOperationRequest request;
  request.set_name(submitted->name());
  const auto progress_now = [&] {
    const auto operation = GetOperation(backends_, request);
    EXPECT_THAT(operation, Succeeds());
    EXPECT_FALSE(operation->done());
    v1::RegisterFamilyMetadata metadata;
    EXPECT_TRUE(operation->metadata().UnpackTo(&metadata));
    return metadata.progress();
  };
  EXPECT_EQ(progress_now().stage(), "queued");
  const store::Lease first = TakeJob(), second = TakeJob();
  const auto report = [&](const store::Lease& lease, double fraction) {
    store::pb::JobProgress progress;
    progress.set_stage("registration");
    progress.set_fraction(fraction);
    EXPECT_THAT(catalog_->Heartbeat(lease.lease_id, absl::Hours(1), progress), Succeeds());
  };
  report(first, 0.75);
  report(second, 0.25);
  EXPECT_EQ(progress_now().stage(), "registration");
  EXPECT_DOUBLE_EQ(progress_now().fraction(), store::kPartsShare / 2);
  EXPECT_EQ(progress_now().target_index(), 1);
  EXPECT_EQ(progress_now().attempt(), 1);
  EXPECT_THAT(catalog_->FinishPart(first.lease_id, "blob"), Succeeds());
  EXPECT_THAT(catalog_->FinishPart(second.lease_id, "blob"), Succeeds());
  EXPECT_EQ(progress_now().stage(), "queued");
  EXPECT_DOUBLE_EQ(progress_now().fraction(), store::kPartsShare);
  EXPECT_EQ(TakeJob().job.parent(), "");
  EXPECT_DOUBLE_EQ(progress_now().fraction(), store::kPartsShare);
}

TEST_F(HandlersTest, AFailedOperationTellsWhy) {
  const store::pb::JobRecord job = SubmitImport("drop");
  const absl::Status error = absl::InvalidArgumentError("frame 3: not closed");
  ASSERT_TRUE(catalog_->FailJob(TakeJob().lease_id, error, false).ok());
  lro::GetOperationRequest request;
  request.set_name("operations/" + job.id());
  const auto operation = GetOperation(backends_, request);
  ASSERT_THAT(operation, Succeeds());
  EXPECT_TRUE(operation->done());
  EXPECT_EQ(operation->error().code(), 3);
  EXPECT_EQ(operation->error().message(), "frame 3: not closed");
}

TEST_F(HandlersTest, ACancelledOperationSaysSo) {
  const store::pb::JobRecord job = SubmitImport("drop");
  lro::CancelOperationRequest cancel;
  cancel.set_name("operations/" + job.id());
  ASSERT_THAT(CancelOperation(backends_, cancel), Succeeds());
  const auto operations = ListOperations(backends_, {});
  ASSERT_THAT(operations, Succeeds());
  ASSERT_EQ(operations->operations_size(), 1);
  EXPECT_TRUE(operations->operations(0).done());
  EXPECT_EQ(operations->operations(0).error().code(), 1);
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

TEST(ToFamily, TellsTheVerdict) {
  store::pb::FamilyRecord record;
  record.mutable_manifest()->set_frames_per_second(24);
  store::pb::RegistrationReport& report = *record.mutable_manifest()->add_reports();
  store::pb::Verdict& stored = *report.mutable_verdict();
  stored.set_grade(store::pb::TOO_DIFFERENT);
  stored.set_reason("all of it");
  for (const double number : {1, 2, 3, 12}) stored.add_worst(number);
  stored.add_residual_histogram(0.5);
  stored.set_covered_share(0.25);
  stored.set_unmatched_share(0.75);
  record.mutable_manifest()->add_reports();  // of an older program
  const v1::Family family = ToFamily(record);
  ASSERT_EQ(family.reports_size(), 2);
  const v1::Verdict& verdict = family.reports(0).verdict();
  EXPECT_EQ(verdict.grade(), v1::Verdict::TOO_DIFFERENT);
  EXPECT_EQ(verdict.reason(), "all of it");
  EXPECT_EQ(verdict.worst().position().y(), 2);
  EXPECT_DOUBLE_EQ(verdict.worst().time_s(), 0.5);
  EXPECT_THAT(verdict.residual_histogram(), ElementsAre(0.5));
  EXPECT_EQ(verdict.covered_share(), 0.25);
  EXPECT_EQ(verdict.unmatched_share(), 0.75);
  EXPECT_FALSE(family.reports(1).has_verdict());
}

TEST(ToFamily, TellsWhatTheSpaceTimeMeshesAreLike) {
  store::pb::FamilyRecord record;
  record.set_id("splash");
  store::pb::FamilyManifest& manifest = *record.mutable_manifest();
  manifest.set_source("a");
  manifest.add_targets("b");
  store::pb::SpaceTimeReport& source = *manifest.add_space_time_reports();
  source.set_connectivity(store::pb::REBUILT);
  source.set_grid_spacing_m(0.09);
  source.set_edge_length_m(0.1);
  source.set_num_wedges(12);
  source.set_num_droplets(2);
  source.set_thin_share(0.25);
  source.mutable_fidelity()->set_max_distance_edges(0.5);
  source.mutable_fidelity()->set_max_component_error(1);
  manifest.add_space_time_reports()->set_connectivity(store::pb::TRACKED);
  const v1::Family family = ToFamily(record);
  ASSERT_EQ(family.space_time_reports_size(), 2);
  const v1::SpaceTimeReport& report = family.space_time_reports(0);
  EXPECT_EQ(report.animation(), "animations/a");
  EXPECT_EQ(report.connectivity(), v1::REBUILT);
  EXPECT_DOUBLE_EQ(report.grid_spacing_edges(), 0.9);
  EXPECT_EQ(report.num_wedges(), 12);
  EXPECT_EQ(report.num_droplets(), 2);
  EXPECT_EQ(report.thin_share(), 0.25);
  EXPECT_EQ(report.fidelity().max_distance_edges(), 0.5);
  EXPECT_EQ(report.fidelity().max_component_error(), 1);
  EXPECT_EQ(family.space_time_reports(1).animation(), "animations/b");
  EXPECT_EQ(family.space_time_reports(1).connectivity(), v1::TRACKED);
}

TEST_F(HandlersTest, AFrameIsTheSameBytesAgain) {
  PublishSplash();
  const auto first = Frame([](auto&) {});
  const auto second = Frame([](auto&) {});
  ASSERT_THAT(first, Succeeds());
  EXPECT_EQ(first->SerializeAsString(), second->SerializeAsString());
  EXPECT_EQ(first->data().substr(0, 5), "DRACO");
  EXPECT_EQ(first->family(), "families/splash");
  EXPECT_EQ(first->version(), 1);
  EXPECT_THAT(first->weights(), ElementsAre(0.5));
  EXPECT_EQ(first->time_s(), 0.1);
  EXPECT_GT(first->num_triangles(), 100);
  EXPECT_LT(first->bounds().min().x(), -0.8);
  EXPECT_GT(first->bounds().max().x(), 0.8);
}

TEST_F(HandlersTest, AFrameFollowsTheNewestVersionAndNamesIt) {
  PublishSplash();
  const auto old = Frame([](auto&) {});
  PublishFamily("splash", "a", "b", 2);
  const auto now = Frame([](auto& r) { r.set_version(2); });  // waits until it is loaded
  ASSERT_THAT(now, Succeeds());
  EXPECT_EQ(now->version(), 2);
  EXPECT_EQ(Frame([](auto&) {})->version(), 2);
  EXPECT_NE(now->data(), old->data());
  EXPECT_THAT(Frame([](auto& r) { r.set_version(1); }), Fails(absl::StatusCode::kNotFound, "1"));
}

TEST_F(HandlersTest, AStreamShowsTheFramesThatGetFrameGives) {
  PublishSplash();
  SimpleStream stream(families_);
  v1::StreamFramesRequest request;
  request.set_family("families/splash");
  request.add_weights(0.5);
  request.set_lossless(true);
  ASSERT_TRUE(stream.Change(request).ok());
  int num_frames = 0;
  while (const auto tick = stream.stream.Next(absl::ZeroDuration())) {
    const auto response = stream.Make(*tick);
    ASSERT_THAT(response, Succeeds());
    EXPECT_EQ(response->frame_index(), num_frames);
    const auto frame = Frame([&](auto& r) { r.set_time_s(tick->time_s); });
    EXPECT_EQ(response->frame().data(), frame->data());
    ++num_frames;
  }
  EXPECT_EQ(num_frames, kFamilyFrames);
}

TEST_F(HandlersTest, PresetsGiveOtherBytesOfTheSameTriangles) {
  PublishSplash();
  const auto fastest = Frame([](auto&) {});
  ASSERT_THAT(fastest, Succeeds());
  for (const auto preset :
       {v1::Encoding::FASTEST, v1::Encoding::BALANCED, v1::Encoding::SMALLEST}) {
    const auto frame = Frame([&](auto& r) { r.mutable_encoding()->set_preset(preset); });
    ASSERT_THAT(frame, Succeeds());
    EXPECT_EQ(frame->num_triangles(), fastest->num_triangles());
    EXPECT_EQ(frame->data() == fastest->data(), preset == v1::Encoding::FASTEST);
  }
}

TEST_F(HandlersTest, AStreamKeepsWhatAMessageDoesNotSet) {
  PublishSplash();
  SimpleStream stream(families_);
  v1::StreamFramesRequest request;
  request.set_family("families/splash");
  request.add_weights(0.25);
  request.set_time_s(0.1);
  request.set_rate(0);
  request.mutable_encoding()->set_position_bits(10);
  ASSERT_TRUE(stream.Change(request).ok());
  v1::StreamFramesRequest other_weights;
  other_weights.add_weights(0.75);
  other_weights.mutable_encoding()->set_preset(v1::Encoding::BALANCED);
  ASSERT_TRUE(stream.Change(other_weights).ok());
  const auto response = stream.MakeNext();
  ASSERT_THAT(response, Succeeds());
  EXPECT_THAT(response->frame().weights(), ElementsAre(0.75));
  EXPECT_EQ(response->frame().time_s(), 0.1);
  const auto expected = Frame([](auto& r) {
    r.set_weights(0, 0.75);
    r.mutable_encoding()->set_position_bits(10);
    r.mutable_encoding()->set_preset(v1::Encoding::BALANCED);
  });
  EXPECT_EQ(response->frame().data(), expected->data());
}

TEST_F(HandlersTest, ARegistrationCountsAgainstItsOwnersLimits) {
  PublishSplash();
  Principal ann;
  ann.name = ann.key = "ann";
  ann.limits.max_queued_jobs = 1;
  v1::RegisterFamilyRequest request = Registration();
  request.set_family_id("one");
  const auto first = RegisterFamily(backends_, request, ann);
  ASSERT_THAT(first, Succeeds());
  request.set_family_id("two");
  EXPECT_EQ(ReasonOf(RegisterFamily(backends_, request, ann).status()), "QUEUED_JOBS_EXCEEDED");
  request = Registration();
  request.set_refine(true);
  EXPECT_EQ(ReasonOf(RegisterFamily(backends_, request, ann).status()), "QUEUED_JOBS_EXCEEDED");
  EXPECT_THAT(catalog_->GetFamily("two"), Fails(absl::StatusCode::kNotFound, "two"));

  store::pb::FamilyRecord family;
  family.set_id("one");
  family.set_blob("blob");
  family.set_size_bytes(1000);
  ASSERT_THAT(catalog_->PublishFamily(TakeJob().lease_id, family), Succeeds());
  ann.limits.max_stored_bytes = 1000;
  EXPECT_EQ(ReasonOf(RegisterFamily(backends_, request, ann).status()), "STORED_BYTES_EXCEEDED");
  ASSERT_THAT(catalog_->DeleteFamily("one"), Succeeds());
  EXPECT_THAT(RegisterFamily(backends_, request, ann), Succeeds());
}

}  // namespace
}  // namespace liquidblend::rpc
