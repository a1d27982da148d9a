#include "core/frames/indexed_family.h"

#include <utility>

#include "core/base/status_macros.h"

namespace liquidblend::frames {
namespace {

std::vector<std::unique_ptr<const IndexedLevel>> LevelsOf(const mesh::RegisteredFamily& family) {
  std::vector<std::unique_ptr<const IndexedLevel>> levels;
  levels.push_back(std::make_unique<IndexedLevel>(family));
  for (const mesh::RegisteredFamily& level : family.coarser_levels) {
    levels.push_back(std::make_unique<IndexedLevel>(level));
  }
  return levels;
}

}  // namespace

absl::StatusOr<OptionalSpace> MakeOptionalSpace(const mesh::ParameterSpace& space) {
  if (space.empty()) return OptionalSpace();
  LB_ASSIGN_OR_RETURN(parameters::Interpolator made, parameters::Interpolator::Make(space));
  return OptionalSpace(std::move(made));
}

IndexedFamily::IndexedFamily(mesh::RegisteredFamily registered, OptionalSpace space)
    : family(std::move(registered)),
      levels(LevelsOf(family)),
      grid(GridOf(family)),
      parameter_space(std::move(space)),
      life_limits(family) {}

int64_t IndexedFamily::index_bytes() const {
  int64_t bytes = 0;
  for (const auto& level : levels) {
    bytes += level->index.size_bytes() + level->time_links.size_bytes();
  }
  return bytes;
}

}  // namespace liquidblend::frames
