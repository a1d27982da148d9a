// Descriptions of the server's objects and of meshes, as lines of text. Control characters of a
// server's words are replaced, newlines as well: what they say stays in its line.
#pragma once

#include <string>

#include "client/cli/files/mesh_stats.h"
#include "liquidblend/animation.h"
#include "liquidblend/family.h"
#include "liquidblend/operation.h"

namespace liquidblend::cli {

// Several lines, the last one without a line end.
std::string Describe(const Animation& animation);
std::string Describe(const Family& family);
std::string Describe(const MeshStats& stats);

// One line.
std::string Summarize(const Animation& animation);
std::string Summarize(const Family& family);
std::string Summarize(const Operation& operation);

}  // namespace liquidblend::cli
