#include "worker/registration/features/contacts.h"

#include <algorithm>
#include <cmath>

namespace liquidblend::registration {
namespace {

constexpr float kOneWay = 0.8f;  // length of a mean of normals: less, and they disagree

// Whether the surface moves along its normal by so little; in edges per frame.
bool IsStill(const Eigen::Vector4f& normal, double max_speed) {
  return std::abs(normal[3]) <= max_speed * normal.head<3>().norm();
}

// Sums over the vertices of one place.
struct Sums {
  Eigen::Vector3f points = Eigen::Vector3f::Zero();
  Eigen::Vector3f normals = Eigen::Vector3f::Zero();
  std::vector<int> frames;
  void Add(const Surface& surface, int32_t v) {
    points += surface.points.col(v).head<3>();
    normals += surface.mesh.normals.col(v).head<3>().normalized();
    frames.push_back(static_cast<int>(surface.points(3, v)));
  }
  float count() const { return static_cast<float>(frames.size()); }
  int first_frame() const { return *std::min_element(frames.begin(), frames.end()); }
  // Those that differ.
  int num_frames() const {
    std::vector<int> sorted = frames;
    std::sort(sorted.begin(), sorted.end());
    return static_cast<int>(std::unique(sorted.begin(), sorted.end()) - sorted.begin());
  }
};

}  // namespace

ContactCell CellOf(const Eigen::Vector3f& point) {
  const Eigen::Vector3i floor = point.array().floor().cast<int>();
  return {floor[0], floor[1], floor[2]};
}

std::vector<std::pair<ContactCell, int32_t>> StillVertices(const Surface& surface,
                                                           double max_speed) {
  std::vector<std::pair<ContactCell, int32_t>> still;
  for (int32_t v = 0; v < surface.points.cols(); ++v) {
    if (surface.rigid[v] || surface.InFirstSlab(v) || surface.InPreRoll(v)) continue;
    if (surface.InLastSlab(v)) continue;
    if (!IsStill(surface.mesh.normals.col(v), max_speed)) continue;
    still.emplace_back(CellOf(surface.points.col(v).head<3>()), v);
  }
  std::sort(still.begin(), still.end());
  return still;
}

std::vector<Contact> FindContacts(const Surface& surface, const ContactOptions& options) {
  const auto still = StillVertices(surface, options.max_speed);
  const double needed = std::max(1.0, options.min_share * surface.mesh.num_frames);
  std::vector<Contact> contacts;
  for (size_t begin = 0, end = 0; begin < still.size(); begin = end) {
    Sums sums;
    for (; end < still.size() && still[end].first == still[begin].first; ++end) {
      sums.Add(surface, still[end].second);
    }
    const float count = sums.count();
    if (sums.normals.norm() < kOneWay * count || sums.num_frames() < needed) continue;
    contacts.push_back({sums.points / count, sums.normals.normalized(), sums.first_frame()});
  }
  return contacts;
}

bool IsBent(Bend bend, const Contact& a, const Contact& b, const ContactOptions& options) {
  if (a.normal.dot(b.normal) > options.max_cosine) return false;
  const Eigen::Vector3f between = b.place - a.place;
  const float outward = between.dot(b.normal - a.normal);
  return (bend == Bend::kInward ? -outward : outward) > options.min_bend * between.norm();
}

ContactNeighbors::ContactNeighbors(const std::vector<Contact>& contacts, float reach)
    : contacts_(contacts), reach_(reach) {
  for (size_t n = 0; n < contacts.size(); ++n) {
    at_[CellOf(contacts[n].place)] = static_cast<int>(n);
  }
}

}  // namespace liquidblend::registration
