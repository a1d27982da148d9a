#include "core/store/files/correspondence_records.h"

#include <algorithm>

namespace liquidblend::store {
namespace {

using Event = google::protobuf::RepeatedField<double>;

v1::Correspondence::Kind ToRecord(mesh::CorrespondenceKind kind) {
  switch (kind) {
    case mesh::CorrespondenceKind::kPoint:
      return v1::Correspondence::POINT;
    case mesh::CorrespondenceKind::kTrajectory:
      return v1::Correspondence::TRAJECTORY;
    case mesh::CorrespondenceKind::kSpace:
      return v1::Correspondence::SPACE;
  }
  return v1::Correspondence::KIND_UNSPECIFIED;
}

mesh::CorrespondenceKind FromRecord(v1::Correspondence::Kind kind) {
  switch (kind) {
    case v1::Correspondence::TRAJECTORY:
      return mesh::CorrespondenceKind::kTrajectory;
    case v1::Correspondence::SPACE:
      return mesh::CorrespondenceKind::kSpace;
    default:
      return mesh::CorrespondenceKind::kPoint;
  }
}

void AddEvent(const Eigen::Vector4d& event, double frames_per_second, Event* to) {
  for (int axis = 0; axis < 3; ++axis) to->Add(event[axis]);
  to->Add(event[3] / frames_per_second);
}

Eigen::Vector4d ToEvent(const Event& event, double frames_per_second) {
  Eigen::Vector4d point = Eigen::Vector4d::Zero();
  std::copy_n(event.begin(), std::min(4, event.size()), point.data());
  point[3] *= frames_per_second;
  return point;
}

}  // namespace

v1::CorrespondenceReport ToRecord(const mesh::CorrespondenceReport& report,
                                  double frames_per_second) {
  v1::CorrespondenceReport record;
  v1::Correspondence& correspondence = *record.mutable_correspondence();
  correspondence.set_kind(ToRecord(report.correspondence.kind));
  correspondence.set_hard(report.correspondence.hard);
  AddEvent(report.correspondence.source, frames_per_second, correspondence.mutable_source());
  AddEvent(report.correspondence.target, frames_per_second, correspondence.mutable_target());
  correspondence.set_length_s(report.correspondence.length_frames / frames_per_second);
  record.set_num_nodes(report.num_nodes);
  record.set_residual_m(report.residual_m);
  record.set_residual_frames(report.residual_frames);
  record.set_overruled(!report.kept);
  record.set_automatic(report.automatic);
  if (report.automatic) record.set_confidence(report.confidence);
  return record;
}

mesh::CorrespondenceReport FromRecord(const v1::CorrespondenceReport& record,
                                      double frames_per_second) {
  mesh::CorrespondenceReport report;
  report.correspondence = FromRecord(record.correspondence(), frames_per_second);
  report.num_nodes = record.num_nodes();
  report.residual_m = record.residual_m();
  report.residual_frames = record.residual_frames();
  report.kept = !record.overruled();
  report.automatic = record.automatic();
  if (report.automatic) report.confidence = record.confidence();
  return report;
}

mesh::Correspondence FromRecord(const v1::Correspondence& record, double frames_per_second) {
  mesh::Correspondence result;
  result.kind = FromRecord(record.kind());
  result.hard = record.hard();
  result.source = ToEvent(record.source(), frames_per_second);
  result.target = ToEvent(record.target(), frames_per_second);
  result.length_frames = record.length_s() * frames_per_second;
  return result;
}

bool IsWhole(const v1::CorrespondenceReport& record) {
  return record.correspondence().source_size() == 4 && record.correspondence().target_size() == 4;
}

}  // namespace liquidblend::store
