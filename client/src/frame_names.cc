#include "client/src/frame_names.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <iterator>
#include <map>

#include "absl/status/statusor.h"
#include "absl/strings/ascii.h"
#include "absl/strings/escaping.h"
#include "absl/strings/match.h"
#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "absl/strings/string_view.h"
#include "absl/strings/strip.h"
#include "client/src/status_macros.h"

namespace liquidblend::client {
namespace {

constexpr size_t kMaxDigits = 9;
constexpr char kVelocityExtension[] = ".uni";

struct FormatName {
  AnimationFormat format;
  const char* extension;
};
constexpr FormatName kFormats[] = {{AnimationFormat::kMantaflow, ".bobj.gz"},
                                   {AnimationFormat::kPly, ".ply"},
                                   {AnimationFormat::kObj, ".obj"},
                                   {AnimationFormat::kStl, ".stl"},
                                   {AnimationFormat::kVdb, ".vdb"}};

bool IsVelocities(absl::string_view name) {
  return absl::StartsWith(name, "lVelMesh") && absl::EndsWith(name, kVelocityExtension);
}

// A name's number: the digits before the extension, and those before a dot in front of them.
struct NumberWords {
  absl::string_view prefix;
  absl::string_view before_dot;
  absl::string_view last;
};

absl::string_view CutDigits(absl::string_view& text) {
  size_t num_digits = 0;
  while (num_digits < text.size() && absl::ascii_isdigit(text[text.size() - 1 - num_digits])) {
    ++num_digits;
  }
  const absl::string_view digits = text.substr(text.size() - num_digits);
  text.remove_suffix(num_digits);
  return digits;
}

NumberWords FindNumber(absl::string_view name, absl::string_view extension) {
  name.remove_suffix(extension.size());
  NumberWords words;
  words.last = CutDigits(name);
  absl::string_view before = name;
  if (!words.last.empty() && absl::ConsumeSuffix(&before, "."))
    words.before_dot = CutDigits(before);
  if (!words.before_dot.empty()) name = before;
  words.prefix = name;
  return words;
}

// The digits before the dot count frames if they are not the same in all names.
bool HasFractions(const std::vector<std::string>& meshes, absl::string_view extension) {
  const absl::string_view first = FindNumber(meshes.front(), extension).before_dot;
  return std::any_of(meshes.begin(), meshes.end(), [&](const std::string& name) {
    return FindNumber(name, extension).before_dot != first;
  });
}

std::string Escaped(const std::string& name) { return absl::Utf8SafeCHexEscape(name); }
std::string FormatNumber(double number) { return absl::StrFormat("%.15g", number); }

absl::Status CheckPrefixes(const std::vector<std::string>& meshes, absl::string_view extension) {
  const NumberWords first = FindNumber(meshes.front(), extension);
  for (const std::string& name : meshes) {
    const NumberWords words = FindNumber(name, extension);
    if (words.prefix == first.prefix || words.last.empty() || first.last.empty()) continue;
    return absl::InvalidArgumentError(
        absl::StrCat("frames of two sequences, ", Escaped(meshes.front()), " and ", Escaped(name),
                     ": choose those of one, such as --pattern '", std::string(first.prefix),
                     "*', or move the others away"));
  }
  return absl::OkStatus();
}

// Names by the digits after the dot, by the digits before it.
using NamesByRun = std::map<std::string, std::map<std::string, std::string>>;

// Two names of other runs that have this number after the dot and another one too; or none.
std::vector<std::string> FindEqualNumbers(const NamesByRun& runs) {
  for (auto one = runs.begin(); one != runs.end(); ++one) {
    if (one->second.size() < 2) continue;
    for (auto other = std::next(one); other != runs.end(); ++other) {
      std::vector<std::string> equal;
      for (const auto& [number, name] : one->second) {
        if (other->second.count(number) > 0) equal.push_back(number);
      }
      if (equal.size() > 1) return {one->second.at(equal[0]), other->second.at(equal[0])};
    }
  }
  return {};
}

template <typename T>
bool IsEvenlySpaced(const std::vector<T>& rising, T step, T tolerance) {
  for (size_t k = 1; k < rising.size(); ++k) {
    if (std::abs(rising[k] - rising[k - 1] - step) > tolerance) return false;
  }
  return true;
}

// Whether the digits after the dots count frames, as in run1.01 to run1.09 and run2.10 to run2.19:
// they go up by one in several runs, and are not one sequence of evenly spaced times (1.98, 1.99,
// 2.00, 2.01).
bool CountFrames(const NamesByRun& runs) {
  std::vector<double> times;
  int num_sequences = 0;
  for (const auto& [before_dot, names] : runs) {
    std::vector<int64_t> numbers;
    for (const auto& [digits, name] : names) {
      int64_t number = 0;
      double time = 0.0;
      if (before_dot.empty() || !absl::SimpleAtoi(digits, &number) ||
          !absl::SimpleAtod(absl::StrCat(before_dot, ".", digits), &time)) {
        return false;
      }
      numbers.push_back(number);
      times.push_back(time);
    }
    std::sort(numbers.begin(), numbers.end());
    if (!IsEvenlySpaced(numbers, int64_t{1}, int64_t{0})) return false;
    if (numbers.size() > 1) ++num_sequences;
  }
  std::sort(times.begin(), times.end());
  return num_sequences > 1 && !IsEvenlySpaced(times, times[1] - times[0], 1e-6);
}

// The first names of two runs that count frames; or none.
std::vector<std::string> FindCounters(const NamesByRun& runs) {
  if (!CountFrames(runs)) return {};
  std::vector<std::string> first;
  for (const auto& [before_dot, names] : runs) {
    if (names.size() > 1 && first.size() < 2) first.push_back(names.begin()->second);
  }
  return first;
}

// Whether the digits after the dots cut a frame into equal parts, such as 25, 5 and 75. Tenths and
// hundredths do not count: frames of a sequence have such numbers, too.
bool AreEqualParts(const NamesByRun& runs) {
  std::map<double, double> tolerances = {{0.0, 0.0}};  // by fractions
  for (const auto& [before_dot, names] : runs) {
    for (const auto& [digits, name] : names) {
      const double unit = std::pow(10.0, -static_cast<double>(digits.size()));
      double number = 0.0;
      if (before_dot.empty() || !absl::SimpleAtod(digits, &number)) continue;
      tolerances.emplace(number * unit, 0.5 * unit);
    }
  }
  const auto num_parts = static_cast<double>(tolerances.size());
  const double exponent = std::log10(num_parts);
  if (std::abs(exponent - std::round(exponent)) < 1e-9) return false;
  double k = 0.0;
  return std::all_of(tolerances.begin(), tolerances.end(), [&](const auto& part) {
    return std::abs(part.first - k++ / num_parts) <= part.second;
  });
}

// Numbers with a dot are those of two sequences, or times between frames.
absl::Status CheckFractions(const std::vector<std::string>& meshes, absl::string_view extension) {
  NamesByRun runs;
  for (const std::string& name : meshes) {
    const NumberWords words = FindNumber(name, extension);
    runs[std::string(words.before_dot)].emplace(words.last, name);
  }
  if (AreEqualParts(runs)) return absl::OkStatus();
  std::vector<std::string> two = FindEqualNumbers(runs);
  if (two.empty()) two = FindCounters(runs);
  if (two.empty()) return absl::OkStatus();
  const NumberWords first = FindNumber(two[0], extension);
  return absl::InvalidArgumentError(
      absl::StrCat("frames of two sequences, ", Escaped(two[0]), " and ", Escaped(two[1]),
                   ": choose those of one, such as --pattern '", std::string(first.prefix),
                   std::string(first.before_dot),
                   ".*'; if their numbers are times, give these by "
                   "--frame-times"));
}

using NamesByNumber = std::map<double, std::string>;

absl::StatusOr<NamesByNumber> Number(const std::vector<std::string>& names,
                                     absl::string_view extension, bool has_fractions) {
  NamesByNumber by_number;
  for (const std::string& name : names) {
    const NumberWords words = FindNumber(name, extension);
    std::string text(words.last);
    if (has_fractions && !words.before_dot.empty()) {
      text = absl::StrCat(words.before_dot, ".", words.last);
    }
    double number = 0.0;
    if (words.last.empty() || words.last.size() > kMaxDigits ||
        words.before_dot.size() > kMaxDigits || !absl::SimpleAtod(text, &number)) {
      return absl::InvalidArgumentError(absl::StrCat(
          Escaped(name), ": no frame number of 1 to ", kMaxDigits, " digits before ", extension,
          "; rename it, such as frame_0001", extension, ", or choose others with --pattern"));
    }
    const auto [entry, is_new] = by_number.try_emplace(number, name);
    if (is_new) continue;
    return absl::InvalidArgumentError(
        absl::StrCat("frame ", FormatNumber(number), " is there twice: ", Escaped(entry->second),
                     " and ", Escaped(name), "; move one of them away, or choose with --pattern"));
  }
  return by_number;
}

absl::Status CheckGaps(const NamesByNumber& meshes) {
  for (auto after = std::next(meshes.begin()); after != meshes.end(); ++after) {
    const auto before = std::prev(after);
    if (after->first == before->first + 1) continue;
    return absl::InvalidArgumentError(absl::StrCat(
        "frame ", FormatNumber(before->first + 1), " is missing: ", Escaped(after->second),
        " comes right after ", Escaped(before->second),
        " (--allow-gaps goes on without it; --frame-times says when frames are)"));
  }
  return absl::OkStatus();
}

absl::Status CheckVelocities(const NamesByNumber& velocities, const NamesByNumber& meshes) {
  if (velocities.empty()) return absl::OkStatus();
  for (const auto& [number, name] : meshes) {
    if (velocities.count(number) > 0) continue;
    return absl::InvalidArgumentError(
        absl::StrCat("frame ", FormatNumber(number), ": ", Escaped(name),
                     " has no velocities, but other frames have (",
                     Escaped(velocities.begin()->second), "); add its .uni, or remove all"));
  }
  for (const auto& [number, name] : velocities) {
    if (meshes.count(number) > 0) continue;
    return absl::InvalidArgumentError(
        absl::StrCat("frame ", FormatNumber(number), ": ", Escaped(name), " has no mesh"));
  }
  return absl::OkStatus();
}

absl::StatusOr<FormatName> FindFormat(const std::vector<std::string>& names,
                                      AnimationFormat format) {
  const FormatName* found = nullptr;
  std::string example;
  for (const FormatName& entry : kFormats) {
    if (format != AnimationFormat::kAny && format != entry.format) continue;
    const auto name = std::find_if(names.begin(), names.end(), [&](const std::string& n) {
      return absl::EndsWithIgnoreCase(n, entry.extension);
    });
    if (name == names.end()) continue;
    if (found != nullptr) {
      return absl::InvalidArgumentError(absl::StrCat("files of several formats, ", Escaped(example),
                                                     " and ", Escaped(*name),
                                                     ": say which to read (--format)"));
    }
    found = &entry;
    example = *name;
  }
  if (found != nullptr) return *found;
  return absl::InvalidArgumentError(absl::StrCat("none of the ", names.size(),
                                                 " files is a frame (.bobj.gz, .ply, .obj, .stl or "
                                                 ".vdb) of the format that was asked for"));
}

template <typename Predicate>
std::vector<std::string> Select(const std::vector<std::string>& names, Predicate&& predicate) {
  std::vector<std::string> selected;
  std::copy_if(names.begin(), names.end(), std::back_inserter(selected), predicate);
  return selected;
}

}  // namespace

bool IsFrameName(const std::string& name) {
  return std::any_of(std::begin(kFormats), std::end(kFormats), [&](const FormatName& entry) {
    return absl::EndsWithIgnoreCase(name, entry.extension);
  });
}

bool IsAnimationFileName(const std::string& name) {
  return IsFrameName(name) || absl::EndsWith(name, kVelocityExtension) || name == "meta.json";
}

absl::Status CheckFrameNames(const std::vector<std::string>& names, AnimationFormat format,
                             NumberRule rule) {
  LBC_ASSIGN_OR_RETURN(const FormatName found, FindFormat(names, format));
  const absl::string_view extension = found.extension;
  const std::vector<std::string> meshes = Select(
      names, [&](const std::string& name) { return absl::EndsWithIgnoreCase(name, extension); });
  LBC_RETURN_IF_ERROR(CheckPrefixes(meshes, extension));
  const bool has_fractions = HasFractions(meshes, extension);
  LBC_ASSIGN_OR_RETURN(const NamesByNumber numbered, Number(meshes, extension, has_fractions));
  if (has_fractions && rule != NumberRule::kTimesGiven) {
    LBC_RETURN_IF_ERROR(CheckFractions(meshes, extension));
  }
  if (!has_fractions && rule == NumberRule::kNoGaps) LBC_RETURN_IF_ERROR(CheckGaps(numbered));
  if (found.format != AnimationFormat::kMantaflow) return absl::OkStatus();
  LBC_ASSIGN_OR_RETURN(const NamesByNumber velocities,
                       Number(Select(names, IsVelocities), kVelocityExtension, has_fractions));
  return CheckVelocities(velocities, numbered);
}

std::vector<std::string> WithoutStrayVelocities(const std::vector<std::string>& names) {
  constexpr absl::string_view kMesh = ".bobj.gz";
  const std::vector<std::string> meshes =
      Select(names, [&](const std::string& name) { return absl::EndsWithIgnoreCase(name, kMesh); });
  const bool has_fractions = !meshes.empty() && HasFractions(meshes, kMesh);
  const absl::StatusOr<NamesByNumber> numbered = Number(meshes, kMesh, has_fractions);
  if (!numbered.ok()) return names;  // CheckFrameNames() says why
  return Select(names, [&](const std::string& name) {
    if (!IsVelocities(name)) return true;
    const auto number = Number({name}, kVelocityExtension, has_fractions);
    return !number.ok() || numbered->count(number->begin()->first) > 0;
  });
}

}  // namespace liquidblend::client
