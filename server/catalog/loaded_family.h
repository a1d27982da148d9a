// Loaded family: one version of a family in memory, with the indices for making frames.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "core/mesh/registered_family.h"
#include "core/store/blobs/blob_store.h"
#include "core/store/catalog/catalog.h"
#include "server/blend/life_limits.h"
#include "server/encode/grid.h"
#include "server/finish/time_links.h"
#include "server/parameters/interpolator.h"
#include "server/slice/cell_index.h"

namespace liquidblend::catalog {

// One level of detail with its indices.  Threads: safe, immutable.
struct LoadedLevel {
  explicit LoadedLevel(const mesh::RegisteredFamily& level)
      : family(level), index(level), time_links(level) {}
  const mesh::RegisteredFamily& family;  // the LoadedFamily's own, or one of its coarser levels
  const slice::CellIndex index;
  const finish::TimeLinks time_links;
};

// One version of a family, its levels and its file.  Threads: safe, immutable.
struct LoadedFamily {
  using ParameterSpace = std::optional<const parameters::Interpolator>;
  //   space  of registered.parameter_space, or nothing if that is empty
  LoadedFamily(mesh::RegisteredFamily registered, ParameterSpace space);
  const mesh::RegisteredFamily family;  // name and version as in the catalog
  // By level of detail: `family`, then its coarser levels.
  const std::vector<std::unique_ptr<const LoadedLevel>> levels;
  const encode::Grid grid;  // for every frame of `family` at any level
  const ParameterSpace parameter_space;
  const blend::LifeLimits life_limits;
  std::shared_ptr<const store::Blob> file;  // that `family` views; null: it views other memory
  // kDataLoss once a part of the file could not be read: frames made since then are not to be sent.
  absl::Status CheckFile() const;
  int64_t size_bytes = 0;  // mapped file, indices and links
  // Id, version and content: families with equal generations give the same frames.
  std::string generation;
};
using FamilyPtr = std::shared_ptr<const LoadedFamily>;

// The generation of a record's family.
std::string GenerationOf(const store::pb::FamilyRecord& record);

// Errors: kDataLoss if the blob is missing or not a family file; the blob store's. Messages begin
// with the family's name.
absl::StatusOr<FamilyPtr> LoadFamily(const store::pb::FamilyRecord& record,
                                     store::BlobStore& blobs);

}  // namespace liquidblend::catalog
