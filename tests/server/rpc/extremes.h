// Every numeric field of a message type, however deep, and the numbers that break things; so that
// fields that are new are tried by themselves.
#pragma once

#include <google/protobuf/message.h>
#include <time.h>

#include <cstdint>
#include <fstream>
#include <limits>
#include <string>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/time/clock.h"
#include "google/protobuf/descriptor.h"

namespace liquidblend::rpc {

using google::protobuf::FieldDescriptor;
using google::protobuf::Message;

// From the message down to the number.
using FieldPath = std::vector<const FieldDescriptor*>;

inline std::string NameOf(const FieldPath& path) {
  std::string name;
  for (const FieldDescriptor* field : path) {
    absl::StrAppend(&name, name.empty() ? "" : ".", field->name());
  }
  return name;
}

inline void AddNumericFields(const google::protobuf::Descriptor& type, const FieldPath& parents,
                             std::vector<FieldPath>& paths) {
  constexpr size_t kMaxDepth = 6;
  if (parents.size() == kMaxDepth) return;
  for (int k = 0; k < type.field_count(); ++k) {
    const FieldDescriptor* field = type.field(k);
    FieldPath path = parents;
    path.push_back(field);
    if (field->cpp_type() == FieldDescriptor::CPPTYPE_MESSAGE) {
      AddNumericFields(*field->message_type(), path, paths);
    } else if (field->cpp_type() != FieldDescriptor::CPPTYPE_STRING &&
               field->cpp_type() != FieldDescriptor::CPPTYPE_BOOL) {
      paths.push_back(path);
    }
  }
}

// Integers and enums as well, but no truth values.
inline std::vector<FieldPath> NumericFieldsOf(const google::protobuf::Descriptor& type) {
  std::vector<FieldPath> paths;
  AddNumericFields(type, {}, paths);
  return paths;
}

inline std::vector<double> ExtremeNumbers() {
  using Limits = std::numeric_limits<double>;
  return {0.0,
          -0.0,
          1.0,
          -1.0,
          Limits::denorm_min(),
          -Limits::denorm_min(),
          1e-15,
          1e-10,
          Limits::min(),
          Limits::max(),
          Limits::lowest(),
          Limits::infinity(),
          -Limits::infinity(),
          Limits::quiet_NaN(),
          0x1p31,
          0x1p63};
}

inline std::vector<int64_t> ExtremeIntegers() {
  return {0,
          1,
          -1,
          std::numeric_limits<int32_t>::max(),
          std::numeric_limits<int32_t>::min(),
          int64_t{1} << 31,
          int64_t{1} << 62,
          std::numeric_limits<int64_t>::max(),
          std::numeric_limits<int64_t>::min()};
}

inline bool IsFloating(const FieldDescriptor& field) {
  return field.cpp_type() == FieldDescriptor::CPPTYPE_DOUBLE ||
         field.cpp_type() == FieldDescriptor::CPPTYPE_FLOAT;
}

inline size_t NumExtremesOf(const FieldPath& path) {
  return IsFloating(*path.back()) ? ExtremeNumbers().size() : ExtremeIntegers().size();
}

// The message that holds the last field of the path; those on the way are made, or the first ones
// of repeated fields are taken.
inline Message& HolderOf(Message& message, const FieldPath& path) {
  Message* holder = &message;
  for (size_t k = 0; k + 1 < path.size(); ++k) {
    const auto* reflection = holder->GetReflection();
    if (!path[k]->is_repeated()) {
      holder = reflection->MutableMessage(holder, path[k]);
    } else if (reflection->FieldSize(*holder, path[k]) > 0) {
      holder = reflection->MutableRepeatedMessage(holder, path[k], 0);
    } else {
      holder = reflection->AddMessage(holder, path[k]);
    }
  }
  return *holder;
}

// Sets it, or of a repeated field the only element. Returns the value as text.
inline std::string SetExtreme(Message& message, const FieldPath& path, size_t number) {
  Message& holder = HolderOf(message, path);
  const FieldDescriptor* field = path.back();
  const auto* reflection = holder.GetReflection();
  if (field->is_repeated()) reflection->ClearField(&holder, field);
  const auto put = [&](auto set, auto add, auto value) {
    field->is_repeated() ? (reflection->*add)(&holder, field, value)
                         : (reflection->*set)(&holder, field, value);
    return absl::StrCat(value);
  };
  using Reflection = google::protobuf::Reflection;
  const double real = IsFloating(*field) ? ExtremeNumbers()[number] : 0;
  const int64_t whole = IsFloating(*field) ? 0 : ExtremeIntegers()[number];
  switch (field->cpp_type()) {
    case FieldDescriptor::CPPTYPE_DOUBLE:
      return put(&Reflection::SetDouble, &Reflection::AddDouble, real);
    case FieldDescriptor::CPPTYPE_FLOAT:
      return put(&Reflection::SetFloat, &Reflection::AddFloat, static_cast<float>(real));
    case FieldDescriptor::CPPTYPE_INT32:
      return put(&Reflection::SetInt32, &Reflection::AddInt32, static_cast<int32_t>(whole));
    case FieldDescriptor::CPPTYPE_UINT32:
      return put(&Reflection::SetUInt32, &Reflection::AddUInt32, static_cast<uint32_t>(whole));
    case FieldDescriptor::CPPTYPE_INT64:
      return put(&Reflection::SetInt64, &Reflection::AddInt64, whole);
    case FieldDescriptor::CPPTYPE_UINT64:
      return put(&Reflection::SetUInt64, &Reflection::AddUInt64, static_cast<uint64_t>(whole));
    case FieldDescriptor::CPPTYPE_ENUM:
      return put(&Reflection::SetEnumValue, &Reflection::AddEnumValue, static_cast<int>(whole));
    default:
      return "";
  }
}

// Of this process.
inline int64_t ResidentBytes() {
  int64_t num_pages = 0;
  int64_t num_resident = 0;
  std::ifstream("/proc/self/statm") >> num_pages >> num_resident;
  return num_resident * 4096;
}

// What this process computes within a second in which nobody asks it for anything.
inline absl::Duration IdleCpuTime() {
  const auto cpu_time = [] {
    timespec now = {};
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
    return absl::DurationFromTimespec(now);
  };
  const absl::Duration before = cpu_time();
  absl::SleepFor(absl::Seconds(1));
  return cpu_time() - before;
}

// Generous: a thread that spins takes a second, an idle server some milliseconds.
constexpr absl::Duration kMaxIdleCpu = absl::Milliseconds(400);
constexpr int64_t kMaxGrowthBytes = int64_t{200} << 20;

}  // namespace liquidblend::rpc
