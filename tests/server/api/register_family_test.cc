#include "server/api/handlers.h"

#include "tests/server/api/handlers_testing.h"
#include "tests/server/extremes.h"

namespace liquidblend::server {
namespace {

using store::Fails;
using store::Succeeds;
using testing::ElementsAre;

using RegisterFamilyTest = HandlersTest;

TEST_F(RegisterFamilyTest, AnAnimationThatIsNotReadyIsNotRegistered) {
  ImportAnimation("a");
  SubmitImport("b");
  EXPECT_THAT(RegisterFamily(backends_, Registration()),
              Fails(absl::StatusCode::kFailedPrecondition, "b"));
}

TEST_F(RegisterFamilyTest, AnOptionOutOfRangeIsToldWithItsValueAndRange) {
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

// Whoever sends them would otherwise fill the catalog.
TEST_F(RegisterFamilyTest, UnknownFieldsDoNotReachTheJob) {
  ImportAnimation("a");
  ImportAnimation("b");
  v1::RegisterFamilyRequest request = Registration();
  request.mutable_options()->set_max_iterations(7);
  request.mutable_space_time()->set_spacing_edges(1);
  request.mutable_time_blending()->set_kind(v1::TimeBlending::SQUARES);
  request.mutable_parameter_space()->add_names("height");
  request.mutable_parameter_space()->add_points()->add_values(0);
  request.mutable_parameter_space()->add_points()->add_values(1);
  v1::Correspondence& pair = *request.add_correspondences()->add_correspondences();
  pair.set_kind(v1::Correspondence::POINT);
  pair.mutable_source()->mutable_position()->set_x(1);
  pair.mutable_target()->mutable_position()->set_x(2);
  const std::string mark = "a mark of the test";
  AddUnknownFields(request, mark);
  ASSERT_THAT(RegisterFamily(backends_, request), Succeeds());
  const std::string stored = TakeJob().job.SerializeAsString();
  EXPECT_EQ(stored.find(mark), std::string::npos);
}

TEST_F(RegisterFamilyTest, OptionsAndCorrespondencesReachTheJob) {
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

TEST_F(RegisterFamilyTest, ARefinementTakesTheFamilysAnimationsAndNewestVersion) {
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

TEST_F(RegisterFamilyTest, TheRestTimeReachesTheJobIfTimesBlendAsSquares) {
  ImportAnimation("a");
  ImportAnimation("b");
  ASSERT_THAT(Register([](auto& r) {
                r.mutable_time_blending()->set_kind(v1::TimeBlending::SQUARES);
                r.mutable_time_blending()->set_rest_time_s(-0.5);
              }),
              Succeeds());
  const store::pb::RegisterJob squares = TakeJob().job.register_family();
  EXPECT_EQ(squares.rest_time_s(), -0.5);
  EXPECT_FALSE(squares.automatic_time_blending());
}

TEST_F(RegisterFamilyTest, TheWorkerChoosesHowTimesBlendUnlessToldTo) {
  ImportAnimation("a");
  ImportAnimation("b");
  for (const auto kind : {v1::TimeBlending::KIND_UNSPECIFIED, v1::TimeBlending::AUTOMATIC,
                          v1::TimeBlending::LINEAR}) {
    ASSERT_THAT(Register([&](auto& r) {
                  r.set_family_id(absl::StrCat("family", kind));
                  r.mutable_time_blending()->set_kind(kind);
                }),
                Succeeds());
    const store::pb::RegisterJob job = TakeJob().job.register_family();
    EXPECT_FALSE(job.has_rest_time_s());
    EXPECT_EQ(job.automatic_time_blending(), kind != v1::TimeBlending::LINEAR);
  }
}

TEST_F(RegisterFamilyTest, ARefinementBlendsTimesAsTheFamilyUnlessItIsAskedTo) {
  PublishSplash();
  store::pb::FamilyRecord family = *catalog_->GetFamily("splash");
  ASSERT_FALSE(family.manifest().has_rest_time_s());
  const auto refined = [&](v1::TimeBlending::Kind kind) {
    v1::RegisterFamilyRequest request;
    request.set_family_id("splash");
    request.set_refine(true);
    request.mutable_time_blending()->set_kind(kind);
    EXPECT_THAT(RegisterFamily(backends_, request), Succeeds());
    const auto leased = TakeJob();
    family.mutable_manifest()->clear_rest_time_s();
    if (leased.job.register_family().has_rest_time_s()) {
      family.mutable_manifest()->set_rest_time_s(leased.job.register_family().rest_time_s());
    }
    EXPECT_THAT(catalog_->PublishFamily(leased.lease_id, family), Succeeds());
    v1::GetFamilyRequest get;
    get.set_name("families/splash");
    return GetFamily(backends_, get)->time_blending().kind();
  };
  EXPECT_EQ(refined(v1::TimeBlending::KIND_UNSPECIFIED), v1::TimeBlending::LINEAR);
  EXPECT_EQ(refined(v1::TimeBlending::SQUARES), v1::TimeBlending::SQUARES);
  EXPECT_EQ(refined(v1::TimeBlending::KIND_UNSPECIFIED), v1::TimeBlending::SQUARES);
  EXPECT_EQ(refined(v1::TimeBlending::LINEAR), v1::TimeBlending::LINEAR);
}

TEST_F(RegisterFamilyTest, ARefinementKeepsWhyTheWorkerChoseATimeBlending) {
  PublishSplash();
  store::pb::FamilyRecord family = *catalog_->GetFamily("splash");
  family.mutable_manifest()->set_time_blending_reason("b: nothing falls");
  v1::RegisterFamilyRequest request;
  request.set_family_id("splash");
  request.set_refine(true);
  ASSERT_THAT(RegisterFamily(backends_, request), Succeeds());
  ASSERT_THAT(catalog_->PublishFamily(TakeJob().lease_id, family), Succeeds());
  v1::GetFamilyRequest get;
  get.set_name("families/splash");
  EXPECT_EQ(GetFamily(backends_, get)->time_blending().reason(), "b: nothing falls");
  const auto reason_of_job = [&] {
    EXPECT_THAT(RegisterFamily(backends_, request), Succeeds());
    const auto leased = TakeJob();
    EXPECT_THAT(catalog_->PublishFamily(leased.lease_id, family), Succeeds());
    return leased.job.register_family().time_blending_reason();
  };
  EXPECT_EQ(reason_of_job(), "b: nothing falls");
  request.mutable_time_blending()->set_reason("so the client says");
  EXPECT_EQ(reason_of_job(), "b: nothing falls");
  request.mutable_time_blending()->set_kind(v1::TimeBlending::LINEAR);
  EXPECT_EQ(reason_of_job(), "");
}

TEST_F(RegisterFamilyTest, ATimeBlendingThatCannotBeMeantIsNamed) {
  const auto refused = [&](int kind, double rest_time_s) {
    return Register([&](auto& r) {
      r.mutable_time_blending()->set_kind(static_cast<v1::TimeBlending::Kind>(kind));
      r.mutable_time_blending()->set_rest_time_s(rest_time_s);
    });
  };
  constexpr auto kCode = absl::StatusCode::kInvalidArgument;
  EXPECT_THAT(refused(7, 0), Fails(kCode, "time_blending.kind: must be unspecified, LINEAR, "));
  for (const double rest_time_s : {0.1, -3601.0, std::nan("")}) {
    EXPECT_THAT(refused(v1::TimeBlending::SQUARES, rest_time_s),
                Fails(kCode, "time_blending.rest_time_s: must be in [-3600, 0], got "));
  }
  for (const auto kind : {v1::TimeBlending::LINEAR, v1::TimeBlending::AUTOMATIC}) {
    EXPECT_THAT(refused(kind, -1),
                Fails(kCode, "time_blending.rest_time_s: is for SQUARES only, got -1"));
  }
  PublishSplash();
  v1::RegisterFamilyRequest refinement;
  refinement.set_family_id("splash");
  refinement.set_refine(true);
  refinement.mutable_time_blending()->set_rest_time_s(-1);
  EXPECT_THAT(RegisterFamily(backends_, refinement),
              Fails(kCode, "time_blending.rest_time_s: is for SQUARES only, got -1"));
}

TEST_F(RegisterFamilyTest, ARefinementOfOtherAnimationsOrOfNothingIsRefused) {
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

TEST_F(RegisterFamilyTest, APriorityOutOfRangeIsNamed) {
  for (const int priority : {-101, 101}) {
    EXPECT_THAT(Register([&](auto& request) { request.set_priority(priority); }),
                Fails(absl::StatusCode::kInvalidArgument,
                      absl::StrCat("priority: must be in [-100, 100], got ", priority)));
  }
}

TEST_F(RegisterFamilyTest, ARegistrationKnowsWhoseItIsAndHowUrgent) {
  ImportAnimation("a");
  ImportAnimation("b");
  v1::RegisterFamilyRequest request = Registration();
  request.set_priority(-7);
  Caller caller;
  caller.principal.name = "studio";
  const auto operation = RegisterFamily(backends_, request, caller);
  ASSERT_THAT(operation, Succeeds());
  const store::pb::JobRecord job = catalog_->ListJobs(1, "")->records[0];
  EXPECT_EQ(job.owner(), "studio");
  EXPECT_EQ(job.priority(), -7);
  v1::RegisterFamilyMetadata metadata;
  EXPECT_TRUE(operation->metadata().UnpackTo(&metadata));
  EXPECT_EQ(metadata.progress().priority(), -7);
}

TEST_F(RegisterFamilyTest, ARegistrationAndItsChildrenGoOnWithTheTraceOfTheCall) {
  for (const char* id : {"a", "b", "c"}) ImportAnimation(id);
  v1::RegisterFamilyRequest request = Registration();
  request.add_targets("animations/c");
  Caller caller;
  const std::string traceparent = "00-4bf92f3577b34da6a3ce929d0e0e4736-00f067aa0ba902b7-01";
  caller.span = trace::Span(trace::ParseContext(traceparent, "vendor=1"));
  const auto operation = RegisterFamily(backends_, request, caller);
  ASSERT_THAT(operation, Succeeds());
  const store::pb::JobRecord job = catalog_->ListJobs(1, "")->records[0];
  const auto children = catalog_->ListChildren(job.id());
  ASSERT_THAT(children, Succeeds());
  ASSERT_EQ(children->size(), 2U);
  for (const store::pb::JobRecord& one : {job, children->front(), children->back()}) {
    EXPECT_EQ(one.traceparent(), traceparent);
    EXPECT_EQ(one.tracestate(), "vendor=1");
  }
  v1::RegisterFamilyMetadata metadata;
  EXPECT_TRUE(operation->metadata().UnpackTo(&metadata));
  EXPECT_EQ(metadata.progress().trace_id(), "4bf92f3577b34da6a3ce929d0e0e4736");
}

TEST_F(RegisterFamilyTest, ARepeatedRequestIdGivesTheFirstOperation) {
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

TEST_F(RegisterFamilyTest, ANameThatIsTakenIsRefusedUnlessItIsToBeReplaced) {
  PublishSplash();
  v1::RegisterFamilyRequest request = Registration();
  request.set_family_id("splash");
  const absl::Status refused = RegisterFamily(backends_, request).status();
  EXPECT_EQ(refused.code(), absl::StatusCode::kAlreadyExists);
  EXPECT_THAT(std::string(refused.message()),
              testing::HasSubstr("family 'splash' exists already, in version 1"));
  EXPECT_THAT(std::string(refused.message()), testing::HasSubstr("--replace"));
  EXPECT_EQ(ReasonOf(refused), "FAMILY_EXISTS");
  request.set_replace(true);
  EXPECT_THAT(RegisterFamily(backends_, request), Succeeds());
}

TEST_F(RegisterFamilyTest, ARegistrationCountsAgainstItsOwnersLimits) {
  PublishSplash();
  Caller ann;
  ann.principal.name = ann.principal.key = "ann";
  ann.principal.limits.max_queued_jobs = 1;
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
  ann.principal.limits.max_stored_bytes = 1000;
  EXPECT_EQ(ReasonOf(RegisterFamily(backends_, request, ann).status()), "STORED_BYTES_EXCEEDED");
  ASSERT_THAT(catalog_->DeleteFamily("one"), Succeeds());
  EXPECT_THAT(RegisterFamily(backends_, request, ann), Succeeds());
}

}  // namespace
}  // namespace liquidblend::server
