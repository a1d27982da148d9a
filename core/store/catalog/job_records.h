// Changes of job records, the same for every backend of the catalog.
#pragma once

#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/time/time.h"
#include "core/store/catalog/catalog.h"
#include "google/protobuf/message_lite.h"
#include "google/rpc/status.pb.h"

namespace liquidblend::store {

// Whether the job is queued, running or waiting, so not done.
bool IsUnfinished(const pb::JobRecord& job);

// The resource that the job, or its parent, makes: "animations/{id}" or "families/{id}".
std::string SubjectOf(const pb::JobRecord& job);

// Ids of the animations that must stay while the job is not done: the one it imports, or those it
// registers. None for a child, as its parent has them.
std::vector<std::string> AnimationsOf(const pb::JobRecord& job);

// Removes the lists of the job's request, which make up most of a long record: files and times of
// frames, or correspondences.
void DropLists(pb::JobRecord& job);

// Check the payload of a job.  Errors: kInvalidArgument if it is not an import of `animation`, or
// not a registration.
absl::Status CheckImport(const pb::AnimationRecord& animation, const pb::JobRecord& job);
absl::Status CheckRegistration(const pb::JobRecord& job);

// A job with a new id and no progress; payload, request_id, owner, priority, memory and trace are
// kept. A registration of several targets waits for its children, others are queued.
pb::JobRecord NewJob(pb::JobRecord job, absl::Time now);

// The queued child of a registration for one of its targets. Each has a turn of its own.
pb::JobRecord NewChild(const pb::JobRecord& parent, int target_index, absl::Time now);

// The error of a registration whose child failed: the child's error with the target's name.
absl::Status ErrorOfChild(const absl::Status& error, const pb::JobRecord& child,
                          const pb::JobRecord& parent);

// The animation's record while its import `job` is not done.
pb::AnimationRecord NewAnimation(pb::AnimationRecord animation, const pb::JobRecord& job,
                                 absl::Time now);

// Starts an attempt by the worker: the job is RUNNING, its attempt is counted, its progress is
// empty.
void StartAttempt(const std::string& worker, absl::Time now, pb::JobRecord& job);

// Puts the job back into the queue as it was before its lease, except for its checkpoint.
void ReturnToQueue(absl::Time now, pb::JobRecord& job);

// Whether the attempt that is under way has made a checkpoint.
bool HasNewCheckpoint(const pb::JobRecord& job);

// Puts the job of a worker that is stopping back into the queue; its attempt does not count.
void HandBack(absl::Time now, pb::JobRecord& job);

// Adds to the job's failed attempts, of which the newest kKeptAttempts are kept. `lost`: the lease
// expired without a report.
inline constexpr int kKeptAttempts = 20;
void NoteFailure(const absl::Status& error, bool lost, absl::Time now, pb::JobRecord& job);
// Adds the failed attempts of a child to those of its parent, which has those of Repeat() already.
void TakeFailures(const pb::JobRecord& child, pb::JobRecord& parent);

// Puts a child that has succeeded back into the queue. `why` is a failed attempt of both.
void Repeat(const absl::Status& why, absl::Time now, pb::JobRecord& child, pb::JobRecord& parent);
// Gives a registration back that waits for children again; its attempt does not count.
void WaitAgain(absl::Time now, pb::JobRecord& job);

// Counts the last attempt as a transient failure of the environment, not of the job.
void CountForEnvironment(pb::JobRecord& job);
// Counts the last attempt as one whose worker was lost after a new checkpoint.
void CountLossAfterProgress(pb::JobRecord& job);

// The number of the newest attempt: 1 for the first worker that took the job. Attempts that were
// handed back are left out.
int AttemptNumber(const pb::JobRecord& job);

// The number of lost workers among the failed attempts that are kept.
int NumLosses(const pb::JobRecord& job);

// Ends the job with success: its progress is complete, and it has no checkpoint any more.
void Succeed(absl::Time now, pb::JobRecord& job);

// Ends the job with an error: CANCELLED if it is kCancelled, else FAILED.
void Fail(const absl::Status& error, absl::Time now, pb::JobRecord& job);

// The time as a protobuf message, and back.
google::protobuf::Timestamp ToTimestamp(absl::Time time);
absl::Time ToTime(const google::protobuf::Timestamp& timestamp);

// Converts a status; payloads that are messages become details. Bytes that are not UTF-8 become
// question marks, as protobuf would not read them.
google::rpc::Status ToRpcStatus(const absl::Status& status);

// Serializes a record. Errors: kInvalidArgument if a string in the record is not UTF-8; `what`
// names the record.
absl::StatusOr<std::string> Serialize(const google::protobuf::MessageLite& record,
                                      const std::string& what);

// Makes a page token from the last key of a page of `list`; it is opaque to clients.
std::string PageToken(const std::string& list, const std::string& last_key);
// Reads the last key from a page token of `list`. An empty token: an empty key. Errors:
// kInvalidArgument if the token is not from this list.
absl::StatusOr<std::string> LastKey(const std::string& list, const std::string& token);
// The effective page size of a request for `page_size`.
int PageSize(int page_size);

}  // namespace liquidblend::store
