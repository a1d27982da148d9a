// Every numeric field of a message type, however deep, and the numbers that break things; so that
// fields that are new are tried by themselves.
#pragma once

#include <google/protobuf/message.h>
#include <time.h>

#include <algorithm>
#include <cstdint>
#include <fstream>
#include <limits>
#include <string>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/time/clock.h"
#include "google/protobuf/descriptor.h"
#include "tests/allocation_testing.h"

namespace liquidblend::server {

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
  using Double = std::numeric_limits<double>;
  return {0.0,
          -0.0,
          1.0,
          -1.0,
          Double::denorm_min(),
          -Double::denorm_min(),
          1e-15,
          1e-10,
          Double::min(),
          Double::max(),
          Double::lowest(),
          Double::infinity(),
          -Double::infinity(),
          Double::quiet_NaN(),
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

// Of an enumeration, all that it has and its neighbours, too.
inline std::vector<int64_t> ExtremeIntegersOf(const FieldDescriptor& field) {
  std::vector<int64_t> values = ExtremeIntegers();
  if (field.cpp_type() != FieldDescriptor::CPPTYPE_ENUM) return values;
  for (int k = 0; k < field.enum_type()->value_count(); ++k) {
    values.push_back(field.enum_type()->value(k)->number());
  }
  values.push_back(
      *std::max_element(values.end() - field.enum_type()->value_count(), values.end()) + 1);
  return values;
}

inline size_t NumExtremesOf(const FieldPath& path) {
  return IsFloating(*path.back()) ? ExtremeNumbers().size()
                                  : ExtremeIntegersOf(*path.back()).size();
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
  const int64_t whole = IsFloating(*field) ? 0 : ExtremeIntegersOf(*field)[number];
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

// Adds a field that no version of the API has to the message and to all that it holds.
inline void AddUnknownFields(Message& message, const std::string& bytes) {
  constexpr int kNoField = 15000;
  const auto* reflection = message.GetReflection();
  reflection->MutableUnknownFields(&message)->AddLengthDelimited(kNoField, bytes);
  std::vector<const FieldDescriptor*> fields;
  reflection->ListFields(message, &fields);
  for (const FieldDescriptor* field : fields) {
    if (field->cpp_type() != FieldDescriptor::CPPTYPE_MESSAGE) continue;
    if (!field->is_repeated()) {
      AddUnknownFields(*reflection->MutableMessage(&message, field), bytes);
    }
    for (int k = 0; field->is_repeated() && k < reflection->FieldSize(message, field); ++k) {
      AddUnknownFields(*reflection->MutableRepeatedMessage(&message, field, k), bytes);
    }
  }
}

// Of this process.
inline int64_t ResidentBytes() {
  int64_t num_pages = 0;
  int64_t num_resident = 0;
  std::ifstream("/proc/self/statm") >> num_pages >> num_resident;
  return num_resident * 4096;
}

// The most that was resident since ResetPeakMemory(), or since the start.
inline int64_t PeakBytes() {
  std::ifstream status("/proc/self/status");
  for (std::string line; std::getline(status, line);) {
    if (line.rfind("VmHWM:", 0) == 0) return std::stoll(line.substr(6)) * 1024;
  }
  return 0;
}
inline void ResetPeakMemory() { std::ofstream("/proc/self/clear_refs") << "5"; }

// What all threads of this process have computed.
inline absl::Duration CpuTime() {
  timespec now = {};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
  return absl::DurationFromTimespec(now);
}

// What this process computes within a second in which nobody asks it for anything.
inline absl::Duration IdleCpuTime() {
  const absl::Duration before = CpuTime();
  absl::SleepFor(absl::Seconds(1));
  return CpuTime() - before;
}

// Generous: a thread that spins takes a second, an idle server some milliseconds.
constexpr absl::Duration kMaxIdleCpu = absl::Milliseconds(400);
// Sanitizers take some ten times as long, and keep up to 256 MiB of what was freed;
// ThreadSanitizer has a shadow of that.
constexpr bool kIsSanitized = !allocation::kAllocationsMayFail;
constexpr int64_t kKeptBytes = kIsSanitized ? int64_t{768} << 20 : 0;
// Of one call, beside what its client computes.
constexpr absl::Duration kMaxCallCpu = absl::Seconds(kIsSanitized ? 15 : 1);
constexpr int64_t kMaxGrowthBytes = (int64_t{200} << 20) + kKeptBytes;

}  // namespace liquidblend::server
