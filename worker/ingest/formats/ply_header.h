// Header of a PLY file: the text in front of its data.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "absl/status/statusor.h"

namespace liquidblend::ingest {

enum class PlyEncoding { kAscii, kLittleEndian, kBigEndian };

enum class PlyType { kInt8, kUint8, kInt16, kUint16, kInt32, kUint32, kFloat32, kFloat64 };

// Bytes of one number.
int PlyTypeSize(PlyType type);
inline bool IsInteger(PlyType type) { return type < PlyType::kFloat32; }

struct PlyProperty {
  std::string name;
  PlyType type = PlyType::kFloat32;  // of the number, or of each entry of the list
  bool is_list = false;
  PlyType count_type = PlyType::kUint8;  // of the list's length; an integer type
};

struct PlyElement {
  std::string name;
  int32_t count = 0;                    // >= 0
  std::vector<PlyProperty> properties;  // at least one, names are unique

  // Index of a property, or -1.
  int Find(std::string_view property_name) const;
};

struct PlyHeader {
  PlyEncoding encoding = PlyEncoding::kAscii;
  std::vector<PlyElement> elements;  // in the file's order, names are unique
  size_t size = 0;                   // bytes of the header, its last line end included
};

// Errors: kInvalidArgument, kDataLoss if the header does not end; the message holds the line.
absl::StatusOr<PlyHeader> ReadPlyHeader(std::string_view file);

}  // namespace liquidblend::ingest
