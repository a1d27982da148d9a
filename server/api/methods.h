// The methods of the API: whom each is for, and its limits, on every wire.
#pragma once

#include <google/protobuf/descriptor.h>
#include <google/protobuf/message.h>

#include <cstdint>
#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "absl/strings/string_view.h"
#include "server/access/principal.h"
#include "server/base/errors.h"

namespace liquidblend::server {

enum class Effect { kReads, kChanges };  // changes are logged, reads only with --verbose
enum class Span { kShort, kLasts };      // calls that last count against max_streams

struct Method {
  const char* name;            // as in the proto
  std::optional<Scope> scope;  // none: any principal
  Effect effect = Effect::kReads;
  Span span = Span::kShort;
  // Size limit of a request; it is kept for as long as the call lasts.
  int64_t max_request_bytes = kMaxSmallRequestBytes;
};

inline constexpr Method kUploadAnimation = {"UploadAnimation", Scope::kWrite, Effect::kChanges,
                                            Span::kLasts};
inline constexpr Method kPresignUpload = {"PresignUpload", Scope::kWrite};
inline constexpr Method kPresignDownload = {"PresignDownload", Scope::kFrames};
inline constexpr Method kReadFile = {"ReadFile", Scope::kFrames};
inline constexpr Method kImportAnimation = {"ImportAnimation", Scope::kWrite, Effect::kChanges,
                                            Span::kLasts,
                                            int64_t{256} << 10};  // 20,000 times of frames
inline constexpr Method kGetAnimation = {"GetAnimation", std::nullopt};
inline constexpr Method kGetAnimationFrame = {"GetAnimationFrame", Scope::kFrames};
inline constexpr Method kListAnimations = {"ListAnimations", std::nullopt};
inline constexpr Method kDeleteAnimation = {"DeleteAnimation", Scope::kWrite, Effect::kChanges};
inline constexpr Method kRegisterFamily = {
    "RegisterFamily", Scope::kRegister, Effect::kChanges, Span::kShort,
    std::numeric_limits<int64_t>::max()};  // the wire's limit: correspondences are many
inline constexpr Method kGetFamily = {"GetFamily", std::nullopt};
inline constexpr Method kListFamilies = {"ListFamilies", std::nullopt};
inline constexpr Method kRollbackFamily = {"RollbackFamily", Scope::kRegister, Effect::kChanges};
inline constexpr Method kDeleteFamily = {"DeleteFamily", Scope::kRegister, Effect::kChanges};
inline constexpr Method kMeasureCorrespondences = {"MeasureCorrespondences", Scope::kFrames};
inline constexpr Method kWatchOperation = {"WatchOperation", std::nullopt, Effect::kReads,
                                           Span::kLasts};
inline constexpr Method kGetFrame = {"GetFrame", Scope::kFrames};
inline constexpr Method kStreamFrames = {"StreamFrames", Scope::kFrames, Effect::kReads,
                                         Span::kLasts};
inline constexpr Method kListOperations = {"ListOperations", std::nullopt};
inline constexpr Method kGetOperation = {"GetOperation", std::nullopt};
inline constexpr Method kDeleteOperation = {"DeleteOperation", Scope::kRegister, Effect::kChanges};
inline constexpr Method kCancelOperation = {"CancelOperation", Scope::kRegister, Effect::kChanges};
inline constexpr Method kWaitOperation = {"WaitOperation", std::nullopt, Effect::kReads,
                                          Span::kLasts};

// Whether `method` is this one of the table.
inline bool IsSame(const Method& method, const Method& other) {
  return absl::string_view(method.name) == other.name;
}

// The services that have these methods.
std::vector<const google::protobuf::ServiceDescriptor*> ApiServices();

// Null if there is none of this name.
const Method* FindMethod(absl::string_view name);

// The full name of the method's service: "liquidblend.v1.LiquidBlend".
std::string ServiceOf(const Method& method);

// The resource that a request names (animations/{id} and the like), for errors and the log; empty
// if it names none.
std::string ResourceOf(const google::protobuf::Message& request);

}  // namespace liquidblend::server
