// liquidblend stream FAMILY
#include <algorithm>
#include <cmath>
#include <memory>
#include <optional>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "absl/strings/str_join.h"
#include "absl/time/clock.h"
#include "client/cli/commands.h"
#include "client/cli/flags/blend_flags.h"
#include "client/cli/flags/encoding_flags.h"
#include "client/cli/flags/number_checks.h"
#include "client/cli/flags/parse.h"
#include "client/cli/flags/version_flag.h"
#include "client/cli/print/exit_code.h"
#include "client/cli/print/json.h"
#include "client/cli/print/progress_bar.h"
#include "client/cli/print/stream_stats.h"
#include "client/src/status_macros.h"

namespace liquidblend::cli {
namespace {

constexpr absl::Duration kSweepInterval = absl::Milliseconds(250);
constexpr absl::Duration kLongestStart = absl::Minutes(10);  // of a family that is to be loaded
constexpr absl::Duration kSlack = absl::Milliseconds(50);    // of clocks

struct StreamFlags {
  std::string family;
  int64_t version = 0;  // 0: the published one
  BlendFlags blend;
  double seconds = 10.0;
  double frames_per_second = 0.0;  // 0: the family's
  double rate = 1.0;
  EncodingFlags encoding;
  bool sweep = false;
  bool adapt = false;
};

// Changes the first weight now and then, and notes how long the stream takes to show it.
class Sweep {
 public:
  Sweep(std::vector<double> weights, absl::Time start)
      : weights_(std::move(weights)), next_change_(start + kSweepInterval) {}

  absl::Status OnFrame(const Frame& frame, absl::Time now, FrameStream& stream,
                       StreamStats& stats) {
    if (pending_) {
      if (frame.weights.empty() || std::abs(frame.weights[0] - weights_[0]) > 1e-9) {
        return absl::OkStatus();
      }
      stats.AddReaction(now - changed_);
      pending_ = false;
    }
    if (now < next_change_) return absl::OkStatus();
    next_change_ = now + kSweepInterval;
    changed_ = now;
    pending_ = true;
    weights_[0] = weights_[0] >= 1.0 ? 0.0 : weights_[0] + 0.125;
    StreamSettings change;
    change.weights = weights_;
    const absl::Status status = stream.Change(change);
    return absl::IsFailedPrecondition(status) ? absl::OkStatus() : status;  // Read says why
  }

