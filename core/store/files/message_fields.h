// Fields of a message by name, of the types that figures and options have.
// Requires: the message has a field of this name and of the value's type.
#pragma once

#include <google/protobuf/message.h>

#include <cstdint>
#include <span>
#include <vector>

namespace liquidblend::store {

using google::protobuf::Message;

void SetField(const char* name, bool value, Message& message);
void SetField(const char* name, int32_t value, Message& message);
void SetField(const char* name, int64_t value, Message& message);
void SetField(const char* name, uint64_t value, Message& message);
void SetField(const char* name, double value, Message& message);
void SetField(const char* name, std::span<const double> values, Message& message);

// Returns false and leaves the value as it is if the field is not set, which one that is 0 without
// being optional never is.
bool GetField(const char* name, const Message& message, bool& value);
bool GetField(const char* name, const Message& message, int32_t& value);
bool GetField(const char* name, const Message& message, int64_t& value);
bool GetField(const char* name, const Message& message, uint64_t& value);
bool GetField(const char* name, const Message& message, double& value);
// As many as both have; the others stay as they are.
bool GetField(const char* name, const Message& message, std::span<double> values);
bool GetField(const char* name, const Message& message, std::vector<double>& values);

}  // namespace liquidblend::store
