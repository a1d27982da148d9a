// Requests of the library as messages; convert.cc has the way back.
#include <google/protobuf/message.h>

#include <optional>
#include <string>
#include <vector>

#include "client/src/convert.h"
#include "client/src/names.h"

namespace liquidblend::client {
namespace {

void SetEvent(const Event& event, v1::Event* proto) {
  proto->mutable_position()->set_x(event.position.x);
  proto->mutable_position()->set_y(event.position.y);
  proto->mutable_position()->set_z(event.position.z);
  proto->set_time_s(event.time_s);
}

v1::Correspondence::Kind ToKind(CorrespondenceKind kind) {
  switch (kind) {
    case CorrespondenceKind::kPoint:
      return v1::Correspondence::POINT;
    case CorrespondenceKind::kTrajectory:
      return v1::Correspondence::TRAJECTORY;
    case CorrespondenceKind::kSpace:
      return v1::Correspondence::SPACE;
  }
  return v1::Correspondence::KIND_UNSPECIFIED;
}

v1::Connectivity ToConnectivity(Connectivity connectivity) {
  switch (connectivity) {
    case Connectivity::kAuto:
      return v1::CONNECTIVITY_UNSPECIFIED;
    case Connectivity::kTracked:
      return v1::TRACKED;
    case Connectivity::kRebuilt:
      return v1::REBUILT;
  }
  return v1::CONNECTIVITY_UNSPECIFIED;
}

// One field of a message that is still to be filled.
struct OptionField {
  v1::RegistrationOptions* message;
  const google::protobuf::FieldDescriptor* field;
  const google::protobuf::Reflection& reflection;

  void Set(int value) const { reflection.SetInt32(message, field, value); }
  void Set(uint64_t value) const { reflection.SetUInt64(message, field, value); }
  void Set(double value) const { reflection.SetDouble(message, field, value); }
  void Set(const std::optional<bool>& value) const {
    if (value) reflection.SetBool(message, field, *value);
  }
};

void SetOptions(const RegistrationOptions& options, v1::RegistrationOptions* proto) {
  RegistrationOptions::ForEach(options, [&](const char* name, const auto& option) {
    const auto* field = proto->GetDescriptor()->FindFieldByName(name);
    OptionField{proto, field, *proto->GetReflection()}.Set(option);
  });
}

void SetSpaceTime(const SpaceTimeOptions& options, v1::SpaceTimeOptions* proto) {
  proto->set_connectivity(ToConnectivity(options.connectivity));
  proto->set_spacing_edges(options.spacing_edges);
  if (options.droplet_vertices) proto->set_droplet_vertices(*options.droplet_vertices);
  if (options.sheet_thickness_edges) {
    proto->set_sheet_thickness_edges(*options.sheet_thickness_edges);
  }
  if (options.coarser_levels) proto->set_coarser_levels(*options.coarser_levels);
  if (options.keep_thin_sheets) proto->set_keep_thin_sheets(*options.keep_thin_sheets);
}

void SetCorrespondence(const Correspondence& correspondence, v1::Correspondence* proto) {
  proto->set_kind(ToKind(correspondence.kind));
  proto->set_hard(correspondence.hard);
  SetEvent(correspondence.source, proto->mutable_source());
  SetEvent(correspondence.target, proto->mutable_target());
  proto->set_length_s(correspondence.length_s);
}

v1::AnimationFormat ToFormat(AnimationFormat format) {
  switch (format) {
    case AnimationFormat::kAny:
      return v1::ANIMATION_FORMAT_UNSPECIFIED;
    case AnimationFormat::kMantaflow:
      return v1::MANTAFLOW;
    case AnimationFormat::kPly:
      return v1::PLY;
    case AnimationFormat::kObj:
      return v1::OBJ;
    case AnimationFormat::kStl:
      return v1::STL;
    case AnimationFormat::kVdb:
      return v1::VDB;
  }
  return v1::ANIMATION_FORMAT_UNSPECIFIED;
}

void SetTimeBlending(const TimeBlending& blending, v1::TimeBlending* proto) {
  proto->set_kind(static_cast<v1::TimeBlending::Kind>(blending.kind));  // the same numbers
  proto->set_rest_time_s(blending.rest_time_s);
}

void SetParameterSpace(const ParameterSpace& space, v1::ParameterSpace* proto) {
  proto->mutable_names()->Assign(space.names.begin(), space.names.end());
  for (const std::vector<double>& point : space.points) {
    proto->add_points()->mutable_values()->Assign(point.begin(), point.end());
  }
  proto->set_interpolation(
      static_cast<v1::ParameterSpace::Interpolation>(space.interpolation));  // the same numbers
}

}  // namespace

v1::ImportOptions ToProto(const ImportOptions& options) {
  v1::ImportOptions proto;
  proto.set_format(ToFormat(options.format));
  proto.set_frames_per_second(options.frames_per_second);
  proto.set_vertex_scale(options.vertex_scale);
  proto.set_velocity_scale(options.velocity_scale);
  proto.set_voxel_size_m(options.voxel_size_m);
  proto.set_allow_gaps(options.allow_gaps);
  proto.set_up(static_cast<v1::Up>(options.up));
  proto.mutable_frame_times()->Assign(options.frame_times.begin(), options.frame_times.end());
  proto.set_pattern(options.pattern);
  return proto;
}

v1::RegisterFamilyRequest ToProto(const RegisterRequest& request) {
  v1::RegisterFamilyRequest proto;
  proto.set_family_id(ResourceId("families", request.family));
  if (!request.source.empty()) proto.set_source(ResourceName("animations", request.source));
  for (const std::string& target : request.targets) {
    proto.add_targets(ResourceName("animations", target));
  }
  SetOptions(request.options, proto.mutable_options());
  SetSpaceTime(request.space_time, proto.mutable_space_time());
  proto.set_replace(request.replace);
  proto.set_refine(request.refine);
  proto.set_required_grade(
      static_cast<v1::Verdict::Grade>(request.required_grade));  // same numbers
  proto.set_priority(request.priority);
  const ParameterSpace& space = request.parameter_space;
  if (!space.names.empty() || !space.points.empty() ||
      space.interpolation != Interpolation::kUnspecified) {
    SetParameterSpace(space, proto.mutable_parameter_space());
  }
  const TimeBlending& times = request.time_blending;
  if (times.kind != TimeBlending::Kind::kUnspecified || times.rest_time_s != 0) {
    SetTimeBlending(times, proto.mutable_time_blending());
  }
  for (const std::vector<Correspondence>& of_target : request.correspondences) {
    auto* list = proto.add_correspondences();
    for (const Correspondence& correspondence : of_target) {
      SetCorrespondence(correspondence, list->add_correspondences());
    }
  }
  return proto;
}

}  // namespace liquidblend::client
