#include "worker/registration/features/lumps.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <utility>

#include "core/mesh/slice_at.h"
#include "worker/registration/features/height_field.h"

namespace liquidblend::registration {
namespace {

constexpr double kLumpSpacing = 1.0;    // edges; of the grid of heights ...
constexpr double kMaxLumpSteps = 512;   // ... unless it would have more than these on a side
constexpr double kMaxSizeRatio = 2.0;   // of diameters, within a pair
constexpr double kSameTop = 2.0;        // edges; between the tops of a track and of its lump
constexpr double kLumpRejection = 1.0;  // what being without a partner costs

HeightField SeenFromAbove(const mesh::TriangleMesh& surface, const mesh::HeightAxis& up) {
  const Eigen::Vector3d low = surface.vertices.rowwise().minCoeff().cast<double>();
  const Eigen::Vector3d high = surface.vertices.rowwise().maxCoeff().cast<double>();
  const double extent = PlaceOf(high - low, up).maxCoeff();
  const double spacing = std::max(kLumpSpacing, extent / kMaxLumpSteps);
  return HeightField(surface, up, PlaceOf((low + high) / 2, up), extent / 2 + spacing, spacing,
                     Seen::kAll);
}

// Sweeps the heights from the top and joins what meets.
class LumpSweep {
 public:
  explicit LumpSweep(HeightField field)
      : field_(std::move(field)),
        size_(field_.size()),
        root_(static_cast<size_t>(size_) * size_, -1) {}

  std::vector<Lump> Run(double min_prominence) {
    std::vector<int> order;
    for (int n = 0; n < size_ * size_; ++n) {
      if (!std::isnan(HeightOf(n))) order.push_back(n);
    }
    std::stable_sort(order.begin(), order.end(),
                     [&](int a, int b) { return HeightOf(a) > HeightOf(b); });
    for (const int n : order) Add(n, min_prominence);
    // The highest of each connected region goes down to its lowest point.
    std::vector<double> lowest(root_.size(), 0.0);
    for (const int n : order) lowest[Root(n)] = HeightOf(n);
    for (const int n : order) {
      if (Root(n) == n) Record(n, HeightOf(n) - lowest[n], min_prominence);
    }
    std::sort(tops_.begin(), tops_.end());
    std::vector<Lump> lumps;
    for (const auto& [top, prominence] : tops_) lumps.push_back(Measure(top, prominence));
    return lumps;
  }

 private:
  double HeightOf(int n) const { return field_.At(n % size_, n / size_); }
  int Root(int n) {
    while (root_[n] != n) n = root_[n] = root_[root_[n]];
    return n;
  }
  template <typename Visit>
  void ForNeighbors(int n, const Visit& visit) const {
    const int i = n % size_, j = n / size_;
    for (int y = std::max(0, j - 1); y <= std::min(size_ - 1, j + 1); ++y) {
      for (int x = std::max(0, i - 1); x <= std::min(size_ - 1, i + 1); ++x) {
        if (x != i || y != j) visit(y * size_ + x);
      }
    }
  }
  bool IsHigher(int a, int b) const {
    return HeightOf(a) != HeightOf(b) ? HeightOf(a) > HeightOf(b) : a < b;
  }
  // A set's root is its top. Where two sets meet, the one with the lower top ends.
  void Add(int n, double min_prominence) {
    root_[n] = n;
    ForNeighbors(n, [&](int m) {
      if (root_[m] < 0) return;
      int a = Root(n), b = Root(m);
      if (a == b) return;
      if (IsHigher(b, a)) std::swap(a, b);
      Record(b, HeightOf(b) - HeightOf(n), min_prominence);
      root_[b] = a;
    });
  }
  void Record(int top, double prominence, double min_prominence) {
    if (prominence >= min_prominence) tops_.push_back({top, prominence});
  }
  // The lump of a top: the region around it that is above half of its prominence.
  Lump Measure(int top, double prominence) const {
    const double level = HeightOf(top) - prominence / 2;
    std::vector<char> is_in(root_.size(), 0);
    std::vector<int> found = {top};
    is_in[top] = 1;
    Lump lump;
    for (size_t k = 0; k < found.size(); ++k) {
      lump.place += field_.PlaceOfPoint(found[k] % size_, found[k] / size_);
      ForNeighbors(found[k], [&](int m) {
        if (is_in[m] != 0 || !(HeightOf(m) >= level)) return;
        is_in[m] = 1;
        found.push_back(m);
      });
    }
    const double count = static_cast<double>(found.size());
    lump.place /= count;
    lump.height = HeightOf(top);
    lump.prominence = prominence;
    lump.diameter = 2 * field_.spacing() * std::sqrt(count / std::numbers::pi);
    return lump;
  }

