#include "core/store/files/parameter_records.h"

namespace liquidblend::store {

v1::ParameterSpace ToMessage(const mesh::ParameterSpace& space) {
  v1::ParameterSpace message;
  message.mutable_names()->Assign(space.names.begin(), space.names.end());
  for (const std::vector<double>& point : space.points) {
    message.add_points()->mutable_values()->Assign(point.begin(), point.end());
  }
  return message;
}

mesh::ParameterSpace FromMessage(const v1::ParameterSpace& message) {
  mesh::ParameterSpace space;
  space.names.assign(message.names().begin(), message.names().end());
  for (const v1::ParameterPoint& point : message.points()) {
    space.points.emplace_back(point.values().begin(), point.values().end());
  }
  return space;
}

}  // namespace liquidblend::store
