#include "core/store/files/parameter_records.h"

namespace liquidblend::store {

v1::ParameterSpace ToMessage(const mesh::ParameterSpace& space) {
  v1::ParameterSpace message;
  message.mutable_names()->Assign(space.names.begin(), space.names.end());
  for (const std::vector<double>& point : space.points) {
    message.add_points()->mutable_values()->Assign(point.begin(), point.end());
  }
  if (space.interpolation != mesh::Interpolation::kLinear) {
    message.set_interpolation(static_cast<v1::ParameterSpace::Interpolation>(space.interpolation));
  }
  return message;
}

mesh::ParameterSpace FromMessage(const v1::ParameterSpace& message) {
  mesh::ParameterSpace space;
  space.names.assign(message.names().begin(), message.names().end());
  for (const v1::ParameterPoint& point : message.points()) {
    space.points.emplace_back(point.values().begin(), point.values().end());
  }
  if (message.interpolation() != v1::ParameterSpace::INTERPOLATION_UNSPECIFIED) {
    space.interpolation = static_cast<mesh::Interpolation>(message.interpolation());
  }
  return space;
}

}  // namespace liquidblend::store
