// Edges of the container, where its walls and its floor meet. The liquid's surface stays in its
// place there and bends outward. Closest points slide along walls: what is carried far would drag
// the edges along, and half-way the container's corners would be cut off. Internal to
// worker/registration.
#pragma once

#include <vector>

#include "worker/registration/features/contacts.h"
#include "worker/registration/surface/correspondence.h"
#include "worker/registration/surface/surface.h"

namespace liquidblend::registration {

struct ContainerEdgeOptions {
  ContactOptions contacts = {};
  float same_place = 1.5f;   // > 0; edges; between contacts of an edge that both animations have
  float same_way = 0.7f;     // [-1, 1]; cosine between the normals of one wall in both
  float near_users = 10.0f;  // >= 0; edges; so near to a user's correspondence nothing is held
};

// Finds the source's vertices at edges of the container that the target has at the same place, each
// with the projection on the normals of the walls that meet there in both animations. They are to
// be held in these directions: along an edge they may slide. Vertices near a user's correspondence
// are left out.
//   edge_length_m  > 0; unit of length of both surfaces
// Cost: O(vertices log vertices), some 900 look-ups per contact.
HeldVertices FindContainerEdges(const Surface& source, const Surface& target,
                                const std::vector<Correspondence>& users, double edge_length_m,
                                const ContainerEdgeOptions& options = {});

}  // namespace liquidblend::registration
