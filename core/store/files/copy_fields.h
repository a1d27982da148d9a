// Copies between messages of the store and of the API that mean the same.
#pragma once

#include <google/protobuf/message.h>

namespace liquidblend::store {

// The field of `to` that CopyFields() copies `from` to: one of the same name and type, repeated if
// that is. All enums count as one type, and so do all messages. Null if there is none.
const google::protobuf::FieldDescriptor* FindTwin(const google::protobuf::FieldDescriptor& from,
                                                  const google::protobuf::Descriptor& to);

// Sets the fields of `to` that have a twin in `from`, and clears those whose twin is not set; the
// others stay. Enums are copied by number, messages field by field.
void CopyFields(const google::protobuf::Message& from, google::protobuf::Message& to);

template <typename To>
To CopyOf(const google::protobuf::Message& from) {
  To to;
  CopyFields(from, to);
  return to;
}

}  // namespace liquidblend::store
