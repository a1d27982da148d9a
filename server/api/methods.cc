#include "server/api/methods.h"

#include "google/longrunning/operations.pb.h"
#include "liquidblend/v1/liquidblend.pb.h"
#include "server/base/names.h"

namespace liquidblend::server {
namespace {

constexpr size_t kMaxResourceLength = 80;

constexpr const Method* kMethods[] = {
    &kUploadAnimation,   &kPresignUpload,   &kPresignDownload,
    &kReadFile,          &kImportAnimation, &kGetAnimation,
    &kGetAnimationFrame, &kListAnimations,  &kDeleteAnimation,
    &kRegisterFamily,    &kGetFamily,       &kListFamilies,
    &kRollbackFamily,    &kDeleteFamily,    &kMeasureCorrespondences,
    &kWatchOperation,    &kGetFrame,        &kStreamFrames,
    &kListOperations,    &kGetOperation,    &kDeleteOperation,
    &kCancelOperation,   &kWaitOperation};

}  // namespace

std::vector<const google::protobuf::ServiceDescriptor*> ApiServices() {
  return {v1::Family::descriptor()->file()->service(0),
          google::longrunning::Operation::descriptor()->file()->service(0)};
}

const Method* FindMethod(absl::string_view name) {
  for (const Method* method : kMethods) {
    if (method->name == name) return method;
  }
  return nullptr;
}

std::string ServiceOf(const Method& method) {
  for (const google::protobuf::ServiceDescriptor* service : ApiServices()) {
    if (service->FindMethodByName(method.name) != nullptr) return service->full_name();
  }
  return "";
}

std::string ResourceOf(const google::protobuf::Message& request) {
  const google::protobuf::Descriptor& type = *request.GetDescriptor();
  for (const char* field : {"name", "family", "animation", "family_id", "animation_id"}) {
    const google::protobuf::FieldDescriptor* found = type.FindFieldByName(field);
    if (found == nullptr ||
        found->cpp_type() != google::protobuf::FieldDescriptor::CPPTYPE_STRING ||
        found->is_repeated()) {
      continue;
    }
    const std::string value =
        CleanText(request.GetReflection()->GetString(request, found), kMaxResourceLength);
    if (value.empty()) return "";
    if (absl::string_view(field) == "family_id") return FamilyName(value);
    if (absl::string_view(field) == "animation_id") return AnimationName(value);
    return value;
  }
  return "";
}

}  // namespace liquidblend::server
