// Handlers of the methods with one request and one reply, each in the file of its name or its
// resource's. They may block, so they run on a WorkPool; they know no gRPC.
//
// Errors: kInvalidArgument with the fields at fault (an invalid name or token, options out of
// range), and those of the catalog: kNotFound, kAlreadyExists, kFailedPrecondition, kUnavailable...
// Threads: safe.
#pragma once

#include "absl/functional/any_invocable.h"
#include "absl/status/statusor.h"
#include "absl/time/time.h"
#include "google/longrunning/operations.pb.h"
#include "google/protobuf/empty.pb.h"
#include "liquidblend/v1/liquidblend.pb.h"
#include "server/access/principal.h"
#include "server/api/operation_watch.h"
#include "server/frames/backends.h"

namespace liquidblend::server {

namespace lro = ::google::longrunning;
using google::protobuf::Empty;

// register_family.cc
absl::StatusOr<lro::Operation> RegisterFamily(Backends& backends,
                                              const v1::RegisterFamilyRequest& request,
                                              const Caller& caller = {});

// How long presigned urls are valid. Short: who needs longer asks again.
inline constexpr absl::Duration kUrlsLast = absl::Minutes(15);

// presign.cc; kUnimplemented where no urls are given. Checks the principal's limits of storage.
absl::StatusOr<v1::PresignUploadResponse> PresignUpload(Backends& backends,
                                                        const v1::PresignUploadRequest& request,
                                                        const Caller& caller = {});

// download.cc; kFailedPrecondition if there is no file yet. PresignDownload: kUnimplemented where
// no urls are given. ReadFile: kAborted if the file is another one than the request's checksum
// names.
absl::StatusOr<v1::PresignDownloadResponse> PresignDownload(
    Backends& backends, const v1::PresignDownloadRequest& request);
absl::StatusOr<v1::ReadFileResponse> ReadFile(Backends& backends,
                                              const v1::ReadFileRequest& request);

// animations.cc
absl::StatusOr<v1::Animation> GetAnimation(Backends& backends,
                                           const v1::GetAnimationRequest& request);
// kFailedPrecondition until it is READY. Waits for the store, and for its turn to compute.
absl::StatusOr<v1::AnimationFrame> GetAnimationFrame(Backends& backends,
                                                     const v1::GetAnimationFrameRequest& request,
                                                     const Caller& caller = {});
absl::StatusOr<v1::ListAnimationsResponse> ListAnimations(Backends& backends,
                                                          const v1::ListAnimationsRequest& request);
absl::StatusOr<Empty> DeleteAnimation(Backends& backends,
                                      const v1::DeleteAnimationRequest& request);

// families.cc
absl::StatusOr<v1::Family> GetFamily(Backends& backends, const v1::GetFamilyRequest& request);
absl::StatusOr<v1::ListFamiliesResponse> ListFamilies(Backends& backends,
                                                      const v1::ListFamiliesRequest& request);
absl::StatusOr<v1::Family> RollbackFamily(Backends& backends,
                                          const v1::RollbackFamilyRequest& request);
absl::StatusOr<Empty> DeleteFamily(Backends& backends, const v1::DeleteFamilyRequest& request);

// measure_correspondences.cc. Does not block: measures slice by slice, each in a turn of its own on
// the pool of frames, so that a measurement of thousands of slices takes its caller's share of the
// cores and keeps no thread waiting. Errors: CheckMeasurement's, FindFamily's, and
// FramePool::Post's for the first slice.
//   is_wanted  asked before each slice; once it says no, the call ends with kCancelled
//   done       called once, on a thread of a pool, or before this returns
void MeasureCorrespondences(
    Backends& backends, const v1::MeasureCorrespondencesRequest& request, const Caller& caller,
    IsWanted is_wanted,
    absl::AnyInvocable<void(absl::StatusOr<v1::MeasureCorrespondencesResponse>)> done);

// operations.cc
absl::StatusOr<lro::Operation> GetOperation(Backends& backends,
                                            const lro::GetOperationRequest& request);
absl::StatusOr<lro::ListOperationsResponse> ListOperations(
    Backends& backends, const lro::ListOperationsRequest& request);
absl::StatusOr<Empty> CancelOperation(Backends& backends,
                                      const lro::CancelOperationRequest& request);
absl::StatusOr<Empty> DeleteOperation(Backends& backends,
                                      const lro::DeleteOperationRequest& request);

}  // namespace liquidblend::server
