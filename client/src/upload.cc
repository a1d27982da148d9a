// Client's uploads of animations.
#include <memory>
#include <utility>

#include "absl/strings/match.h"
#include "client/src/client_impl.h"
#include "client/src/convert.h"
#include "client/src/direct_files.h"
#include "client/src/names.h"
#include "client/src/status_macros.h"
#include "client/src/upload_files.h"
#include "liquidblend/client.h"

namespace liquidblend {
namespace {

using Writer = grpc::ClientWriterInterface<v1::UploadAnimationRequest>;

UploadProgress StartProgress(const std::vector<client::UploadFile>& files) {
  UploadProgress progress;
  progress.files_total = static_cast<int>(files.size());
  for (const client::UploadFile& file : files) progress.bytes_total += file.size_bytes;
  return progress;
}

// One file: its header, then its chunks. `open` becomes false when the server has ended the call.
absl::Status SendFile(const client::UploadFile& file, int64_t chunk_bytes, Writer* writer,
                      const std::function<void(int64_t bytes)>& sent, bool* open) {
  v1::UploadAnimationRequest message;
  message.mutable_file()->set_name(file.name);
  message.mutable_file()->set_size_bytes(file.size_bytes);
  *open = writer->Write(message);
  if (!*open) return absl::OkStatus();
  return client::ReadChunks(file, chunk_bytes, [&](std::string bytes) {
    const auto size = static_cast<int64_t>(bytes.size());
    message.set_chunk(std::move(bytes));
    *open = writer->Write(message);
    if (*open) sent(size);
    return *open;
  });
}

// Files that are at their place already.
absl::Status NameFiles(const std::vector<client::UploadFile>& files,
                       const std::vector<std::string>& blobs, Writer* writer) {
  for (size_t k = 0; k < files.size(); ++k) {
    v1::UploadAnimationRequest message;
    message.mutable_file()->set_name(files[k].name);
    message.mutable_file()->set_size_bytes(files[k].size_bytes);
    message.mutable_file()->set_blob(blobs[k]);
    if (!writer->Write(message)) return absl::OkStatus();  // the call's status says why
  }
  writer->WritesDone();
  return absl::OkStatus();
}

// All files. A call that the server has ended early is no error here: its status says why.
absl::Status SendFiles(const std::vector<client::UploadFile>& files, int64_t chunk_bytes,
                       Writer* writer, const std::function<void(const UploadProgress&)>& report) {
  UploadProgress progress = StartProgress(files);
  for (const client::UploadFile& file : files) {
    bool open = true;
    const auto sent = [&](int64_t bytes) {
      progress.bytes_sent += bytes;
      if (report) report(progress);
    };
    LBC_RETURN_IF_ERROR(SendFile(file, chunk_bytes, writer, sent, &open));
    if (!open) return absl::OkStatus();
    ++progress.files_sent;
  }
  if (report) report(progress);
  writer->WritesDone();
  return absl::OkStatus();
}

}  // namespace

absl::StatusOr<std::vector<std::string>> Client::Impl::SendDirectly(
    const UploadRequest& upload, const std::vector<client::UploadFile>& files,
    const std::function<void(const UploadProgress&)>& report) {
  std::vector<std::string> blobs;
  if (!options.direct_transfers) return blobs;
  UploadProgress progress = StartProgress(files);
  client::Http http(options.security.storage_ca, client::HostsOf(options.target));
  const auto sent = [&](int64_t bytes) {
    progress.bytes_sent += bytes;
    if (report) report(progress);
  };
  while (blobs.size() < files.size()) {
    const size_t first = blobs.size();
    v1::PresignUploadRequest request;
    request.set_animation_id(client::ResourceId("animations", upload.animation));
    for (int k = client::NumInCall(files, first); k > 0; --k) {
      const client::UploadFile& file = files[first + static_cast<size_t>(request.files_size())];
      v1::PresignUploadRequest::File& asked = *request.add_files();
      asked.set_size_bytes(file.size_bytes);
      LBC_ASSIGN_OR_RETURN(*asked.mutable_checksum(), client::ChecksumOf(file));
    }
    const auto urls = Call(&Service::PresignUpload, request);
    // The server gives none, or is older than this: then it knows no such checksums either.
    const bool is_older = absl::IsInvalidArgument(urls.status()) &&
                          absl::StrContains(urls.status().message(), "checksum");
    if (is_older || absl::IsUnimplemented(urls.status())) return std::vector<std::string>();
    LBC_RETURN_IF_ERROR(urls.status());
    if (urls->files_size() != request.files_size()) {
      return absl::InternalError("the server gave urls for another number of files");
    }
    for (const v1::PresignUploadResponse::File& file_urls : urls->files()) {
      const absl::Status status =
          client::SendToUrls(http, files[blobs.size()], file_urls, options.retry, sent);
      // A network in which only the server is reached.
      if (absl::IsUnavailable(status) && blobs.empty()) return std::vector<std::string>();
      LBC_RETURN_IF_ERROR(status);
      blobs.push_back(file_urls.blob());
      ++progress.files_sent;
    }
  }
  if (report) report(progress);
  return blobs;
}

absl::StatusOr<Operation> Client::UploadAnimation(
    const UploadRequest& request, const std::function<void(const UploadProgress&)>& progress) {
  LBC_ASSIGN_OR_RETURN(const std::vector<client::UploadFile> files, client::CheckUpload(request));
  v1::UploadAnimationRequest header;
  header.mutable_header()->set_animation_id(client::ResourceId("animations", request.animation));
  *header.mutable_header()->mutable_options() = client::ToProto(request.options);
  header.mutable_header()->set_request_id(client::MakeRequestId());
  header.mutable_header()->set_num_files(static_cast<int>(files.size()));
  header.mutable_header()->set_priority(request.priority);
  LBC_ASSIGN_OR_RETURN(const std::vector<std::string> blobs,
                       impl_->SendDirectly(request, files, progress));

  google::longrunning::Operation operation;
  LBC_RETURN_IF_ERROR(impl_->Submit([&](client::Server& server) {
    grpc::ClientContext context;
    impl_->Prepare(impl_->options.upload_timeout, &context);
    const auto writer = server.service().UploadAnimation(&context, &operation);
    absl::Status local;
    if (writer->Write(header)) {
      local = blobs.empty() ? SendFiles(files, request.chunk_bytes, writer.get(), progress)
                            : NameFiles(files, blobs, writer.get());
    }
    if (!local.ok()) context.TryCancel();
    const absl::Status remote = client::FromGrpc(writer->Finish());
    return local.ok() ? remote : local;
  }));
  return client::FromProto(operation);
}

absl::StatusOr<Operation> Client::ImportAnimation(const ImportRequest& request) {
  LBC_RETURN_IF_ERROR(request.options.Validate());
  v1::ImportAnimationRequest proto;
  proto.set_animation_id(client::ResourceId("animations", request.animation));
  proto.set_location(request.location);
  *proto.mutable_options() = client::ToProto(request.options);
  proto.set_request_id(client::MakeRequestId());
  proto.set_priority(request.priority);
  LBC_ASSIGN_OR_RETURN(
      const google::longrunning::Operation operation,
      impl_->Submit(&Impl::Service::ImportAnimation, proto, impl_->options.upload_timeout));
  return client::FromProto(operation);
}

}  // namespace liquidblend
