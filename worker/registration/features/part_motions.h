// Motions of detached parts that both animations have. They give the counterparts of such a part's
// vertices. Closest points would slide along the path of a falling drop, and late in a long fall
// they would find a drop that strikes already. Internal to worker/registration.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "core/mesh/registered_family.h"
#include "worker/registration/features/pair_features.h"
#include "worker/registration/surface/correspondence.h"

namespace liquidblend::registration {

// Motion of a part in both animations, from its start to its merge with the rest. Registration
// units.
struct PartMotion {
  Track source, target;
  // The time map is linear: target time = source time * time_scale + time_offset.
  double time_scale = 1.0;
  double time_offset = 0.0;
  double scale = 1.0;  // the target's diameter over the source's
  // The part is cut off in the source's pre-roll. Before it, time goes as fast in the target.
  bool begins_in_pre_roll = false;
  // The part is joined with the rest in the target's first frame. There it stays at one place, and
  // its life is mapped to half a frame. So the blend's part falls from between both heights, and
  // for the shorter the more the target weighs.
  bool ends_at_start = false;
};

// Acceleration of the part half-way where times blend linearly, over that in both animations: the
// positions are the means of p(t) and q(s t), the times those of t and s t, so that it is
// 2 (1 + s^2) / (1 + s)^2. 1 for a part that does not fall freely.
double AccelerationHalfWay(const PartMotion& motion, mesh::Up up);

enum class TimesBlend { kLinearly, kAsSquares };
inline TimesBlend TimesBlendOf(const mesh::RestReport& rest) {
  return rest.is_from_rest ? TimesBlend::kAsSquares : TimesBlend::kLinearly;
}

// A part of the source that is paired with one of the target.
struct DetachedPart {
  Track track;         // in the source
  double scale = 1.0;  // the target's diameter over the source's
};

// Expected position and normal of a vertex's counterpart in the target.
struct Expected {
  Eigen::Vector4f point, normal;
};

// Motion of a pair of tracks that both end by a merge and live for more than a frame; nothing for
// other pairs. It ends when the lowest points of both have come equally low, between two frames.
//   up  of both animations
std::optional<PartMotion> PartMotionOf(const Track& source, const Track& target,
                                       mesh::Up up = mesh::Up::kUnknown);

// Motion of a part from the first frame on that is joined with the rest in the target's first
// frame.
//   from, to  its lumps, in the source and in the target
std::optional<PartMotion> MotionToStart(const Track& source, const Lump& from, const Lump& to,
                                        mesh::Up up);

// Motion of a part of the source's pre-roll that is apart in the target from the first frame on, to
// its merge or to the last frame.
std::optional<PartMotion> MotionFromPreRoll(const Track& source, const Track& target, mesh::Up up);

// Motion of a part of the source's pre-roll that the target does not have: it stays before the
// first frame.
PartMotion MotionBeforeStart(const Track& source);

// Counterpart of a source point.
//   normal  unit length, of the source at `point`
Expected ExpectedOn(const PartMotion& motion, const Eigen::Vector4f& point,
                    const Eigen::Vector4f& normal);

// All motions of two animations, and the vertices that take part.  Threads: safe once it is made.
class PartMotions {
 public:
  PartMotions() = default;
  // Takes the pairs of tracks that users' points do not contradict, by sending a point of the part
  // elsewhere. Where times blend linearly, without those that would fall with over 1.1 times their
  // gravity half-way. Then the source's parts that are joined with the rest in the target, and
  // those of its pre-roll.
  PartMotions(const Features& source, const Features& target, const FeaturePairs& pairs,
              const std::vector<Correspondence>& users, double edge_length_m, TimesBlend times);

  const std::vector<PartMotion>& all() const { return motions_; }
  // Lives of the parts that are detached in the target's first frame, and in the source's or in its
  // pre-roll; also of those that have no motion because they would fall too fast. Not those of parts
  // that are joined with the rest in the target's: beyond weight 1 they end before the first frame.
  const std::vector<mesh::PartLife>& lives() const { return lives_; }
  // Parts of paired tracks that users' points do not contradict; also those without a motion.
  const std::vector<DetachedPart>& parts() const { return parts_; }
  int PartOf(int64_t source_vertex) const;  // index into parts(); -1: of none
  // The motion of a source vertex; null: it has none.
  const PartMotion* Of(int64_t source_vertex) const;
  bool HasTarget(int64_t target_vertex) const;

 private:
  std::vector<PartMotion> motions_;
  std::vector<mesh::PartLife> lives_;
  std::vector<DetachedPart> parts_;
  // Per vertex, the index into motions_; -1: none. Empty if there are no motions.
  std::vector<int8_t> of_source_, of_target_;
  std::vector<int8_t> part_of_;  // likewise, into parts_
};

}  // namespace liquidblend::registration
