#include "worker/ingest/frame_files.h"

#include <algorithm>
#include <map>
#include <string>

#include "absl/strings/ascii.h"
#include "absl/strings/escaping.h"
#include "absl/strings/match.h"
#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "core/base/status_macros.h"

namespace liquidblend::ingest {
namespace {

constexpr char kMetaName[] = "meta.json";
constexpr char kVelocityPrefix[] = "lVelMesh";
constexpr char kVelocityExtension[] = ".uni";
constexpr size_t kMaxDigits = 9;  // of a frame number, so that it fits an int

struct FormatName {
  Format format;
  const char* extension;
};
constexpr FormatName kFormats[] = {
    {Format::kMantaflow, ".bobj.gz"}, {Format::kPly, ".ply"}, {Format::kObj, ".obj"}};

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

// The digits right before the extension.
absl::StatusOr<int> FrameNumber(const InputFile& file, absl::string_view extension) {
  absl::string_view stem = file.name;
  stem.remove_suffix(extension.size());
  size_t num_digits = 0;
  while (num_digits < stem.size() && absl::ascii_isdigit(stem[stem.size() - 1 - num_digits])) {
    ++num_digits;
  }
  int number = 0;
  if (num_digits == 0 || num_digits > kMaxDigits ||
      !absl::SimpleAtoi(stem.substr(stem.size() - num_digits), &number)) {
    return absl::InvalidArgumentError(absl::StrCat(Shown(file), ": no frame number of 1 to ",
                                                   kMaxDigits, " digits before ",
                                                   std::string(extension)));
  }
  return number;
}

absl::StatusOr<Format> FindFormat(std::span<const InputFile> files) {
  Format found = Format::kAny;
  const InputFile* example = nullptr;
  for (const FormatName& entry : kFormats) {
    const auto file = std::find_if(files.begin(), files.end(), [&](const InputFile& f) {
      return IsMesh(f.name, entry.format);
    });
    if (file == files.end()) continue;
    if (example != nullptr) {
      return absl::InvalidArgumentError(absl::StrCat("files of several formats, ", Shown(*example),
                                                     " and ", Shown(*file),
                                                     ": say which format to read"));
    }
    found = entry.format;
    example = &*file;
  }
  if (example != nullptr) return found;
  return absl::InvalidArgumentError(
      absl::StrCat("none of the ", files.size(), " files is a frame (.bobj.gz, .ply or .obj)"));
}

absl::Status AddFile(const InputFile& file, absl::string_view extension,
                     std::map<int, const InputFile*>& by_number) {
  LB_ASSIGN_OR_RETURN(const int number, FrameNumber(file, extension));
  const auto [entry, is_new] = by_number.try_emplace(number, &file);
  if (is_new) return absl::OkStatus();
  return absl::InvalidArgumentError(absl::StrCat(
      "frame ", number, " is there twice: ", Shown(*entry->second), " and ", Shown(file)));
}

// Every mesh has velocities, or none has; no velocities lack their mesh.
absl::Status AddVelocities(const std::map<int, const InputFile*>& velocities,
                           FrameSequence& sequence) {
  if (velocities.empty()) return absl::OkStatus();
  for (FrameFiles& frame : sequence.frames) {
    const auto found = velocities.find(frame.number);
    if (found == velocities.end()) {
      return absl::InvalidArgumentError(absl::StrCat(
          "frame ", frame.number, ": ", Shown(*frame.mesh),
          " has no velocities, but other frames have (", Shown(*velocities.begin()->second), ")"));
    }
    frame.velocities = found->second;
  }
  for (const auto& [number, file] : velocities) {
    if (number >= sequence.frames.front().number && number <= sequence.frames.back().number)
      continue;
    return absl::InvalidArgumentError(
        absl::StrCat("frame ", number, ": ", Shown(*file), " has no mesh"));
  }
  return absl::OkStatus();
}

absl::Status CheckNoGap(const std::vector<FrameFiles>& frames) {
  for (size_t k = 1; k < frames.size(); ++k) {
    if (frames[k].number == frames[k - 1].number + 1) continue;
    return absl::InvalidArgumentError(
        absl::StrCat("frame ", frames[k - 1].number + 1, " is missing: ", Shown(*frames[k].mesh),
                     " comes right after ", Shown(*frames[k - 1].mesh)));
  }
  return absl::OkStatus();
}

}  // namespace

bool IsInputName(absl::string_view name) {
  return name == kMetaName || IsVelocities(name) ||
         std::any_of(std::begin(kFormats), std::end(kFormats),
                     [&](const FormatName& entry) { return IsMesh(name, entry.format); });
}

std::string Shown(const InputFile& file) { return absl::Utf8SafeCHexEscape(file.name); }

absl::StatusOr<FrameSequence> FindFrames(std::span<const InputFile> files, Format format) {
  FrameSequence sequence;
  sequence.format = format;
  if (format == Format::kAny) {
    LB_ASSIGN_OR_RETURN(sequence.format, FindFormat(files));
  }
  std::map<int, const InputFile*> meshes;
  std::map<int, const InputFile*> velocities;
  for (const InputFile& file : files) {
    if (file.name == kMetaName) {
      sequence.meta = &file;
    } else if (IsMesh(file.name, sequence.format)) {
      LB_RETURN_IF_ERROR(AddFile(file, Extension(sequence.format), meshes));
    } else if (sequence.format == Format::kMantaflow && IsVelocities(file.name)) {
      LB_RETURN_IF_ERROR(AddFile(file, kVelocityExtension, velocities));
    }
  }
  if (meshes.empty()) {
    return absl::InvalidArgumentError(absl::StrCat(
        "none of the ", files.size(), " files is a frame (", Extension(sequence.format), ")"));
  }
  for (const auto& [number, file] : meshes) sequence.frames.push_back({number, file, nullptr});
  LB_RETURN_IF_ERROR(CheckNoGap(sequence.frames));
  LB_RETURN_IF_ERROR(AddVelocities(velocities, sequence));
  return sequence;
}

}  // namespace liquidblend::ingest
