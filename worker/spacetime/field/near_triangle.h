// Closest points of a triangle to points of the grid. Internal to worker/spacetime.
#pragma once

#include <Eigen/Geometry>
#include <algorithm>
#include <limits>

namespace liquidblend::spacetime {

// Four numbers, in the registers of any machine.
using Four = float __attribute__((vector_size(16)));

// Offsets of four points from their closest points on a triangle.
struct FourOffsets {
  Four x, y, z, length_sq;
};

// A triangle with values that its distances to many points share.
class NearTriangle {
 public:
  explicit NearTriangle(const Eigen::Matrix3f& corners)
      : a_(corners.col(0)),
        ab_(corners.col(1) - corners.col(0)),
        ac_(corners.col(2) - corners.col(0)),
        ab_ab_(ab_.squaredNorm()),
        ab_ac_(ab_.dot(ac_)),
        ac_ac_(ac_.squaredNorm()),
        bc_bc_((ac_ - ab_).squaredNorm()),
        inverse_ab_(Inverse(ab_ab_)),
        inverse_ac_(Inverse(ac_ac_)),
        inverse_bc_(Inverse(bc_bc_)) {
    const float longest_sq = std::max({ab_ab_, ac_ac_, bc_bc_});
    const bool is_flat = ab_.cross(ac_).squaredNorm() <= kFlat * longest_sq * longest_sq;
    within_from_ = is_flat ? std::numeric_limits<float>::infinity() : 0.0f;
  }

  // Offsets of the points (x + n, y, z), n from 0 to 3, from the closest points of the sides, or of
  // the plane where these lie within the triangle (compare ClosestBarycentric), without branches.
  FourOffsets OffsetsOfRow(float x, float y, float z) const {
    const Four px = Four{0, 1, 2, 3} + (x - a_.x());
    const float py = y - a_.y(), pz = z - a_.z();
    const Four ab_ap = ab_.x() * px + (ab_.y() * py + ab_.z() * pz);
    const Four ac_ap = ac_.x() * px + (ac_.y() * py + ac_.z() * pz);
    const Four ab_bp = ab_ap - ab_ab_, ac_bp = ac_ap - ab_ac_;
    const Four ab_cp = ab_ap - ab_ac_, ac_cp = ac_ap - ac_ac_;
    // The closest point is a + v * ab + w * ac; `least` is its squared distance less that of a.
    const Four zero = {0, 0, 0, 0};
    Four v = Clamped(ab_ap * inverse_ab_), w = zero;
    Four least = v * (v * ab_ab_ - 2 * ab_ap);
    const auto take = [&](Four is_nearer_sq, Four is_v, Four is_w) {
      const auto is_nearer = is_nearer_sq < least;
      v = is_nearer ? is_v : v;
      w = is_nearer ? is_w : w;
      least = is_nearer ? is_nearer_sq : least;
    };
    const Four on_ac = Clamped(ac_ap * inverse_ac_);
    take(on_ac * (on_ac * ac_ac_ - 2 * ac_ap), zero, on_ac);
    const Four bc_bp = ac_bp - ab_bp, on_bc = Clamped(bc_bp * inverse_bc_);
    take(ab_ab_ - 2 * ab_ap + on_bc * (on_bc * bc_bc_ - 2 * bc_bp), 1 - on_bc, on_bc);
    const Four at_a = ab_bp * ac_cp - ab_cp * ac_bp, at_b = ab_cp * ac_ap - ab_ap * ac_cp;
    const Four at_c = ab_ap * ac_bp - ab_bp * ac_ap, inverse_sum = 1 / (at_a + at_b + at_c);
    const auto is_within = (at_a > within_from_) & (at_b > within_from_) & (at_c > within_from_);
    v = is_within ? at_b * inverse_sum : v;
    w = is_within ? at_c * inverse_sum : w;
    FourOffsets offsets;
    offsets.x = px - v * ab_.x() - w * ac_.x();
    offsets.y = py - v * ab_.y() - w * ac_.y();
    offsets.z = pz - v * ab_.z() - w * ac_.z();
    offsets.length_sq = offsets.x * offsets.x + offsets.y * offsets.y + offsets.z * offsets.z;
    return offsets;
  }

 private:
  // Square of a triangle's height over its longest side up to which only its sides count, as
  // rounding would dominate its barycentric coordinates.
  static constexpr float kFlat = 1e-9f;

  static float Inverse(float length_sq) { return length_sq > 0 ? 1 / length_sq : 0.0f; }
  static Four Clamped(Four x) {
    const Four zero = {0, 0, 0, 0}, one = {1, 1, 1, 1};
    x = x > zero ? x : zero;
    return x < one ? x : one;
  }

  Eigen::Vector3f a_, ab_, ac_;
  float ab_ab_, ab_ac_, ac_ac_, bc_bc_;
  float inverse_ab_, inverse_ac_, inverse_bc_;  // of the sides' squared lengths; 0 for none
  float within_from_;                           // 0; infinite if the triangle has no inside
};

}  // namespace liquidblend::spacetime
