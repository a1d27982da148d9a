#include "tests/client/canned_answers.h"

#include "absl/status/status.h"
#include "absl/strings/match.h"
#include "tests/client/fake_server.h"

namespace liquidblend::testing {

namespace lro = google::longrunning;

v1::Animation MakeAnimation(const std::string& id) {
  v1::Animation animation;
  animation.set_name("animations/" + id);
  animation.set_state(v1::Animation::READY);
  animation.set_num_frames(25);
  animation.set_first_frame_number(1);
  animation.set_frames_per_second(kCannedFramesPerSecond);
  animation.set_num_triangles(200);
  animation.set_num_vertices(150);
  animation.add_notes("removed 3 zero-area triangles in frame 7");
  return animation;
}

namespace {

v1::FailedRegistration MakeFailedRegistration() {
  v1::FailedRegistration failed;
  failed.set_operation("operations/register-0");
  failed.mutable_error()->set_code(static_cast<int>(absl::StatusCode::kInvalidArgument));
  failed.mutable_error()->set_message("the frame rates differ");
  failed.mutable_end_time()->set_seconds(1'709'251'200);  // 2024-03-01
  return failed;
}

v1::FamilyVersion MakeKeptVersion() {
  v1::FamilyVersion kept;
  kept.set_version(2);
  kept.set_source("animations/drops-a");
  kept.add_targets("animations/drops-c");
  kept.mutable_publish_time()->set_seconds(1'709'251'200);  // 2024-03-01
  return kept;
}

v1::CorrespondenceReport MakeOverruled() {
  v1::CorrespondenceReport correspondence;
  correspondence.mutable_correspondence()->set_kind(v1::Correspondence::TRAJECTORY);
  correspondence.mutable_correspondence()->mutable_source()->set_time_s(0.5);
  correspondence.set_outcome(v1::CorrespondenceReport::OVERRULED);
  correspondence.set_residual_m(0.25);
  correspondence.set_residual_frames(1.5);
  correspondence.set_num_nodes(4);
  return correspondence;
}

v1::CorrespondenceReport MakeAutomatic() {
  v1::CorrespondenceReport automatic;
  automatic.mutable_correspondence()->set_kind(v1::Correspondence::POINT);
  automatic.mutable_correspondence()->mutable_target()->mutable_position()->set_z(0.1);
  automatic.set_outcome(v1::CorrespondenceReport::KEPT);
  automatic.set_num_nodes(1);
  automatic.set_automatic(true);
  automatic.set_confidence(0.75);
  return automatic;
}

v1::Verdict MakeVerdict() {
  v1::Verdict verdict;
  verdict.set_grade(v1::Verdict::DOUBTFUL);
  verdict.set_reason("7 % of the target is not covered by the source");
  verdict.mutable_worst()->mutable_position()->set_z(1.25);
  verdict.mutable_worst()->set_time_s(0.5);
  verdict.add_residual_histogram(0.75);
  verdict.set_compatible_share(0.99);
  verdict.set_covered_share(0.93);
  verdict.set_unmatched_share(0.2);
  verdict.set_component_error(0.5);
  verdict.set_relief_loss(0.25);
  verdict.set_part_shift(0.125);
  verdict.set_part_volume_error(0.02);
  verdict.set_part_fall_error(0.06);
  verdict.set_stretch(0.11);
  verdict.set_inverted_share(0.001);
  for (const double error : {0.01, -0.02}) verdict.add_volume_errors(error);
  return verdict;
}

v1::RegistrationReport MakeReport() {
  v1::RegistrationReport report;
  report.set_target("animations/drops-b");
  report.set_num_iterations(16);
  *report.add_correspondences() = MakeOverruled();
  *report.add_correspondences() = MakeAutomatic();
  *report.mutable_verdict() = MakeVerdict();
  v1::Hypothesis& kept = *report.add_hypotheses();
  kept.set_pairing("the pairs of features of least cost");
  kept.set_cost(0.75);
  kept.set_is_kept(true);
  v1::Hypothesis& other = *report.add_hypotheses();
  other.set_pairing("no pairs of features");
  other.set_cost(3.5);
  return report;
}

v1::SpaceTimeReport MakeSpaceTimeReport(const std::string& animation) {
  v1::SpaceTimeReport built;
  built.set_animation(animation);
  built.set_connectivity(v1::REBUILT);
  built.set_grid_spacing_m(0.018);
  built.set_grid_spacing_edges(0.9);
  built.set_num_vertices(4321);
  built.set_num_hexahedra(4000);
  built.set_num_wedges(60);
  built.set_num_droplets(3);
  built.set_num_rigid_pieces(42);
  built.set_thin_share(0.125);
  built.mutable_fidelity()->set_num_frames(16);
  built.mutable_fidelity()->set_mean_distance_edges(0.025);
  built.mutable_fidelity()->set_max_distance_edges(0.5);
  built.mutable_fidelity()->set_max_volume_error(0.0015);
  built.mutable_fidelity()->set_num_components(47);
  built.mutable_fidelity()->set_num_components_shown(48);
  built.mutable_fidelity()->set_max_component_error(1);
  return built;
}

}  // namespace

v1::Family MakeFamily(const std::string& id) {
  v1::Family family;
  family.set_name("families/" + id);
  family.set_source("animations/drops-a");
  family.add_targets("animations/drops-b");
  if (id == "empty") {
    *family.mutable_failed_registration() = MakeFailedRegistration();
    return family;
  }
  family.set_version(3);
  *family.add_kept_versions() = MakeKeptVersion();
  family.set_duration_s(kCannedDuration);
  family.set_frames_per_second(kCannedFramesPerSecond);
  family.set_up(v1::UP_MINUS_Y);
  for (const auto set : {&v1::Vector3::set_x, &v1::Vector3::set_y, &v1::Vector3::set_z}) {
    (family.mutable_bounds()->mutable_min()->*set)(-2.0);
    (family.mutable_bounds()->mutable_max()->*set)(3.0);
  }
  family.mutable_parameter_space()->add_names("height");
  for (const double height : {1.0, 3.0}) {
    family.mutable_parameter_space()->add_points()->add_values(height);
  }
  family.mutable_parameter_space()->set_interpolation(v1::ParameterSpace::SMOOTH);
  family.mutable_time_blending()->set_kind(v1::TimeBlending::SQUARES);
  family.mutable_time_blending()->set_rest_time_s(-0.5);
  family.mutable_time_blending()->set_reason("both fall");
  *family.add_reports() = MakeReport();
  for (const char* animation : {"animations/drops-a", "animations/drops-b"}) {
    *family.add_space_time_reports() = MakeSpaceTimeReport(animation);
  }
  return family;
}

namespace {

v1::Progress MakeProgress(const std::string& stage, double fraction, int iteration) {
  v1::Progress progress;
  progress.set_stage(stage);
  progress.set_fraction(fraction);
  progress.set_iteration(iteration);
  progress.set_num_iterations(iteration > 0 ? 16 : 0);
  progress.set_fit_energy(0.5);
  progress.set_num_inliers(90);
  progress.set_num_samples(100);
  progress.set_seconds_left(65);
  progress.set_attempt(1);
  return progress;
}

// Queued again after two attempts.
v1::Progress MakeRetried() {
  v1::Progress progress;
  progress.set_stage("queued");
  progress.set_attempt(2);
  progress.set_priority(5);
  progress.set_memory_bytes(7);
  progress.set_handed_back(3);
  progress.mutable_next_attempt_time()->set_seconds(1700000000);
  progress.mutable_last_failure()->set_code(14);
  progress.mutable_last_failure()->set_message("no S3");
  return progress;
}

}  // namespace

lro::Operation MakeOperation(const std::string& id) {
  lro::Operation operation;
  operation.set_name("operations/" + id);
  if (absl::StartsWith(id, "import")) {
    v1::ImportAnimationMetadata metadata;
    metadata.set_animation("animations/drops-a");
    *metadata.mutable_progress() = MakeProgress("reading frames", 0.5, 0);
    operation.mutable_metadata()->PackFrom(metadata);
  } else {
    v1::RegisterFamilyMetadata metadata;
    metadata.set_family("families/drops");
    *metadata.mutable_progress() =
        id == "retried-1" ? MakeRetried() : MakeProgress("registration", 0.4, 7);
    operation.mutable_metadata()->PackFrom(metadata);
  }
  return operation;
}

namespace {

void SetError(lro::Operation* operation, absl::StatusCode code, const char* message) {
  operation->mutable_error()->set_code(static_cast<int>(code));
  operation->mutable_error()->set_message(message);
}

}  // namespace

lro::Operation MakeFinished(const std::string& id) {
  lro::Operation operation = MakeOperation(id);
  operation.set_done(true);
  v1::RegisterFamilyMetadata metadata;
  if (operation.metadata().UnpackTo(&metadata)) {
    v1::Progress& progress = *metadata.mutable_progress();
    progress.set_worker("mill:7");
    progress.mutable_start_time()->set_seconds(1'709'251'200);  // 2024-03-01
    progress.mutable_end_time()->set_seconds(1'709'251'290);
    if (id == "register-1") metadata.set_version(3);
    if (id == "register-1") metadata.set_grade(v1::Verdict::DOUBTFUL);
    operation.mutable_metadata()->PackFrom(metadata);
  }
  if (id == "failed-1") {
    SetError(&operation, absl::StatusCode::kDataLoss, "frame 12: edge 5-9 has one triangle");
  } else if (id == "cancelled-1") {
    SetError(&operation, absl::StatusCode::kCancelled, "cancelled by a user");
  } else if (absl::StartsWith(id, "import")) {
    operation.mutable_response()->PackFrom(MakeAnimation("drops-a"));
  } else {
    operation.mutable_response()->PackFrom(MakeFamily("drops"));
  }
  return operation;
}

v1::Frame MakeFrame(const std::string& family, const std::vector<double>& weights, double time_s,
                    int bits) {
  v1::Frame frame;
  const double weight = weights.empty() ? 0.0 : weights[0];
  frame.set_data(EncodeDraco(MakeOctahedron(weight, time_s), bits == 0 ? 14 : bits));
  frame.set_family(family);
  frame.set_version(3);
  frame.mutable_weights()->Assign(weights.begin(), weights.end());
  frame.set_time_s(time_s);
  frame.set_num_vertices(6);
  frame.set_num_triangles(8);
  return frame;
}

}  // namespace liquidblend::testing
