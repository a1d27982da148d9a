// The fuzzer `stream`: a StreamSession under any sequence of messages and events.
//
// Input: uint8 of which bits 0 and 1 say how many frames are really made, and bit 2 whether
// families and frames are in memory; then events, each a uint8:
//   bits 0 to 3  which one, see Act()
//   bit 4        leave the steps that it causes for the next event
// A message is a uint16 size, then as many bytes.
#include <memory>
#include <optional>
#include <string>
#include <utility>

#include "server/frames/stream_session.h"
#include "tests/fuzz/entries.h"
#include "tests/fuzz/fuzz_host.h"
#include "tests/fuzz/heap.h"
#include "tests/fuzz/input.h"
#include "tests/fuzz/require.h"

namespace liquidblend::fuzz {
namespace {

constexpr int kMaxEvents = 400;
constexpr uint8_t kDefer = 0x10;

// A client that checks what it gets.
class CheckingSink final : public server::StreamSession::Sink {
 public:
  void Send(const server::StreamedFrame& streamed) override {
    Require(!is_writing && !end.has_value(), "one write at a time, none after the end");
    Require(!is_gone, "nothing is sent to a client that has gone");
    Require(streamed.frame != nullptr, "a frame has bytes");
    Require(streamed.frame_index == num_frames_++, "frames are numbered");
    Require(streamed.num_dropped >= num_dropped_, "dropped frames are counted");
    Require(streamed.level_of_detail >= 0 &&
                streamed.level_of_detail < std::ssize(SmallFamily()->levels),
            "the level of detail is one of the family's");
    v1::StreamFramesResponse response;
    Require(response.ParseFromString(server::ResponsePrefix(streamed) + *streamed.frame),
            "what goes out is a StreamFramesResponse");
    num_dropped_ = streamed.num_dropped;
    is_writing = true;
  }

  void End(const absl::Status& status) override {
    Require(!end.has_value(), "a stream ends once");
    Require(status.ok() || !status.message().empty(), "an error says why");
    Require(!absl::IsInternal(status) && !absl::IsUnknown(status), "no client causes INTERNAL");
    end = status;
  }

  std::string account() const override { return "client"; }
  void GiveUp() override {}

  bool is_writing = false;
  bool is_gone = false;
  std::optional<absl::Status> end;

 private:
  int64_t num_frames_ = 0;
  int64_t num_dropped_ = 0;
};

class StreamRun {
 public:
  explicit StreamRun(Input input) : input_(input) {
    const uint8_t options = input_.Byte();
    host_->MakeRealFrames(options & 3);
    host_->AnswerAtOnce((options & 4) != 0);
    session_ = std::make_shared<server::StreamSession>(host_, "fuzz", sink_);
  }

  void Run() {
    for (int k = 0; k < kMaxEvents && !input_.empty(); ++k) {
      const uint8_t event = input_.Byte();
      Act(event & 0x0F);
      if ((event & kDefer) == 0) host_->RunReady();
    }
    Finish();
  }

 private:
  void Act(int event) {
    switch (event) {
      case 0:
      case 1:
      case 2:
      case 3:
        return SendMessage();
      case 4:
        return SendAgainAndAgain();
      case 5:
      case 6:
        host_->AnswerSearch();
        return;
      case 7:
        host_->AnswerSearch(absl::UnavailableError("the catalog is away"));
        return;
      case 8:
      case 9:
        host_->AnswerOrder();
        return;
      case 10:
        host_->AnswerOrder(absl::ResourceExhaustedError("too busy"));
        return;
      case 11:
      case 12:
        return TakeFrame();
      case 13:  // 1 us to 9 hours
        return host_->Advance(absl::Microseconds(int64_t{1} << (input_.Byte() % 36)));
      case 14:
        return session_->OnHalfClosed();
      default:
        return Stop();
    }
  }

  void SendMessage() {
    const std::string_view bytes = input_.Take(input_.Word());
    v1::StreamFramesRequest request;
    if (!request.ParseFromArray(bytes.data(), static_cast<int>(bytes.size()))) return;
    session_->OnRequest(request);
    newest_ = std::move(request);
  }

  // The same message over and over: after some of them, no more may be kept. Once a run, because it
  // takes long.
  void SendAgainAndAgain() {
    constexpr int kWarmUp = 16;
    constexpr int kRepetitions = 512;
    constexpr size_t kSlack = 4096;
    if (std::exchange(has_repeated_, true)) return;
    const auto repeat = [&](int count) {
      for (int k = 0; k < count; ++k) {
        session_->OnRequest(newest_);
        host_->RunReady();
      }
    };
    repeat(kWarmUp);
    const size_t before = AllocatedBytes();
    repeat(kRepetitions);
    Require(AllocatedBytes() <= before + kSlack, "messages that have been read are not kept");
  }

  void TakeFrame() {
    if (!std::exchange(sink_->is_writing, false)) return;
    session_->OnWritten();
  }

  void Stop() {
    session_->Stop();
    host_->RunReady();
    sink_->is_gone = true;
  }

  // Whatever happened, a stream that is stopped goes away once nobody owes it an answer.
  void Finish() {
    Stop();
    host_->AnswerSearch();
    host_->RunReady();
    Require(!host_->AnswerOrder(), "a stream that has stopped has no order");
    const std::weak_ptr<server::StreamSession> session = session_;
    session_ = nullptr;
    Require(session.expired(), "a stream that has stopped is freed");
    host_->Advance(absl::Hours(24));
    host_->Clear();
  }

  Input input_;
  const std::shared_ptr<FuzzHost> host_ = std::make_shared<FuzzHost>();
  const std::shared_ptr<CheckingSink> sink_ = std::make_shared<CheckingSink>();
  std::shared_ptr<server::StreamSession> session_;
  v1::StreamFramesRequest newest_;
  bool has_repeated_ = false;
};

}  // namespace

void RunStream(std::span<const std::byte> bytes) { StreamRun(Input(bytes)).Run(); }

}  // namespace liquidblend::fuzz
