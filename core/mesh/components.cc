#include "core/mesh/components.h"

#include <Eigen/Geometry>

namespace liquidblend::mesh {

void ComponentSums::Add(size_t component, const Eigen::Vector3d& centre,
                        const Eigen::Vector3d& area) {
  if (component >= sums_.size()) sums_.resize(component + 1);
  Component& sum = sums_[component];
  const double size = area.norm();
  sum.volume += area.dot(centre) / 3;
  sum.centre += size * centre;
  sum.area += size;
}

std::vector<Component> ComponentSums::Components() const {
  std::vector<Component> components = sums_;
  for (Component& component : components) {
    if (component.area > 0) component.centre /= component.area;
  }
  return components;
}

std::vector<Component> FindComponents(const TriangleMesh& mesh) {
  const std::vector<int32_t> root = ComponentRoots(mesh);
  std::vector<int32_t> number(root.size(), -1);
  int32_t count = 0;
  ComponentSums sums;
  for (Eigen::Index t = 0; t < mesh.triangles.cols(); ++t) {
    int32_t& component = number[root[mesh.triangles(0, t)]];
    if (component < 0) component = count++;
    const auto corner = [&](int k) -> Eigen::Vector3d {
      return mesh.vertices.col(mesh.triangles(k, t)).cast<double>();
    };
    const Eigen::Vector3d a = corner(0), b = corner(1), c = corner(2);
    sums.Add(static_cast<size_t>(component), (a + b + c) / 3, 0.5 * (b - a).cross(c - a));
  }
  return sums.Components();
}

}  // namespace liquidblend::mesh
