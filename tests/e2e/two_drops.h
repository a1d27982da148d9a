// The repository's real simulations.
#pragma once

#include <gtest/gtest.h>

#include <string>
#include <utility>

#include "core/mesh/animation.h"
#include "core/parallel/arena.h"
#include "tests/paths.h"
#include "worker/ingest/read_animation.h"
#include "worker/ingest/read_directory.h"

namespace liquidblend::e2e {

// name: A, B or MID.
inline mesh::Animation LoadTwoDrops(const std::string& name, const parallel::Arena& arena) {
  const auto files = ingest::LoadDirectory(paths::Source("tests/data/two_drops/" + name));
  EXPECT_TRUE(files.ok()) << files.status();
  auto animation = ingest::ReadAnimation(name, ingest::Views(*files), {}, arena);
  EXPECT_TRUE(animation.ok()) << animation.status();
  return *std::move(animation);
}

}  // namespace liquidblend::e2e
