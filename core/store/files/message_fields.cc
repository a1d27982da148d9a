#include "core/store/files/message_fields.h"

#include <google/protobuf/reflection.h>

#include <algorithm>
#include <cassert>

namespace liquidblend::store {
namespace {

using google::protobuf::FieldDescriptor;
using google::protobuf::Reflection;
using google::protobuf::RepeatedFieldRef;

const FieldDescriptor* Find(const char* name, const Message& message) {
  const FieldDescriptor* field = message.GetDescriptor()->FindFieldByName(name);
  assert(field != nullptr);
  return field;
}

template <typename T>
bool Get(const char* name, const Message& message,
         T (Reflection::*get)(const Message&, const FieldDescriptor*) const, T& value) {
  const FieldDescriptor* field = Find(name, message);
  if (!message.GetReflection()->HasField(message, field)) return false;
  value = (message.GetReflection()->*get)(message, field);
  return true;
}

RepeatedFieldRef<double> ListOf(const char* name, const Message& message) {
  return message.GetReflection()->GetRepeatedFieldRef<double>(message, Find(name, message));
}

}  // namespace

void SetField(const char* name, bool value, Message& message) {
  message.GetReflection()->SetBool(&message, Find(name, message), value);
}

void SetField(const char* name, int32_t value, Message& message) {
  message.GetReflection()->SetInt32(&message, Find(name, message), value);
}

void SetField(const char* name, int64_t value, Message& message) {
  message.GetReflection()->SetInt64(&message, Find(name, message), value);
}

void SetField(const char* name, uint64_t value, Message& message) {
  message.GetReflection()->SetUInt64(&message, Find(name, message), value);
}

void SetField(const char* name, double value, Message& message) {
  message.GetReflection()->SetDouble(&message, Find(name, message), value);
}

void SetField(const char* name, std::span<const double> values, Message& message) {
  const auto list =
      message.GetReflection()->GetMutableRepeatedFieldRef<double>(&message, Find(name, message));
  list.Clear();
  for (const double value : values) list.Add(value);
}

bool GetField(const char* name, const Message& message, bool& value) {
  return Get(name, message, &Reflection::GetBool, value);
}

bool GetField(const char* name, const Message& message, int32_t& value) {
  return Get(name, message, &Reflection::GetInt32, value);
}

bool GetField(const char* name, const Message& message, int64_t& value) {
  return Get(name, message, &Reflection::GetInt64, value);
}

bool GetField(const char* name, const Message& message, uint64_t& value) {
  return Get(name, message, &Reflection::GetUInt64, value);
}

bool GetField(const char* name, const Message& message, double& value) {
  return Get(name, message, &Reflection::GetDouble, value);
}

bool GetField(const char* name, const Message& message, std::span<double> values) {
  const RepeatedFieldRef<double> list = ListOf(name, message);
  const size_t count = std::min<size_t>(list.size(), values.size());
  std::copy_n(list.begin(), count, values.begin());
  return !list.empty();
}

bool GetField(const char* name, const Message& message, std::vector<double>& values) {
  const RepeatedFieldRef<double> list = ListOf(name, message);
  if (!list.empty()) values.assign(list.begin(), list.end());
  return !list.empty();
}

}  // namespace liquidblend::store
