#include "worker/ingest/frame_files.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <iterator>
#include <map>
#include <string>

#include "absl/strings/ascii.h"
#include "absl/strings/escaping.h"
#include "absl/strings/match.h"
#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "absl/strings/strip.h"
#include "core/base/glob.h"
#include "core/base/status_macros.h"

namespace liquidblend::ingest {
namespace {

constexpr char kMetaName[] = "meta.json";
constexpr char kVelocityPrefix[] = "lVelMesh";
constexpr char kVelocityExtension[] = ".uni";
constexpr size_t kMaxDigits = 9;  // of a frame number, so that whole ones fit an int

struct FormatName {
  Format format;
  const char* extension;
};
constexpr FormatName kFormats[] = {{Format::kMantaflow, ".bobj.gz"},
                                   {Format::kPly, ".ply"},
                                   {Format::kObj, ".obj"},
                                   {Format::kStl, ".stl"},
                                   {Format::kVdb, ".vdb"}};

const char* Extension(Format format) {
  for (const FormatName& entry : kFormats) {
    if (entry.format == format) return entry.extension;
  }
  return "";
}

bool IsMesh(absl::string_view name, Format format) {
  return absl::EndsWithIgnoreCase(name, Extension(format));
}

bool IsVelocities(absl::string_view name) {
  return absl::StartsWith(name, kVelocityPrefix) && absl::EndsWith(name, kVelocityExtension);
}

// Cuts the digits off the end of `text`.
absl::string_view CutDigits(absl::string_view& text) {
  size_t num_digits = 0;
  while (num_digits < text.size() && absl::ascii_isdigit(text[text.size() - 1 - num_digits])) {
    ++num_digits;
  }
  const absl::string_view digits = text.substr(text.size() - num_digits);
  text.remove_suffix(num_digits);
  return digits;
}

// The digits right before the extension, those before a dot in front of them, if any, and what is
// left of the name.
struct NumberWords {
  absl::string_view prefix;
  absl::string_view before_dot;
  absl::string_view last;
};

NumberWords FindNumber(const InputFile& file, absl::string_view extension) {
  absl::string_view stem = file.name;
  stem.remove_suffix(extension.size());
  NumberWords words;
  words.last = CutDigits(stem);
  absl::string_view before = stem;
  if (!words.last.empty() && absl::ConsumeSuffix(&before, "."))
    words.before_dot = CutDigits(before);
  if (!words.before_dot.empty()) stem = before;
  words.prefix = stem;
  return words;
}

// Whether the digits before the dot count frames.
bool HasFractions(const std::vector<const InputFile*>& meshes, absl::string_view extension) {
  const absl::string_view first = FindNumber(*meshes.front(), extension).before_dot;
  return std::any_of(meshes.begin(), meshes.end(), [&](const InputFile* file) {
    return FindNumber(*file, extension).before_dot != first;
  });
}

// Names that differ by more than their numbers are those of several sequences.
absl::Status CheckPrefixes(const std::vector<const InputFile*>& meshes,
                           absl::string_view extension) {
  const NumberWords first = FindNumber(*meshes.front(), extension);
  for (const InputFile* const mesh : meshes) {
    const NumberWords words = FindNumber(*mesh, extension);
    if (words.prefix == first.prefix || words.last.empty() || first.last.empty()) continue;
    return absl::InvalidArgumentError(absl::StrCat(
        "frames of two sequences, ", Escaped(*meshes.front()), " and ", Escaped(*mesh),
        ": import one of them at a time (liquidblend import --pattern, or folders of their own)"));
  }
  return absl::OkStatus();
}

absl::StatusOr<double> FrameNumber(const InputFile& file, absl::string_view extension,
                                   bool has_fractions) {
  const NumberWords words = FindNumber(file, extension);
  std::string text(words.last);
  if (has_fractions && !words.before_dot.empty()) {
    text = absl::StrCat(words.before_dot, ".", words.last);
  }
  double number = 0.0;
  if (words.last.empty() || words.last.size() > kMaxDigits ||
      words.before_dot.size() > kMaxDigits || !absl::SimpleAtod(text, &number)) {
    return absl::InvalidArgumentError(absl::StrCat(Escaped(file), ": no frame number of 1 to ",
                                                   kMaxDigits, " digits before ",
                                                   std::string(extension)));
  }
  return number;
}

// A frame that the pattern does not choose.
bool IsLeftOut(const InputFile& file, const std::string& pattern) {
  if (pattern.empty() || file.name == kMetaName || IsVelocities(file.name)) return false;
  return !base::MatchesGlob(pattern, file.name);
}

// For messages.
std::string CalledLike(const std::string& pattern) {
  if (pattern.empty()) return "";
  return absl::StrCat(" called '", absl::Utf8SafeCHexEscape(pattern),
                      "' (* stands for any characters, ? for one)");
}

absl::StatusOr<Format> FindFormat(std::span<const InputFile> files, const std::string& pattern) {
  Format found = Format::kAny;
  const InputFile* example = nullptr;
  for (const FormatName& entry : kFormats) {
    const auto file = std::find_if(files.begin(), files.end(), [&](const InputFile& f) {
      return IsMesh(f.name, entry.format) && !IsLeftOut(f, pattern);
    });
    if (file == files.end()) continue;
    if (example != nullptr) {
      return absl::InvalidArgumentError(absl::StrCat("files of several formats, ",
                                                     Escaped(*example), " and ", Escaped(*file),
                                                     ": say which to read (--format)"));
    }
    found = entry.format;
    example = &*file;
  }
  if (example != nullptr) return found;
  return absl::InvalidArgumentError(
      absl::StrCat("none of the ", files.size(),
                   " files is a frame (.bobj.gz, .ply, .obj, .stl or .vdb)", CalledLike(pattern)));
}

using FilesByNumber = std::map<double, const InputFile*>;

absl::StatusOr<FilesByNumber> Number(const std::vector<const InputFile*>& files,
                                     absl::string_view extension, bool has_fractions) {
  FilesByNumber by_number;
  for (const InputFile* const file : files) {
    LB_ASSIGN_OR_RETURN(const double number, FrameNumber(*file, extension, has_fractions));
    const auto [entry, is_new] = by_number.try_emplace(number, file);
    if (is_new) continue;
    return absl::InvalidArgumentError(absl::StrCat("frame ", FormatNumber(number),
                                                   " is there twice: ", Escaped(*entry->second),
                                                   " and ", Escaped(*file)));
  }
  return by_number;
}

// Files by the digits after the dot, by the digits before it.
using FilesByRun = std::map<std::string, std::map<std::string, const InputFile*>>;

// Two files of different runs that have a number after the dot in common, and another one too; or
// none.
std::vector<const InputFile*> FindEqualNumbers(const FilesByRun& runs) {
  for (auto one = runs.begin(); one != runs.end(); ++one) {
    if (one->second.size() < 2) continue;
    for (auto other = std::next(one); other != runs.end(); ++other) {
      std::vector<std::string> equal;
      for (const auto& [number, file] : one->second) {
        if (other->second.contains(number)) equal.push_back(number);
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
bool CountFrames(const FilesByRun& runs) {
  std::vector<double> times;
  int num_sequences = 0;
  for (const auto& [before_dot, files] : runs) {
    std::vector<int64_t> numbers;
    for (const auto& [digits, file] : files) {
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

// The first files of two runs that count frames; or none.
std::vector<const InputFile*> FindCounters(const FilesByRun& runs) {
  if (!CountFrames(runs)) return {};
  std::vector<const InputFile*> first;
  for (const auto& [before_dot, files] : runs) {
    if (files.size() > 1 && first.size() < 2) first.push_back(files.begin()->second);
  }
  return first;
}

// Whether the digits after the dots cut a frame into equal parts, such as 25, 5 and 75. Tenths and
// hundredths do not count: frames of a sequence have such numbers, too.
bool AreEqualParts(const FilesByRun& runs) {
  std::map<double, double> tolerances = {{0.0, 0.0}};  // by fractions
  for (const auto& [before_dot, files] : runs) {
    for (const auto& [digits, file] : files) {
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

// Every mesh has velocities, or none has; no velocities lack their mesh.
absl::Status AddVelocities(const FilesByNumber& velocities, const FilesByNumber& meshes,
                           FrameSequence& sequence) {
  if (velocities.empty()) return absl::OkStatus();
  for (FrameFiles& frame : sequence.frames) {
    const auto found = velocities.find(frame.number);
    if (found == velocities.end()) {
      return absl::InvalidArgumentError(absl::StrCat("frame ", FormatNumber(frame.number), ": ",
                                                     Escaped(*frame.mesh),
                                                     " has no velocities, but other frames have (",
                                                     Escaped(*velocities.begin()->second), ")"));
    }
    frame.velocities = found->second;
  }
  for (const auto& [number, file] : velocities) {
    if (meshes.contains(number)) continue;
    return absl::InvalidArgumentError(
        absl::StrCat("frame ", FormatNumber(number), ": ", Escaped(*file), " has no mesh"));
  }
  return absl::OkStatus();
}

}  // namespace

bool IsInputName(absl::string_view name) {
  return name == kMetaName || IsVelocities(name) ||
         std::any_of(std::begin(kFormats), std::end(kFormats),
                     [&](const FormatName& entry) { return IsMesh(name, entry.format); });
}

std::string Escaped(const InputFile& file) { return absl::Utf8SafeCHexEscape(file.name); }

std::string FormatNumber(double number) { return absl::StrFormat("%.15g", number); }

absl::Status CheckFractions(const FrameSequence& sequence) {
  if (!sequence.has_fractions) return absl::OkStatus();
  FilesByRun runs;
  for (const FrameFiles& frame : sequence.frames) {
    const NumberWords words = FindNumber(*frame.mesh, Extension(sequence.format));
    runs[std::string(words.before_dot)].emplace(words.last, frame.mesh);
  }
  if (AreEqualParts(runs)) return absl::OkStatus();
  std::vector<const InputFile*> two = FindEqualNumbers(runs);
  if (two.empty()) two = FindCounters(runs);
  if (two.empty()) return absl::OkStatus();
  return absl::InvalidArgumentError(absl::StrCat(
      "frames of two sequences, ", Escaped(*two[0]), " and ", Escaped(*two[1]),
      ": import one of them at a time (liquidblend import --pattern, or folders of their own); if "
      "their numbers are times, give these (--frame-times, or frame_times in meta.json)"));
}

absl::StatusOr<FrameSequence> FindFrames(std::span<const InputFile> files, Format format,
                                         const std::string& pattern) {
  FrameSequence sequence;
  sequence.format = format;
  if (format == Format::kAny) {
    LB_ASSIGN_OR_RETURN(sequence.format, FindFormat(files, pattern));
  }
  std::vector<const InputFile*> meshes;
  std::vector<const InputFile*> velocities;
  for (const InputFile& file : files) {
    if (IsLeftOut(file, pattern)) continue;
    if (file.name == kMetaName) {
      sequence.meta = &file;
    } else if (IsMesh(file.name, sequence.format)) {
      meshes.push_back(&file);
    } else if (sequence.format == Format::kMantaflow && IsVelocities(file.name)) {
      velocities.push_back(&file);
    }
  }
  const char* const extension = Extension(sequence.format);
  if (meshes.empty()) {
    return absl::InvalidArgumentError(absl::StrCat(
        "none of the ", files.size(), " files is a frame (", extension, ")", CalledLike(pattern)));
  }
  LB_RETURN_IF_ERROR(CheckPrefixes(meshes, extension));
  sequence.has_fractions = HasFractions(meshes, extension);
  LB_ASSIGN_OR_RETURN(const FilesByNumber numbered_meshes,
                      Number(meshes, extension, sequence.has_fractions));
  LB_ASSIGN_OR_RETURN(FilesByNumber numbered_velocities,
                      Number(velocities, kVelocityExtension, sequence.has_fractions));
  if (!pattern.empty()) {
    std::erase_if(numbered_velocities,
                  [&](const auto& entry) { return !numbered_meshes.contains(entry.first); });
  }
  for (const auto& [number, file] : numbered_meshes) {
    sequence.frames.push_back({number, file, nullptr});
  }
  LB_RETURN_IF_ERROR(AddVelocities(numbered_velocities, numbered_meshes, sequence));
  return sequence;
}

}  // namespace liquidblend::ingest
