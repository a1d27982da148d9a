// The deformation model: affine maps at nodes, blended over the surface (paper, section 5.1).
// Internal to worker/registration.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <memory>
#include <random>
#include <span>
#include <vector>

#include "worker/registration/cell_graph.h"

namespace liquidblend::registration {

// [X | b] of one node, X = A - I: a point p of the rest surface moves by X (p - n) + b.
using NodeMap = Eigen::Matrix<float, 4, 5>;

struct Influence {
  int32_t node;
  float weight;
};

// Nodes and how strongly each moves each vertex.
class DeformationNodes {
 public:
  // Places nodes no closer than `spacing` to each other (geodesic Poisson disk), at the vertices of
  // `first` before others, none at an excluded vertex; every other is within `spacing` of a node. A
  // node reaches 2 * spacing; its weight is (1 - d^2 / r^2)^3 of the geodesic distance d,
  // normalised over the nodes. Threads: same bytes for any thread count and a given seed.
  DeformationNodes(const Points& rest, const IndexLists& neighbors, double spacing,
                   std::span<const int32_t> first, uint64_t seed, const parallel::Arena& arena,
                   std::vector<char> excluded = {});

  int64_t num_nodes() const { return static_cast<int64_t>(vertex_.size()); }
  int32_t vertex(int64_t node) const { return vertex_[node]; }
  // Position at rest.
  Eigen::Vector4f position(int64_t node) const { return position_.col(node); }
  // The nodes that move vertex v, by index; their weights add up to 1. None: an excluded vertex
  // that is not connected to others.
  std::span<const Influence> influences(int64_t v) const {
    return {influences_.get() + begin_[v], static_cast<size_t>(begin_[v + 1] - begin_[v])};
  }

 private:
  void PlaceNodes(const Points& rest, const IndexLists& neighbors, float spacing,
                  std::span<const int32_t> first, std::vector<char> covered, uint64_t seed);
  void ComputeInfluences(const Points& rest, const IndexLists& neighbors, float radius,
                         const parallel::Arena& arena);

  std::vector<int32_t> vertex_;  // per node
  Eigen::Matrix4Xf position_;    // per node
  std::vector<int64_t> begin_;   // num_vertices + 1
  std::unique_ptr<Influence[]> influences_;
};

// Displacement of vertex v (equation 1, from the rest pose).
Eigen::Vector4f DisplacementOf(const DeformationNodes& nodes, const std::vector<NodeMap>& maps,
                               const Points& rest, int64_t v);

// All deformed vertices.
Points Deform(const DeformationNodes& nodes, const std::vector<NodeMap>& maps, const Points& rest,
              const parallel::Arena& arena);

// The random numbers of one purpose; the same on any platform.
class Random {
 public:
  explicit Random(uint64_t seed) : engine_(seed) {}
  // Uniform in [0, bound). Requires: bound > 0.
  int64_t Below(int64_t bound) {
    return static_cast<int64_t>(engine_() % static_cast<uint64_t>(bound));
  }

 private:
  std::mt19937_64 engine_;
};

}  // namespace liquidblend::registration
