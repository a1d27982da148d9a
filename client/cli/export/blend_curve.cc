#include "client/cli/export/blend_curve.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "absl/strings/ascii.h"
#include "absl/strings/match.h"
#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_split.h"
#include "absl/strings/string_view.h"
#include "client/cli/files/files.h"
#include "client/cli/flags/parse.h"
#include "client/src/status_macros.h"

namespace liquidblend::cli {
namespace {

// The server's range (core/frames/blend_weights.h): a key beyond it is refused before any frame.
constexpr double kMinWeight = -1.0, kMaxWeight = 2.0;

using Key = BlendCurve::Key;

absl::Status RefuseKey(const std::string& flag, size_t number, const std::string& text,
                       const std::string& reason) {
  return absl::InvalidArgumentError(
      absl::StrCat(flag, ": key ", number, ", \"", text, "\": ", reason));
}

double Mix(double a, double b, double share) { return a + share * (b - a); }

// `text` itself, or that of the file it names, a line after the other.
absl::StatusOr<std::string> CurveText(const std::string& text) {
  if (!absl::StartsWith(text, "@")) return text;
  LBC_ASSIGN_OR_RETURN(const std::string bytes, ReadFile(text.substr(1)));
  std::string keys;
  for (const absl::string_view line : absl::StrSplit(bytes, '\n')) {
    const absl::string_view key = absl::StripAsciiWhitespace(line.substr(0, line.find('#')));
    if (!key.empty()) absl::StrAppend(&keys, keys.empty() ? "" : "/", key);
  }
  if (!keys.empty()) return keys;
  return absl::InvalidArgumentError(absl::StrCat(text.substr(1), ": holds no key TIME:VALUE"));
}

absl::StatusOr<Blend> ToOneBlend(const std::string& flag, const std::string& value) {
  BlendFlags flags;
  (flag == "--weights" ? flags.weights : flags.parameters) = value;
  return ToRequiredBlend(flags);
}

absl::StatusOr<Key> ParseKey(const std::string& flag, size_t number, const std::string& text) {
  const std::pair<std::string, std::string> sides = absl::StrSplit(text, absl::MaxSplits(':', 1));
  Key key;
  if (!absl::SimpleAtod(sides.first, &key.time_s) || !std::isfinite(key.time_s) ||
      sides.second.empty()) {
    return RefuseKey(flag, number, text, "is not TIME:VALUE, such as 1.5:0.25");
  }
  absl::StatusOr<Blend> blend = ToOneBlend(flag, sides.second);
  if (!blend.ok()) {
    return absl::Status(blend.status().code(),
                        absl::StrCat("key ", number, ": ", blend.status().message()));
  }
  key.blend = *std::move(blend);
  for (const double weight : key.blend.weights) {
    if (weight >= kMinWeight && weight <= kMaxWeight) continue;
    return RefuseKey(
        flag, number, text,
        absl::StrCat("has weight ", weight, ", not in [", kMinWeight, ", ", kMaxWeight, "]"));
  }
  return key;
}

bool HaveSameNames(const Parameters& a, const Parameters& b) {
  return a.size() == b.size() &&
         std::equal(a.begin(), a.end(), b.begin(),
                    [](const auto& one, const auto& other) { return one.first == other.first; });
}

// Compares a key with the one before it.
absl::Status CheckNext(const std::string& flag, size_t number, const std::string& text,
                       const Key& before, const Key& key) {
  if (!(key.time_s > before.time_s)) {
    return RefuseKey(flag, number, text,
                     absl::StrCat("its time ", key.time_s, " is not after that of the key before, ",
                                  before.time_s));
  }
  if (key.blend.weights.size() != before.blend.weights.size()) {
    return RefuseKey(flag, number, text,
                     absl::StrCat("has ", key.blend.weights.size(), " weights, the key before ",
                                  before.blend.weights.size()));
  }
  if (HaveSameNames(key.blend.parameters, before.blend.parameters)) return absl::OkStatus();
  return RefuseKey(flag, number, text, "has not the parameters of the key before");
}

absl::StatusOr<std::vector<Key>> ParseCurve(const std::string& flag, const std::string& value) {
  LBC_ASSIGN_OR_RETURN(const std::string text, CurveText(value));
  std::vector<Key> keys;
  if (!absl::StrContains(text, ":")) {
    LBC_ASSIGN_OR_RETURN(Blend blend, ToOneBlend(flag, text));
    keys.push_back({0.0, std::move(blend)});
    return keys;
  }
  for (const absl::string_view part : absl::StrSplit(text, '/')) {
    const std::string key_text(absl::StripAsciiWhitespace(part));
    LBC_ASSIGN_OR_RETURN(Key key, ParseKey(flag, keys.size() + 1, key_text));
    if (!keys.empty()) {
      LBC_RETURN_IF_ERROR(CheckNext(flag, keys.size() + 1, key_text, keys.back(), key));
    }
    keys.push_back(std::move(key));
  }
  return keys;
}

}  // namespace

const char kWeightsCurveHelp[] =
    "W[,W..]: one per target; the source gets 1 - sum; -1 to 2. Or a curve: TIME:W[,W..]/TIME:.., "
    "seconds, linear between keys; or @FILE with a key a line; otherwise by --parameters";
const char kParametersCurveHelp[] =
    "NAME=VALUE[,..]: a point in the family's parameter space instead of weights. Or a curve: "
    "TIME:NAME=VALUE[,..]/TIME:..; or @FILE; otherwise by --weights";

Blend BlendCurve::At(double time_s) const {
  const auto after =
      std::find_if(keys_.begin(), keys_.end(), [&](const Key& key) { return key.time_s > time_s; });
  if (after == keys_.begin()) return keys_.front().blend;
  if (after == keys_.end()) return keys_.back().blend;
  const Key& before = *(after - 1);
  const double share = (time_s - before.time_s) / (after->time_s - before.time_s);
  Blend blend = before.blend;
  for (size_t k = 0; k < blend.weights.size(); ++k) {
    blend.weights[k] = Mix(blend.weights[k], after->blend.weights[k], share);
  }
  for (auto& [name, value] : blend.parameters) {
    value = Mix(value, after->blend.parameters.at(name), share);
  }
  return blend;
}

absl::StatusOr<BlendCurve> ToBlendCurve(const BlendFlags& flags) {
  if (flags.weights.empty() && flags.parameters.empty()) return ToRequiredBlend(flags).status();
  const bool is_weights = !flags.weights.empty();
  LBC_ASSIGN_OR_RETURN(std::vector<Key> keys, is_weights
                                                  ? ParseCurve("--weights", flags.weights)
                                                  : ParseCurve("--parameters", flags.parameters));
  for (Key& key : keys) key.blend.extrapolate = flags.extrapolate;
  return BlendCurve(std::move(keys));
}

}  // namespace liquidblend::cli