  const HeightField field_;
  const int size_;
  std::vector<int> root_;  // per grid point; -1: not swept yet
  std::vector<std::pair<int, double>> tops_;
};

std::vector<int> MostProminent(const std::vector<Lump>& lumps) {
  std::vector<int> order(lumps.size());
  for (size_t n = 0; n < order.size(); ++n) order[n] = static_cast<int>(n);
  std::stable_sort(order.begin(), order.end(),
                   [&](int a, int b) { return lumps[a].prominence > lumps[b].prominence; });
  order.resize(std::min<size_t>(order.size(), kMaxAssigned));
  std::sort(order.begin(), order.end());
  return order;
}

double CostOf(const Lump& a, const Lump& b, double max_shift) {
  const double shift = (a.place - b.place).norm() / max_shift;
  const double size = std::abs(std::log(a.diameter / b.diameter)) / std::log(kMaxSizeRatio);
  if (shift > 1 || size > 1) return std::numeric_limits<double>::infinity();
  return (shift * shift + size * size) / 2;
}

// The lump of a track that is there at the first frame; -1: none.
int LumpOf(const Track& track, const std::vector<Lump>& lumps, const mesh::HeightAxis& up) {
  if (track.start != TrackStart::kFirstFrame || track.is_pre_roll()) return -1;
  std::array<int, 3> upwards = {};
  upwards[up.axis] = up.sign;
  const auto direction = std::find(kReachDirections.begin(), kReachDirections.end(), upwards);
  const Part part = track.At(track.start_time);
  const double top =
      up.sign * part.centre[up.axis] + part.reach[direction - kReachDirections.begin()];
  const Eigen::Vector2d place = PlaceOf(part.centre.head<3>(), up);
  for (size_t n = 0; n < lumps.size(); ++n) {
    if ((lumps[n].place - place).norm() <= track.diameter() / 2 &&
        std::abs(lumps[n].height - top) <= kSameTop) {
      return static_cast<int>(n);
    }
  }
  return -1;
}

// The part of the pre-roll that was cut off from a lump; -1: none.
int PreRollTrackAt(const std::vector<Track>& tracks, const Lump& lump, const mesh::HeightAxis& up) {
  for (size_t n = 0; n < tracks.size(); ++n) {
    const Eigen::Vector3d centre = tracks[n].parts.front().centre.head<3>();
    if (tracks[n].is_pre_roll() && (PlaceOf(centre, up) - lump.place).norm() <= lump.diameter / 2) {
      return static_cast<int>(n);
    }
  }
  return -1;
}

}  // namespace

std::vector<Lump> FindLumps(const mesh::TriangleMesh& first_frame, const mesh::HeightAxis& up,
                            double min_prominence) {
  if (first_frame.num_vertices() == 0) return {};
  return LumpSweep(SeenFromAbove(first_frame, up)).Run(min_prominence);
}

std::vector<Lump> FindLumps(const Surface& surface, double min_prominence) {
  const double times[] = {0.0};
  const auto slices = mesh::SliceAt(surface.mesh, surface.points, times, parallel::Arena(1));
  return FindLumps(slices[0], mesh::AxisOf(surface.mesh.up), min_prominence);
}

std::vector<AssignedPair> PairLumps(const std::vector<Lump>& source,
                                    const std::vector<Lump>& target, double max_shift) {
  const std::vector<int> rows = MostProminent(source), columns = MostProminent(target);
  Eigen::MatrixXd costs(rows.size(), columns.size());
  for (Eigen::Index i = 0; i < costs.rows(); ++i) {
    for (Eigen::Index j = 0; j < costs.cols(); ++j) {
      costs(i, j) = CostOf(source[rows[i]], target[columns[j]], max_shift);
    }
  }
  std::vector<AssignedPair> pairs = Assign(costs, kLumpRejection);
  for (AssignedPair& pair : pairs) {
    pair.row = rows[pair.row];
    pair.column = columns[pair.column];
  }
  return pairs;
}

std::vector<JoinedTrack> FindJoinedTracks(const TracksWithLumps& own, const TracksWithLumps& other,
                                          const std::vector<AssignedPair>& pairs, mesh::Up up,
                                          double min_confidence) {
  const mesh::HeightAxis height = mesh::AxisOf(up);
  std::vector<char> is_of_track(other.lumps.size(), 0);
  for (const Track& track : other.tracks) {
    const int lump = LumpOf(track, other.lumps, height);
    if (lump >= 0) is_of_track[lump] = 1;
  }
  std::vector<JoinedTrack> joined;
  for (size_t n = 0; n < own.tracks.size(); ++n) {
    const int lump = LumpOf(own.tracks[n], own.lumps, height);
    const auto pair = std::find_if(pairs.begin(), pairs.end(), [&](const AssignedPair& p) {
      return p.row == lump && p.confidence >= min_confidence && is_of_track[p.column] == 0;
    });
    if (pair == pairs.end()) continue;
    joined.push_back({static_cast<int>(n), lump, pair->column});
    joined.back().pre_roll_track = PreRollTrackAt(other.tracks, other.lumps[pair->column], height);
  }
  return joined;
}

}  // namespace liquidblend::registration
