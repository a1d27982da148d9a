// Imports and registrations: requests, and what becomes of them.
#include <cmath>
#include <optional>
#include <string>
#include <utility>

#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "absl/time/time.h"
#include "client/c/error.h"
#include "client/c/handles.h"
#include "client/c/structs.h"
#include "client/src/status_macros.h"

namespace liquidblend::c_api {
namespace {

std::unique_ptr<lb_operation> MakeOperation(Operation operation) {
  auto handle = std::make_unique<lb_operation>();
  handle->result_message = std::string(operation.result.message());
  handle->reason = operation.error_reason;
  handle->operation = std::move(operation);
  return handle;
}

absl::StatusOr<UploadRequest> UploadOf(const lb_import_request& request) {
  UploadRequest upload;
  upload.animation = TextOf(request.animation);
  if (request.directory == nullptr) return InvalidArgument("request.directory", "is NULL");
  ImportOptions& options = upload.options;
  options.pattern = TextOf(request.pattern);
  LBC_ASSIGN_OR_RETURN(upload.files, ListAnimationFiles(request.directory, options.pattern));
  options.frames_per_second = request.frames_per_second;
  options.vertex_scale = request.vertex_scale;
  options.velocity_scale = request.velocity_scale;
  options.voxel_size_m = request.voxel_size_m;
  if (request.up < LB_UP_UNKNOWN || request.up > LB_UP_MINUS_Z) {
    return InvalidArgument("request.up", "is not a direction");
  }
  options.up = static_cast<Up>(request.up);
  options.allow_gaps = request.allow_gaps != 0;
  upload.priority = request.priority;
  return upload;
}

Event EventOf(const double (&position)[3], double time_s) {
  return {{position[0], position[1], position[2]}, time_s};
}

absl::Status AddCorrespondence(const lb_correspondence* given, RegisterRequest& request) {
  lb_correspondence pair;
  LBC_RETURN_IF_ERROR(Read(given, "a correspondence", pair));
  if (pair.target < 0 || static_cast<size_t>(pair.target) >= request.targets.size()) {
    return absl::InvalidArgumentError(absl::StrCat("a correspondence is of target ", pair.target,
                                                   ", of ", request.targets.size()));
  }
  if (pair.kind < 0 || pair.kind > 2) {
    return absl::InvalidArgumentError(absl::StrCat("a correspondence has kind ", pair.kind));
  }
  Correspondence correspondence;
  correspondence.kind = static_cast<CorrespondenceKind>(pair.kind);
  correspondence.hard = pair.hard != 0;
  correspondence.source = EventOf(pair.source_position, pair.source_time_s);
  correspondence.target = EventOf(pair.target_position, pair.target_time_s);
  correspondence.length_s = pair.length_s;
  request.correspondences[static_cast<size_t>(pair.target)].push_back(correspondence);
  return absl::OkStatus();
}

absl::Status AddCorrespondences(const lb_register_request& from, RegisterRequest& request) {
  if (from.num_correspondences == 0) return absl::OkStatus();
  if (from.correspondences == nullptr) return InvalidArgument("correspondences", "is NULL");
  request.correspondences.resize(request.targets.size());
  // Elements are as long as the caller's header says.
  const auto* next = reinterpret_cast<const char*>(from.correspondences);
  for (size_t k = 0; k < from.num_correspondences; ++k) {
    const auto* given = reinterpret_cast<const lb_correspondence*>(next);
    LBC_RETURN_IF_ERROR(AddCorrespondence(given, request));
    next += given->struct_size;
  }
  return absl::OkStatus();
}

absl::Status AddParameterSpace(const lb_register_request& from, RegisterRequest& request) {
  if (from.num_parameters == 0) return absl::OkStatus();
  if (from.parameters == nullptr || from.points == nullptr) {
    return InvalidArgument("parameters or points", "is NULL");
  }
  for (size_t k = 0; k < from.num_parameters; ++k) {
    request.parameter_space.names.push_back(TextOf(from.parameters[k]));
  }
  const double* point = from.points;
  for (size_t n = 0; n < 1 + request.targets.size(); ++n, point += from.num_parameters) {
    request.parameter_space.points.emplace_back(point, point + from.num_parameters);
  }
  return absl::OkStatus();
}

bool Parse(const std::string& text, int& value) { return absl::SimpleAtoi(text, &value); }
bool Parse(const std::string& text, uint64_t& value) { return absl::SimpleAtoi(text, &value); }
bool Parse(const std::string& text, double& value) { return absl::SimpleAtod(text, &value); }
bool Parse(const std::string& text, std::optional<bool>& value) {
  return absl::SimpleAtob(text, &value.emplace());
}

absl::Status SetOption(const lb_option& option, RegistrationOptions& options) {
  const std::string name = TextOf(option.name), text = TextOf(option.value);
  bool is_known = false, is_parsed = false;
  RegistrationOptions::ForEach(options, [&](const char* known, auto& value) {
    if (name != known) return;
    is_known = true;
    is_parsed = Parse(text, value);
  });
  if (!is_known) return absl::InvalidArgumentError(absl::StrCat("no option is named '", name, "'"));
  if (is_parsed) return absl::OkStatus();
  return absl::InvalidArgumentError(absl::StrCat("option ", name, ": '", text, "' is not a value"));
}

absl::Status SetOptions(const lb_register_request& from, RegistrationOptions& options) {
  if (from.num_options > 0 && from.options == nullptr) return InvalidArgument("options", "is NULL");
  for (size_t k = 0; k < from.num_options; ++k) {
    LBC_RETURN_IF_ERROR(SetOption(from.options[k], options));
  }
  return options.Validate();
}

absl::StatusOr<RegisterRequest> RegistrationOf(const lb_register_request& from) {
  RegisterRequest request;
  request.family = TextOf(from.family);
  request.source = TextOf(from.source);
  if (from.num_targets > 0 && from.targets == nullptr) return InvalidArgument("targets", "is NULL");
  for (size_t k = 0; k < from.num_targets; ++k) request.targets.push_back(TextOf(from.targets[k]));
  LBC_RETURN_IF_ERROR(AddCorrespondences(from, request));
  LBC_RETURN_IF_ERROR(AddParameterSpace(from, request));
  request.refine = from.refine != 0;
  request.replace = from.replace != 0;
  LBC_RETURN_IF_ERROR(SetOptions(from, request.options));
  if (from.required_grade < 0 || from.required_grade > 2) {
    return absl::InvalidArgumentError(
        absl::StrCat("required_grade is ", from.required_grade, ", not in [0, 2]"));
  }
  request.required_grade = static_cast<Grade>(from.required_grade);
  request.priority = from.priority;
  return request;
}

// Gives the operation that `start` returns.
template <typename Start>
lb_status GiveOperation(lb_client* client, lb_operation** out, const Start& start) {
  return Give(out, [&]() -> absl::StatusOr<std::unique_ptr<lb_operation>> {
    LBC_RETURN_IF_ERROR(CheckIsThere(client, "client"));
    LBC_ASSIGN_OR_RETURN(Operation operation, start());
    return MakeOperation(std::move(operation));
  });
}

}  // namespace
}  // namespace liquidblend::c_api

