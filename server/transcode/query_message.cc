#include "server/transcode/query_message.h"

#include <google/protobuf/descriptor.h>
#include <google/protobuf/util/time_util.h>

#include <cstdint>
#include <string_view>
#include <utility>

#include "absl/strings/ascii.h"
#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_split.h"

namespace liquidblend::transcode {
namespace {

using google::protobuf::FieldDescriptor;
using google::protobuf::Message;
using google::protobuf::Reflection;
using google::protobuf::util::TimeUtil;

constexpr size_t kMaxShown = 40;

const FieldDescriptor* FieldOf(const Message& message, const std::string& name) {
  const google::protobuf::Descriptor& type = *message.GetDescriptor();
  const FieldDescriptor* field = type.FindFieldByName(name);
  return field != nullptr ? field : type.FindFieldByCamelcaseName(name);
}

// The message and the field that a dotted name leads to; no field: there is none.
std::pair<Message*, const FieldDescriptor*> Follow(const std::string& name, Message& message) {
  Message* holder = &message;
  const std::vector<std::string> parts = absl::StrSplit(name, '.');
  for (size_t k = 0;; ++k) {
    const FieldDescriptor* field = FieldOf(*holder, parts[k]);
    if (k + 1 == parts.size() || field == nullptr) return {holder, field};
    const bool is_message =
        !field->is_repeated() && field->cpp_type() == FieldDescriptor::CPPTYPE_MESSAGE;
    if (!is_message) return {holder, nullptr};
    holder = holder->GetReflection()->MutableMessage(holder, field);
  }
}

// Sets or adds one value of a field.
class ValueSetter {
 public:
  ValueSetter(Message& message, const FieldDescriptor& field)
      : message_(message), reflection_(*message.GetReflection()), field_(field) {}

  // What a value has to be; empty: it is set.
  std::string Set(const std::string& text) {
    switch (field_.cpp_type()) {
      case FieldDescriptor::CPPTYPE_INT32:
        return Number<int32_t>(text, &Reflection::SetInt32, &Reflection::AddInt32);
      case FieldDescriptor::CPPTYPE_INT64:
        return Number<int64_t>(text, &Reflection::SetInt64, &Reflection::AddInt64);
      case FieldDescriptor::CPPTYPE_UINT32:
        return Number<uint32_t>(text, &Reflection::SetUInt32, &Reflection::AddUInt32);
      case FieldDescriptor::CPPTYPE_UINT64:
        return Number<uint64_t>(text, &Reflection::SetUInt64, &Reflection::AddUInt64);
      case FieldDescriptor::CPPTYPE_DOUBLE:
        return Real<double>(text, &Reflection::SetDouble, &Reflection::AddDouble);
      case FieldDescriptor::CPPTYPE_FLOAT:
        return Real<float>(text, &Reflection::SetFloat, &Reflection::AddFloat);
      case FieldDescriptor::CPPTYPE_BOOL:
        return Bool(text);
      case FieldDescriptor::CPPTYPE_ENUM:
        return Enum(text);
      case FieldDescriptor::CPPTYPE_STRING:
        return Text(text);
      case FieldDescriptor::CPPTYPE_MESSAGE:
        return Time(text);
    }
    return kNotInQueries;
  }

 private:
  static constexpr char kNotInQueries[] = "cannot stand in a query";

  template <typename Value, typename SetValue, typename AddValue>
  std::string Put(SetValue set, AddValue add, Value value) {
    field_.is_repeated() ? (reflection_.*add)(&message_, &field_, std::move(value))
                         : (reflection_.*set)(&message_, &field_, std::move(value));
    return "";
  }

  template <typename Value, typename SetValue, typename AddValue>
  std::string Number(const std::string& text, SetValue set, AddValue add) {
    Value value = 0;
    if (!absl::SimpleAtoi(text, &value)) return "must be a whole number";
    return Put(set, add, value);
  }

  template <typename Value, typename SetValue, typename AddValue>
  std::string Real(const std::string& text, SetValue set, AddValue add) {
    double value = 0;
    if (!absl::SimpleAtod(text, &value)) return "must be a number";
    return Put(set, add, static_cast<Value>(value));
  }

  std::string Bool(const std::string& text) {
    const bool is_yes = text == "true" || text == "1";
    if (!is_yes && text != "false" && text != "0") return "must be true or false";
    return Put(&Reflection::SetBool, &Reflection::AddBool, is_yes);
  }

  std::string Enum(const std::string& text) {
    const google::protobuf::EnumValueDescriptor* value =
        field_.enum_type()->FindValueByName(absl::AsciiStrToUpper(text));
    int number = 0;
    if (value != nullptr) {
      number = value->number();
    } else if (!absl::SimpleAtoi(text, &number)) {
      return absl::StrCat("must be one of ", NamesOf(*field_.enum_type()));
    }
    return Put(&Reflection::SetEnumValue, &Reflection::AddEnumValue, number);
  }

  static std::string NamesOf(const google::protobuf::EnumDescriptor& type) {
    std::string names;
    for (int k = 0; k < type.value_count(); ++k) {
      if (type.value(k)->number() == 0) continue;
      absl::StrAppend(&names, names.empty() ? "" : ", ", type.value(k)->name());
    }
    return names;
  }

  std::string Text(const std::string& text) {
    if (field_.type() == FieldDescriptor::TYPE_BYTES) return kNotInQueries;
    return Put(&Reflection::SetString, &Reflection::AddString, text);
  }

  std::string Time(const std::string& text) {
    if (field_.is_repeated()) return kNotInQueries;
    const std::string& type = field_.message_type()->full_name();
    Message& value = *reflection_.MutableMessage(&message_, &field_);
    if (auto* duration = dynamic_cast<google::protobuf::Duration*>(&value)) {
      return TimeUtil::FromString(text, duration) ? "" : "must be a duration, such as 5s";
    }
    if (auto* timestamp = dynamic_cast<google::protobuf::Timestamp*>(&value)) {
      return TimeUtil::FromString(text, timestamp) ? "" : "must be an RFC 3339 time";
    }
    return absl::StrCat("is a ", type.substr(type.rfind('.') + 1), ": name one of its fields");
  }

  Message& message_;
  const Reflection& reflection_;
  const FieldDescriptor& field_;
};

}  // namespace

void SetField(const QueryField& query, Message& message, server::FieldViolations& violations) {
  const auto [holder, field] = Follow(query.name, message);
  const std::string name = query.name.substr(0, 2 * kMaxShown);
  if (field == nullptr) return violations.Add(name, "is not a field of this query");
  ValueSetter setter(*holder, *field);
  std::vector<std::string> values = {query.value};
  if (field->is_repeated()) values = absl::StrSplit(query.value, ',');
  for (const std::string& value : values) {
    const std::string rule = setter.Set(value);
    if (rule.empty()) continue;
    return violations.Add(name, absl::StrCat(rule, ", got '", value.substr(0, kMaxShown), "'"));
  }
}

}  // namespace liquidblend::transcode
