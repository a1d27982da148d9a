#include "core/store/files/copy_fields.h"

#include <string>

namespace liquidblend::store {
namespace {

using google::protobuf::FieldDescriptor;
using google::protobuf::Message;
using google::protobuf::Reflection;

// One field of two messages.
struct Pair {
  const Message& from;
  const FieldDescriptor* from_field;
  Message& to;
  const FieldDescriptor* to_field;
  const Reflection& get = *from.GetReflection();
  const Reflection& set = *to.GetReflection();
};

void CopySingle(const Pair& pair) {
  const auto& [from, field, to, twin, get, set] = pair;
  switch (field->cpp_type()) {
    case FieldDescriptor::CPPTYPE_INT32:
      return set.SetInt32(&to, twin, get.GetInt32(from, field));
    case FieldDescriptor::CPPTYPE_INT64:
      return set.SetInt64(&to, twin, get.GetInt64(from, field));
    case FieldDescriptor::CPPTYPE_UINT32:
      return set.SetUInt32(&to, twin, get.GetUInt32(from, field));
    case FieldDescriptor::CPPTYPE_UINT64:
      return set.SetUInt64(&to, twin, get.GetUInt64(from, field));
    case FieldDescriptor::CPPTYPE_FLOAT:
      return set.SetFloat(&to, twin, get.GetFloat(from, field));
    case FieldDescriptor::CPPTYPE_DOUBLE:
      return set.SetDouble(&to, twin, get.GetDouble(from, field));
    case FieldDescriptor::CPPTYPE_BOOL:
      return set.SetBool(&to, twin, get.GetBool(from, field));
    case FieldDescriptor::CPPTYPE_ENUM:
      return set.SetEnumValue(&to, twin, get.GetEnumValue(from, field));
    case FieldDescriptor::CPPTYPE_STRING:
      return set.SetString(&to, twin, get.GetString(from, field));
    case FieldDescriptor::CPPTYPE_MESSAGE:
      return CopyFields(get.GetMessage(from, field), *set.MutableMessage(&to, twin));
  }
}

void AddElement(const Pair& pair, int n) {
  const auto& [from, field, to, twin, get, set] = pair;
  switch (field->cpp_type()) {
    case FieldDescriptor::CPPTYPE_INT32:
      return set.AddInt32(&to, twin, get.GetRepeatedInt32(from, field, n));
    case FieldDescriptor::CPPTYPE_INT64:
      return set.AddInt64(&to, twin, get.GetRepeatedInt64(from, field, n));
    case FieldDescriptor::CPPTYPE_UINT32:
      return set.AddUInt32(&to, twin, get.GetRepeatedUInt32(from, field, n));
    case FieldDescriptor::CPPTYPE_UINT64:
      return set.AddUInt64(&to, twin, get.GetRepeatedUInt64(from, field, n));
    case FieldDescriptor::CPPTYPE_FLOAT:
      return set.AddFloat(&to, twin, get.GetRepeatedFloat(from, field, n));
    case FieldDescriptor::CPPTYPE_DOUBLE:
      return set.AddDouble(&to, twin, get.GetRepeatedDouble(from, field, n));
    case FieldDescriptor::CPPTYPE_BOOL:
      return set.AddBool(&to, twin, get.GetRepeatedBool(from, field, n));
    case FieldDescriptor::CPPTYPE_ENUM:
      return set.AddEnumValue(&to, twin, get.GetRepeatedEnumValue(from, field, n));
    case FieldDescriptor::CPPTYPE_STRING:
      return set.AddString(&to, twin, get.GetRepeatedString(from, field, n));
    case FieldDescriptor::CPPTYPE_MESSAGE:
      return CopyFields(get.GetRepeatedMessage(from, field, n), *set.AddMessage(&to, twin));
  }
}

}  // namespace

const FieldDescriptor* FindTwin(const FieldDescriptor& from,
                                const google::protobuf::Descriptor& to) {
  const FieldDescriptor* twin = to.FindFieldByName(from.name());
  if (twin == nullptr) return nullptr;
  const bool is_alike =
      twin->cpp_type() == from.cpp_type() && twin->is_repeated() == from.is_repeated();
  return is_alike ? twin : nullptr;
}

void CopyFields(const Message& from, Message& to) {
  if (from.GetDescriptor() == to.GetDescriptor()) return to.CopyFrom(from);
  for (int n = 0; n < from.GetDescriptor()->field_count(); ++n) {
    const FieldDescriptor* field = from.GetDescriptor()->field(n);
    const FieldDescriptor* twin = FindTwin(*field, *to.GetDescriptor());
    if (twin == nullptr) continue;
    const Pair pair{from, field, to, twin};
    pair.set.ClearField(&to, twin);
    if (field->is_repeated()) {
      const int count = pair.get.FieldSize(from, field);
      for (int element = 0; element < count; ++element) AddElement(pair, element);
    } else if (pair.get.HasField(from, field)) {
      CopySingle(pair);
    }
  }
}

}  // namespace liquidblend::store