namespace c_api = liquidblend::c_api;
using liquidblend::Operation;

extern "C" {

lb_status lb_client_import(lb_client* client, const lb_import_request* request,
                           lb_operation** out) {
  return c_api::GiveOperation(client, out, [&]() -> absl::StatusOr<Operation> {
    lb_import_request given;
    LBC_RETURN_IF_ERROR(c_api::Read(request, "request", given));
    LBC_ASSIGN_OR_RETURN(const auto upload, c_api::UploadOf(given));
    return client->client->UploadAnimation(upload);
  });
}

lb_status lb_client_register(lb_client* client, const lb_register_request* request,
                             lb_operation** out) {
  return c_api::GiveOperation(client, out, [&]() -> absl::StatusOr<Operation> {
    lb_register_request given;
    LBC_RETURN_IF_ERROR(c_api::Read(request, "request", given));
    LBC_ASSIGN_OR_RETURN(const auto registration, c_api::RegistrationOf(given));
    return client->client->RegisterFamily(registration);
  });
}

lb_status lb_client_get_operation(lb_client* client, const char* name, lb_operation** out) {
  return c_api::GiveOperation(client, out,
                              [&] { return client->client->GetOperation(c_api::TextOf(name)); });
}

lb_status lb_client_cancel(lb_client* client, const char* operation) {
  return c_api::Guarded([&]() -> absl::Status {
    LBC_RETURN_IF_ERROR(c_api::CheckIsThere(client, "client"));
    return client->client->CancelOperation(c_api::TextOf(operation));
  });
}

lb_status lb_client_watch(lb_client* client, const char* operation, lb_progress_function progress,
                          void* user, lb_operation** out) {
  return lb_client_watch_for(client, operation, HUGE_VAL, progress, user, out);
}

lb_status lb_client_watch_for(lb_client* client, const char* operation, double timeout_s,
                              lb_progress_function progress, void* user, lb_operation** out) {
  return c_api::GiveOperation(client, out, [&]() -> absl::StatusOr<Operation> {
    if (std::isnan(timeout_s)) return c_api::InvalidArgument("timeout_s", "is not a number");
    const auto update = [&](const Operation& now) {
      return progress == nullptr || progress(user, c_api::MakeOperation(now).get()) != 0;
    };
    return client->client->WatchOperation(c_api::TextOf(operation), update,
                                          absl::Seconds(timeout_s));
  });
}

void lb_operation_describe(const lb_operation* operation, lb_operation_info* info) {
  if (operation == nullptr) return;
  const Operation& from = operation->operation;
  lb_operation_info out = {};
  out.name = from.name.c_str();
  out.subject = from.subject.c_str();
  out.stage = from.progress.stage.c_str();
  out.fraction = from.progress.fraction;
  out.seconds_elapsed = from.progress.seconds_elapsed;
  out.seconds_left = from.progress.seconds_left;
  out.done = from.done ? 1 : 0;
  out.status = static_cast<lb_status>(from.result.code());
  out.error = operation->result_message.c_str();
  out.reason = operation->reason.c_str();
  out.waiting_for = from.progress.waiting_for.c_str();
  out.version = from.version;
  out.grade = static_cast<int32_t>(from.grade);
  c_api::Write(out, info);
}

void lb_operation_free(lb_operation* operation) { delete operation; }

}  // extern "C"