 private:
  std::vector<double> weights_;
  absl::Time next_change_;
  absl::Time changed_;
  bool pending_ = false;
};

StreamSettings ToSettings(const StreamFlags& flags, const Blend& blend) {
  StreamSettings settings;
  settings.family = flags.family;
  settings.version = flags.version;
  settings.weights = blend.weights;
  settings.parameters = blend.parameters;
  settings.extrapolate = blend.extrapolate;
  settings.time_s = 0.0;
  settings.rate = flags.rate;
  if (flags.frames_per_second > 0.0) settings.frames_per_second = flags.frames_per_second;
  SetEncoding(flags.encoding, settings);
  settings.loop = true;
  settings.adapt_level_of_detail = flags.adapt;
  return settings;
}

std::string DescribeLive(const StreamedFrame& streamed, const StreamStats& stats) {
  return absl::StrFormat("t = %.2f s, weights %s, %.1f frames/s, %s at level %d, %d dropped",
                         streamed.frame.time_s, FormatNumbers(streamed.frame.weights),
                         stats.FramesPerSecond(),
                         FormatBytes(static_cast<int64_t>(streamed.frame.data.size())),
                         streamed.level_of_detail, streamed.num_dropped);
}

absl::Status Play(FrameStream& stream, const StreamFlags& flags, const std::vector<double>& weights,
                  StreamStats& stats, ProgressBar& bar) {
  const absl::Time start = absl::Now();
  Sweep sweep(weights, start);
  const absl::Duration length = absl::Seconds(flags.seconds);
  for (absl::Time now = start; now - start < length;) {
    const absl::Duration left = length - (now - start);
    const bool has_begun = stats.num_frames() > 0;
    auto read = stream.Read(has_begun ? left : std::max(left, kLongestStart));
    const bool is_over = absl::Now() - start >= length - kSlack;
    if (has_begun && is_over && absl::IsDeadlineExceeded(read.status())) break;  // it is silent
    LBC_ASSIGN_OR_RETURN(const std::optional<StreamedFrame> streamed, std::move(read));
    if (!streamed) break;
    now = absl::Now();
    stats.AddFrame(*streamed, now);
    if (flags.sweep) LBC_RETURN_IF_ERROR(sweep.OnFrame(streamed->frame, now, stream, stats));
    bar.Update(absl::ToDoubleSeconds(now - start) / flags.seconds, "stream",
               DescribeLive(*streamed, stats));
  }
  bar.Finish();
  return absl::OkStatus();
}

std::string DescribePercentiles(const char* what, const Percentiles& ms) {
  return absl::StrFormat("%-10s p50 %.2f, p95 %.2f, p99 %.2f, max %.2f ms", what, ms.p50, ms.p95,
                         ms.p99, ms.max);
}

Json PercentilesJson(const Percentiles& ms) {
  return {{"p50", ms.p50}, {"p95", ms.p95}, {"p99", ms.p99}, {"max", ms.max}};
}

void Report(const StreamStats& stats, const StreamFlags& flags, const Context& context) {
  context.Print(absl::StrFormat("%d frames in %.2f s: %.2f frames/s, %s, %d dropped",
                                stats.num_frames(), stats.seconds(), stats.FramesPerSecond(),
                                FormatBytes(stats.num_bytes()), stats.num_dropped()));
  context.Print(DescribePercentiles("interval", stats.IntervalsMs()));
  context.Print(DescribePercentiles("lateness", stats.LatenessMs()));
  Json json = {{"num_frames", stats.num_frames()},
               {"seconds", stats.seconds()},
               {"frames_per_second", stats.FramesPerSecond()},
               {"num_bytes", stats.num_bytes()},
               {"num_dropped", stats.num_dropped()},
               {"frames_by_level", stats.frames_by_level()},
               {"interval_ms", PercentilesJson(stats.IntervalsMs())},
               {"lateness_ms", PercentilesJson(stats.LatenessMs())}};
  if (flags.adapt) {
    context.Print(
        absl::StrCat("frames by level of detail: ", absl::StrJoin(stats.frames_by_level(), ", ")));
  }
  if (flags.sweep) {
    context.Print(DescribePercentiles("reaction", stats.ReactionsMs()));
    json["reaction_ms"] = PercentilesJson(stats.ReactionsMs());
  }
  context.PrintJson(json);
}

absl::Status RunStream(const StreamFlags& flags, const Context& context) {
  LBC_ASSIGN_OR_RETURN(const std::unique_ptr<Client> client, context.Connect());
  LBC_ASSIGN_OR_RETURN(const Family family, client->GetFamily(flags.family, flags.version));
  LBC_ASSIGN_OR_RETURN(Blend blend, ToBlend(flags.blend));
  if (blend.empty()) blend.weights.assign(std::max<size_t>(family.targets.size(), 1), 0.0);
  const double pace =
      flags.frames_per_second > 0.0 ? flags.frames_per_second : family.frames_per_second;
  StreamStats stats(pace > 0.0 ? pace : 24.0);
  LBC_ASSIGN_OR_RETURN(const std::unique_ptr<FrameStream> stream,
                       client->StreamFrames(ToSettings(flags, blend)));
  ProgressBar bar(ProgressBar::ChooseStyle(context.quiet));
  LBC_RETURN_IF_ERROR(Play(*stream, flags, blend.weights, stats, bar));
  stream->Cancel();
  Report(stats, flags, context);
  return absl::OkStatus();
}

}  // namespace

void AddStream(CLI::App& app, Context& context) {
  const auto flags = std::make_shared<StreamFlags>();
  CLI::App* command = app.add_subcommand(
      "stream", "Play a blend without showing it: frames per second, bytes, dropped, latencies");
  command->add_option("FAMILY", flags->family, "The family's id")->required();
  AddVersionFlag(flags->version, *command);
  AddBlendFlags(*command, flags->blend);
  command->add_option("--seconds", flags->seconds, "How long")
      ->check(Positive())
      ->capture_default_str();
  command->add_option("--fps", flags->frames_per_second, "Frames per second; default the family's")
      ->check(Positive());
  command->add_option("--rate", flags->rate, "Seconds of the animation per second of the clock")
      ->capture_default_str();
  AddEncodingFlags(*command, flags->encoding);
  command
      ->add_flag("--sweep", flags->sweep,
                 "Change the first weight four times a second and report the reaction time")
      ->excludes("--parameters");
  command->add_flag("--adapt", flags->adapt,
                    "Take coarser frames while the connection is too slow for the pace");
  command->footer(
      absl::StrCat("Without --weights or --parameters: the source.\n"
                   "interval: between frames. lateness: behind an even pace. reaction: from a "
                   "change of\nweights to the first frame that shows it.\n\n",
                   kExitCodeHelp));
  command->callback([flags, &context] { context.status = RunStream(*flags, context); });
}

}  // namespace liquidblend::cli
