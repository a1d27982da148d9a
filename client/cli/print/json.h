// Plain values -> JSON. Animations and families are as HTTP answers them. The progress of
// operations has the names of protobuf's JSON; its fields are there even if they are 0 or empty.
#pragma once

#include <nlohmann/json.hpp>
#include <string>

#include "absl/time/time.h"
#include "client/cli/files/mesh_stats.h"
#include "liquidblend/animation.h"
#include "liquidblend/family.h"
#include "liquidblend/operation.h"

namespace liquidblend::cli {

using Json = nlohmann::ordered_json;

Json ToJson(const Bounds& bounds);
Json ToJson(const Animation& animation);
Json ToJson(const Family& family);
Json ToJson(const Operation& operation);
Json ToJson(const MeshStats& stats);

// "2026-01-31T12:00:00Z"
std::string FormatUtc(absl::Time time);

// "importing", "ready", "failed", "unknown"
const char* StateName(AnimationState state);

// "tracked", "rebuilt", "unknown"
const char* GradeName(Grade grade);
const char* ConnectivityName(Connectivity connectivity);

// "queued", "running", "done", "failed", "cancelled"
const char* StateName(const Operation& operation);

}  // namespace liquidblend::cli
