// Api of the HTTP port that a fuzzer controls.
#pragma once

#include <deque>
#include <functional>
#include <memory>
#include <string>

#include "server/api/api.h"
#include "tests/fuzz/fuzz_host.h"

namespace liquidblend::fuzz {

struct FuzzApiOptions {
  bool needs_token = false;  // "Bearer good"
  bool is_deferred = false;  // answers wait for AnswerNext()
  bool fails = false;        // answers are kUnavailable
};

// Threads: one at a time.
class FuzzApi final : public server::Api {
 public:
  explicit FuzzApi(const FuzzApiOptions& options)
      : host_(std::make_shared<FuzzHost>()), options_(options) {}

  // Gives the oldest answer that waits. False: none does.
  bool AnswerNext();
  FuzzHost& host() { return *host_; }

  absl::Status Admit(const server::Credentials& credentials, const server::AccessRequest& access,
                     server::AccessGrant& grant) override;
  Cancel GetFrame(v1::GetFrameRequest request, std::string client, trace::Span span,
                  Done<server::MadeFrame> done) override;
  void FindVersion(const std::string& family, int64_t version,
                   Done<server::FamilyVersion> done) override;
  void Call(const server::Method& method, const server::Caller& caller, Read read,
            server::IsWanted is_wanted, Done<server::MessagePtr> done) override;
  NextOperation WatchOperation(const std::string& name, server::IsWanted is_wanted) override;
  std::shared_ptr<server::ArchiveUpload> OpenUpload(v1::UploadAnimationRequest header,
                                                    const server::Caller& caller) override;
  std::shared_ptr<server::StreamSession> OpenStream(
      std::string client, std::weak_ptr<server::StreamSession::Sink> sink,
      trace::Span span) override;
  absl::Status Post(absl::AnyInvocable<void()> work) override;
  void CheckIsReady(Done<std::string> done) override;
  void GetMetricsText(Done<std::string> done) override;
  metrics::Metrics& metrics() override;
  server::CallLog& call_log() override;
  const trace::Tracer& tracer() override;

 private:
  template <typename Reply>
  void Give(absl::StatusOr<Reply> reply, Done<Reply> done);

  const std::shared_ptr<FuzzHost> host_;
  const FuzzApiOptions options_;
  std::deque<absl::AnyInvocable<void()>> waiting_;
};

}  // namespace liquidblend::fuzz
