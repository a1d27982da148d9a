// The deformation model: affine maps at nodes, blended over the surface (paper, section 5.1).
// Internal to worker/registration.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <memory>
#include <random>
#include <span>
#include <vector>

#include "worker/registration/surface/cell_graph.h"

namespace liquidblend::registration {

// [X | b] of one node, X = A - I: a point p of the rest surface moves by X (p - n) + b.
using NodeMap = Eigen::Matrix<float, 4, 5>;

struct Influence {
  int32_t node;
  float weight;
};

// The influences on one vertex, unpacked one by one.
class Influences {
 public:
  // Packed form of half the size of an Influence, as there are some twenty for each vertex.
  struct Packed {
    uint16_t low_node;
    uint16_t weight;  // times kOne
  };
  static constexpr uint16_t kOne = 65535;

  class Iterator {
   public:
    Iterator(const Packed* at, const uint16_t* high_node) : at_(at), high_node_(high_node) {}
    Influence operator*() const {
      const uint32_t high = high_node_ == nullptr ? 0U : *high_node_;
      return {static_cast<int32_t>(high << 16 | at_->low_node),
              static_cast<float>(at_->weight) * (1.0F / kOne)};
    }
    Iterator& operator++() {
      ++at_;
      if (high_node_ != nullptr) ++high_node_;
      return *this;
    }
    bool operator==(const Iterator& other) const { return at_ == other.at_; }

   private:
    const Packed* at_;
    const uint16_t* high_node_;
  };

  // high_nodes: the nodes' upper 16 bits, or nullptr if they are 0.
  Influences(std::span<const Packed> packed, const uint16_t* high_nodes)
      : packed_(packed), high_nodes_(high_nodes) {}
  Iterator begin() const { return {packed_.data(), high_nodes_}; }
  Iterator end() const { return {packed_.data() + packed_.size(), nullptr}; }
  size_t size() const { return packed_.size(); }

 private:
  std::span<const Packed> packed_;
  const uint16_t* high_nodes_;
};

// Deformation nodes, and their weights at each vertex.
class DeformationNodes {
 public:
  // Places nodes no closer than `spacing` to each other (geodesic Poisson disk), at the vertices of
  // `first` before others, none at an excluded vertex; every other vertex is within `spacing` of a
  // node. A node reaches 2 * spacing; its weight is (1 - d^2 / r^2)^3 of the geodesic distance d,
  // normalised over the nodes. Threads: same bytes for any thread count and a given seed.
  DeformationNodes(const Points& rest, const PackedLists& neighbors, double spacing,
                   std::span<const int32_t> first, uint64_t seed, const parallel::Arena& arena,
                   std::vector<char> excluded = {});

  int64_t num_nodes() const { return static_cast<int64_t>(vertex_.size()); }
  int32_t vertex(int64_t node) const { return vertex_[node]; }
  // Position at rest.
  Eigen::Vector4f position(int64_t node) const { return position_.col(node); }
  // The nodes that move vertex v, by index; their weights add up to 1. Empty for an excluded vertex
  // that is not connected to others.
  Influences influences(int64_t v) const {
    const auto count = static_cast<size_t>(begin_[v + 1] - begin_[v]);
    const uint16_t* high_nodes = high_nodes_ == nullptr ? nullptr : high_nodes_.get() + begin_[v];
    return {{influences_.get() + begin_[v], count}, high_nodes};
  }

 private:
  void PlaceNodes(const Points& rest, const PackedLists& neighbors, float spacing,
                  std::span<const int32_t> first, std::vector<char> covered, uint64_t seed,
                  const parallel::Arena& arena);
  void ComputeInfluences(const Points& rest, const PackedLists& neighbors, float radius,
                         const parallel::Arena& arena);
  void Normalize(int64_t begin, int64_t end);

  std::vector<int32_t> vertex_;  // per node
  Eigen::Matrix4Xf position_;    // per node
  std::vector<int64_t> begin_;   // num_vertices + 1
  std::unique_ptr<Influences::Packed[]> influences_;
  std::unique_ptr<uint16_t[]> high_nodes_;  // only if 16 bits do not suffice for the nodes
};

// Displacement of vertex v (equation 1, from the rest pose).
Eigen::Vector4f DisplacementOf(const DeformationNodes& nodes, const std::vector<NodeMap>& maps,
                               const Points& rest, int64_t v);

// All deformed vertices.
Points Deform(const DeformationNodes& nodes, const std::vector<NodeMap>& maps, const Points& rest,
              const parallel::Arena& arena);

// A generator of random numbers; the same numbers on any platform.
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
