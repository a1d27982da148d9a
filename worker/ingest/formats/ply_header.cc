#include "worker/ingest/formats/ply_header.h"

#include <algorithm>
#include <limits>
#include <utility>

#include "absl/strings/str_cat.h"
#include "core/base/status_macros.h"
#include "worker/ingest/formats/text.h"

namespace liquidblend::ingest {
namespace {

constexpr size_t kMaxHeaderSize = 1 << 16;  // bytes
constexpr size_t kMaxElements = 64;
constexpr size_t kMaxProperties = 256;  // per element

struct TypeName {
  std::string_view name;
  PlyType type;
};
constexpr TypeName kTypeNames[] = {
    {"char", PlyType::kInt8},      {"int8", PlyType::kInt8},       {"uchar", PlyType::kUint8},
    {"uint8", PlyType::kUint8},    {"short", PlyType::kInt16},     {"int16", PlyType::kInt16},
    {"ushort", PlyType::kUint16},  {"uint16", PlyType::kUint16},   {"int", PlyType::kInt32},
    {"int32", PlyType::kInt32},    {"uint", PlyType::kUint32},     {"uint32", PlyType::kUint32},
    {"float", PlyType::kFloat32},  {"float32", PlyType::kFloat32}, {"double", PlyType::kFloat64},
    {"float64", PlyType::kFloat64}};

absl::Status Bad(std::string_view what, std::string_view word) {
  return absl::InvalidArgumentError(
      absl::StrCat("PLY header: ", std::string(what), " ", Quoted(word)));
}

absl::StatusOr<PlyType> ParseType(std::string_view word) {
  for (const TypeName& entry : kTypeNames) {
    if (entry.name == word) return entry.type;
  }
  return Bad("unknown type", word);
}

absl::StatusOr<PlyEncoding> ParseFormat(std::string_view words) {
  const std::string_view encoding = NextWord(words);
  const std::string_view version = NextWord(words);
  if (version != "1.0") return Bad("unknown format version", version);
  if (encoding == "ascii") return PlyEncoding::kAscii;
  if (encoding == "binary_little_endian") return PlyEncoding::kLittleEndian;
  if (encoding == "binary_big_endian") return PlyEncoding::kBigEndian;
  return Bad("unknown format", encoding);
}

absl::Status AddElement(std::string_view words, std::vector<PlyElement>& elements) {
  PlyElement element;
  element.name = std::string(NextWord(words));
  const std::string_view count_word = NextWord(words);
  int64_t count = 0;
  if (!ParseInteger(count_word, count) || count < 0 ||
      count > std::numeric_limits<int32_t>::max()) {
    return Bad(absl::StrCat("element ", Quoted(element.name), " has the count"), count_word);
  }
  element.count = static_cast<int32_t>(count);
  for (const PlyElement& other : elements) {
    if (other.name == element.name) return Bad("twice the element", element.name);
  }
  if (elements.size() == kMaxElements) return Bad("too many elements at", element.name);
  elements.push_back(std::move(element));
  return absl::OkStatus();
}

absl::Status AddProperty(std::string_view words, std::vector<PlyElement>& elements) {
  if (elements.empty()) return Bad("a property before any element:", words);
  PlyElement& element = elements.back();
  PlyProperty property;
  std::string_view word = NextWord(words);
  if (word == "list") {
    property.is_list = true;
    word = NextWord(words);
    LB_ASSIGN_OR_RETURN(property.count_type, ParseType(word));
    if (!IsInteger(property.count_type)) return Bad("a list's length of type", word);
    word = NextWord(words);
  }
  LB_ASSIGN_OR_RETURN(property.type, ParseType(word));
  property.name = std::string(NextWord(words));
  if (element.Find(property.name) >= 0) {
    return Bad(absl::StrCat("element ", Quoted(element.name), " has twice the property"),
               property.name);
  }
  if (element.properties.size() == kMaxProperties) {
    return Bad("too many properties at", property.name);
  }
  element.properties.push_back(std::move(property));
  return absl::OkStatus();
}

// Elements without properties take no bytes, so their count could be anything.
absl::Status CheckHeader(const PlyHeader& header, bool has_format) {
  if (!has_format) return absl::InvalidArgumentError("PLY header: no format line");
  for (const PlyElement& element : header.elements) {
    if (element.properties.empty() && element.count > 0) {
      return Bad("no property in element", element.name);
    }
  }
  return absl::OkStatus();
}

}  // namespace

int PlyTypeSize(PlyType type) {
  constexpr int kSize[] = {1, 1, 2, 2, 4, 4, 4, 8};
  return kSize[static_cast<int>(type)];
}

int PlyElement::Find(std::string_view property_name) const {
  const auto found = std::find_if(properties.begin(), properties.end(),
                                  [&](const PlyProperty& p) { return p.name == property_name; });
  return found == properties.end() ? -1 : static_cast<int>(found - properties.begin());
}

absl::StatusOr<PlyHeader> ReadPlyHeader(std::string_view file) {
  const std::string_view text = file.substr(0, kMaxHeaderSize);
  std::string_view rest = text;
  if (NextLine(rest) != "ply") {
    return absl::InvalidArgumentError("the file does not begin with a line \"ply\"");
  }
  PlyHeader header;
  bool has_format = false;
  while (!rest.empty()) {
    const bool is_whole = rest.find('\n') != std::string_view::npos;
    const std::string_view line = NextLine(rest);
    std::string_view words = line;
    const std::string_view keyword = NextWord(words);
    if (keyword == "end_header" && is_whole) {
      header.size = text.size() - rest.size();
      LB_RETURN_IF_ERROR(CheckHeader(header, has_format));
      return header;
    }
    if (!is_whole) break;
    if (keyword == "format") {
      LB_ASSIGN_OR_RETURN(header.encoding, ParseFormat(words));
      has_format = true;
    } else if (keyword == "element") {
      LB_RETURN_IF_ERROR(AddElement(words, header.elements));
    } else if (keyword == "property") {
      LB_RETURN_IF_ERROR(AddProperty(words, header.elements));
    } else if (keyword != "comment" && keyword != "obj_info" && !keyword.empty()) {
      return Bad("unknown line", line);
    }
  }
  return absl::DataLossError("the PLY header does not end");
}

}  // namespace liquidblend::ingest
