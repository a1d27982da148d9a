#include "core/store/files/report_messages.h"

#include <algorithm>

#include "core/store/files/correspondence_records.h"

namespace liquidblend::store {
namespace {

v1::Fidelity ToMessage(const mesh::Fidelity& fidelity) {
  v1::Fidelity message;
  message.set_num_frames(fidelity.num_frames);
  message.set_mean_distance_edges(fidelity.mean_distance_edges);
  message.set_max_distance_edges(fidelity.max_distance_edges);
  message.set_max_volume_error(fidelity.max_volume_error);
  message.set_num_components(fidelity.num_components);
  message.set_num_components_shown(fidelity.num_components_shown);
  message.set_max_component_error(fidelity.max_component_error);
  return message;
}

mesh::Fidelity FromMessage(const v1::Fidelity& message) {
  mesh::Fidelity fidelity;
  fidelity.num_frames = message.num_frames();
  fidelity.mean_distance_edges = message.mean_distance_edges();
  fidelity.max_distance_edges = message.max_distance_edges();
  fidelity.max_volume_error = message.max_volume_error();
  fidelity.num_components = message.num_components();
  fidelity.num_components_shown = message.num_components_shown();
  fidelity.max_component_error = message.max_component_error();
  return fidelity;
}

}  // namespace

v1::RegistrationReport ToMessage(const mesh::FamilyTarget& target, double frames_per_second) {
  v1::RegistrationReport message;
  message.set_target(target.name);
  message.set_num_nodes(target.report.num_nodes);
  message.set_num_iterations(target.report.num_iterations);
  message.set_mean_residual_edges(target.report.mean_residual_edges);
  message.set_inlier_share(target.report.inlier_share);
  message.set_seconds(target.report.seconds);
  for (const mesh::CorrespondenceReport& report : target.report.correspondences) {
    *message.add_correspondences() = ToRecord(report, frames_per_second);
  }
  if (target.report.verdict.grade != mesh::Grade::kUnknown) {
    *message.mutable_verdict() = ToMessage(target.report.verdict);
  }
  return message;
}

// Grades have the same numbers in all programs.
v1::Verdict ToMessage(const mesh::Verdict& verdict) {
  v1::Verdict message;
  message.set_grade(static_cast<v1::Grade>(verdict.grade));
  message.set_reason(verdict.reason);
  message.mutable_worst()->Add(verdict.worst.begin(), verdict.worst.end());
  message.set_fit_energy(verdict.fit_energy);
  message.set_smoothness_energy(verdict.smoothness_energy);
  message.mutable_residual_histogram()->Add(verdict.residual_histogram.begin(),
                                            verdict.residual_histogram.end());
  message.set_compatible_share(verdict.compatible_share);
  message.set_covered_share(verdict.covered_share);
  message.set_unmatched_share(verdict.unmatched_share);
  message.set_component_error(verdict.component_error);
  message.set_stretch(verdict.stretch);
  message.set_inverted_share(verdict.inverted_share);
  message.mutable_volume_errors()->Add(verdict.volume_errors.begin(), verdict.volume_errors.end());
  return message;
}

v1::SpaceTimeReport ToMessage(const mesh::SpaceTimeReport& report) {
  v1::SpaceTimeReport message;
  message.set_connectivity(report.is_tracked ? v1::TRACKED : v1::REBUILT);
  message.set_grid_spacing_m(report.grid_spacing_m);
  message.set_edge_length_m(report.edge_length_m);
  message.set_num_vertices(report.num_vertices);
  message.set_num_tetrahedra(report.num_tetrahedra);
  message.set_num_pyramids(report.num_pyramids);
  message.set_num_wedges(report.num_wedges);
  message.set_num_hexahedra(report.num_hexahedra);
  message.set_num_droplets(report.num_droplets);
  message.set_num_rigid_pieces(report.num_rigid_pieces);
  message.set_thin_share(report.thin_share);
  *message.mutable_fidelity() = ToMessage(report.fidelity);
  return message;
}

mesh::RegistrationReport FromMessage(const v1::RegistrationReport& message,
                                     double frames_per_second) {
  mesh::RegistrationReport report;
  report.num_nodes = message.num_nodes();
  report.num_iterations = message.num_iterations();
  report.mean_residual_edges = message.mean_residual_edges();
  report.inlier_share = message.inlier_share();
  report.seconds = message.seconds();
  for (const v1::CorrespondenceReport& correspondence : message.correspondences()) {
    report.correspondences.push_back(FromRecord(correspondence, frames_per_second));
  }
  report.verdict = FromMessage(message.verdict());
  return report;
}

mesh::Verdict FromMessage(const v1::Verdict& message) {
  mesh::Verdict verdict;
  if (v1::Grade_IsValid(message.grade())) verdict.grade = mesh::Grade{message.grade()};
  verdict.reason = message.reason();
  const auto copy = [](const auto& from, auto& to) {
    std::copy_n(from.begin(), std::min<size_t>(from.size(), to.size()), to.begin());
  };
  copy(message.worst(), verdict.worst);
  verdict.fit_energy = message.fit_energy();
  verdict.smoothness_energy = message.smoothness_energy();
  copy(message.residual_histogram(), verdict.residual_histogram);
  verdict.compatible_share = message.compatible_share();
  verdict.covered_share = message.covered_share();
  verdict.unmatched_share = message.unmatched_share();
  verdict.component_error = message.component_error();
  verdict.stretch = message.stretch();
  verdict.inverted_share = message.inverted_share();
  verdict.volume_errors.assign(message.volume_errors().begin(), message.volume_errors().end());
  return verdict;
}

mesh::SpaceTimeReport FromMessage(const v1::SpaceTimeReport& message) {
  mesh::SpaceTimeReport report;
  report.is_tracked = message.connectivity() == v1::TRACKED;
  report.grid_spacing_m = message.grid_spacing_m();
  report.edge_length_m = message.edge_length_m();
  report.num_vertices = message.num_vertices();
  report.num_tetrahedra = message.num_tetrahedra();
  report.num_pyramids = message.num_pyramids();
  report.num_wedges = message.num_wedges();
  report.num_hexahedra = message.num_hexahedra();
  report.num_droplets = message.num_droplets();
  report.num_rigid_pieces = message.num_rigid_pieces();
  report.thin_share = message.thin_share();
  report.fidelity = FromMessage(message.fidelity());
  return report;
}

}  // namespace liquidblend::store
