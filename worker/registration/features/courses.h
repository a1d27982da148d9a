// The courses of parts that both animations have: while such a part is detached, only itself and
// its own pace in time say what belongs to what. Closest points slide along a falling drop's course
// as they like, and late in a long fall they would find a drop that strikes already. Internal to
// worker/registration.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "worker/registration/features/pair_features.h"
#include "worker/registration/surface/correspondence.h"

namespace liquidblend::registration {

// A part from where it starts to where it meets the rest, in both animations. Registration units.
struct Course {
  Track source, target;
  // Both lives go by at a steady pace: target time = source time * pace + lead.
  double pace = 1.0;
  double lead = 0.0;
  double scale = 1.0;  // the target's diameter over the source's
};

// Where to look for what belongs to a vertex, and the normal that it would have there.
struct Expected {
  Eigen::Vector4f point, normal;
};

// Of a pair of tracks that both end by a merge and live for more than a frame; they end when their
// lowest points have come equally low, between two frames. Nothing if one ends otherwise.
//   up  of both
std::optional<Course> CourseOf(const Track& source, const Track& target,
                               mesh::Up up = mesh::Up::kUnknown);

//   normal  unit length, of the source at `point`
Expected ExpectedOn(const Course& course, const Eigen::Vector4f& point,
                    const Eigen::Vector4f& normal);

// Threads: safe once it is made.
class Courses {
 public:
  Courses() = default;
  // Of those pairs of tracks that users' points do not contradict: a user who sends a point of the
  // part elsewhere knows better.
  Courses(const Features& source, const Features& target, const std::vector<AssignedPair>& tracks,
          const std::vector<Correspondence>& users, double edge_length_m);

  const std::vector<Course>& courses() const { return courses_; }
  // The course of a source vertex; null: it has none.
  const Course* Of(int64_t source_vertex) const;
  bool HasTarget(int64_t target_vertex) const;

 private:
  std::vector<Course> courses_;
  // Per vertex its number among them, -1: none; empty without courses.
  std::vector<int8_t> of_source_, of_target_;
};

}  // namespace liquidblend::registration
