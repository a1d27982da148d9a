// Connected components of a triangle surface: centre, volume, area.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "core/mesh/triangle_mesh.h"

namespace liquidblend::mesh {

// A connected component: triangles that share vertices, unless a comment defines another
// connection. In the units of the surface's vertices.
struct Component {
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();  // of its surface
  double volume = 0.0;                               // signed: of a bubble below 0
  double area = 0.0;
};

// Sums up components from flat pieces of surface.
class ComponentSums {
 public:
  //   centre, area  of the piece; the latter along its outward normal
  // Adds a flat piece of surface to the component of this number.
  void Add(size_t component, const Eigen::Vector3d& centre, const Eigen::Vector3d& area);
  // The components by number; all zero for one without pieces.
  std::vector<Component> Components() const;

 private:
  std::vector<Component> sums_;  // centres times areas
};

// Finds the components, in the order of their first triangles. Requires: indices in range.
std::vector<Component> FindComponents(const TriangleMesh& mesh);

}  // namespace liquidblend::mesh
