// liquidblend import NAME DIR | --from-server ROOT/DIR
#include <memory>
#include <string>
#include <vector>

#include "absl/strings/str_cat.h"
#include "client/cli/commands.h"
#include "client/cli/flags/named_value.h"
#include "client/cli/flags/priority_flag.h"
#include "client/cli/flags/up_flag.h"
#include "client/cli/print/describe.h"
#include "client/cli/print/exit_code.h"
#include "client/cli/print/json.h"
#include "client/cli/print/progress_bar.h"
#include "client/cli/print/wait.h"
#include "client/src/status_macros.h"

namespace liquidblend::cli {
namespace {

struct ImportFlags {
  std::string name;
  std::string directory;    // here
  std::string from_server;  // or there
  std::string pattern;      // of frames; empty: all
  ImportOptions options;
  int priority = 0;
  bool no_wait = false;
};

absl::StatusOr<Operation> Upload(Client& client, const ImportFlags& flags,
                                 const std::vector<std::string>& files, const Context& context) {
  UploadRequest request;
  request.animation = flags.name;
  request.options = flags.options;
  request.priority = flags.priority;
  request.files = files;
  ProgressBar bar(ProgressBar::ChooseStyle(context.quiet));
  return client.UploadAnimation(request, [&](const UploadProgress& progress) {
    const double share = progress.bytes_total > 0 ? static_cast<double>(progress.bytes_sent) /
                                                        static_cast<double>(progress.bytes_total)
                                                  : 1.0;
    bar.Update(share, "upload",
               absl::StrCat("upload, ", FormatBytes(progress.bytes_sent), " of ",
                            FormatBytes(progress.bytes_total), ", file ", progress.files_sent, "/",
                            progress.files_total));
  });
}

// Files to upload; none with --from-server.
absl::StatusOr<std::vector<std::string>> FindFiles(const ImportFlags& flags) {
  if (flags.directory.empty() == flags.from_server.empty()) {
    return absl::InvalidArgumentError("give either DIR or --from-server ROOT/DIR");
  }
  if (flags.from_server.empty()) return ListAnimationFiles(flags.directory, flags.pattern);
  return std::vector<std::string>();
}

absl::StatusOr<Operation> Start(Client& client, const ImportFlags& flags,
                                const std::vector<std::string>& files, const Context& context) {
  if (flags.from_server.empty()) return Upload(client, flags, files, context);
  ImportOptions options = flags.options;
  options.pattern = flags.pattern;
  return client.ImportAnimation({flags.name, flags.from_server, options, flags.priority});
}

absl::Status RunImport(const ImportFlags& flags, const Context& context) {
  LBC_ASSIGN_OR_RETURN(const std::vector<std::string> files, FindFiles(flags));
  LBC_ASSIGN_OR_RETURN(const std::unique_ptr<Client> client, context.Connect());
  LBC_ASSIGN_OR_RETURN(const Operation started, Start(*client, flags, files, context));
  if (flags.no_wait) {
    context.Print(started.name);
    context.PrintJson(ToJson(started));
    context.Remark(HowToWatch(started.name));
    return absl::OkStatus();
  }
  LBC_ASSIGN_OR_RETURN(const Operation finished, WaitWithProgress(*client, started.name, context));
  Animation animation;
  if (finished.animation) {
    animation = *finished.animation;
  } else {
    LBC_ASSIGN_OR_RETURN(animation, client->GetAnimation(flags.name));
  }
  context.PrintText(Describe(animation));
  context.PrintJson(ToJson(animation));
  return absl::OkStatus();
}

}  // namespace

void AddImport(CLI::App& app, Context& context) {
  const auto flags = std::make_shared<ImportFlags>();
  CLI::App* command =
      app.add_subcommand("import", "Import the frames in a directory as an animation");
  command->add_option("NAME", flags->name, "Id of the new animation")->required();
  command->add_option(
      "DIR", flags->directory,
      "Frames: *.bobj.gz with *.uni (Mantaflow), *.ply, *.obj, *.stl or *.vdb; meta.json "
      "if there");
  command->add_option(
      "--from-server", flags->from_server,
      "ROOT/DIR: a directory there, below one of its import roots; otherwise DIR here");
  command->add_option("--pattern", flags->pattern,
                      "GLOB: the frames of such names only, such as 'liquid.*'; meta.json "
                      "and their velocities go with them; all unless given");
  AddNamedValue<AnimationFormat>("--format", flags->options.format,
                                 "The frames' format; otherwise found from the file names",
                                 {{"mantaflow", AnimationFormat::kMantaflow},
                                  {"ply", AnimationFormat::kPly},
                                  {"obj", AnimationFormat::kObj},
                                  {"stl", AnimationFormat::kStl},
                                  {"vdb", AnimationFormat::kVdb}},
                                 *command);
  ImportOptions& options = flags->options;
  command->add_option("--fps", options.frames_per_second,
                      "Frames per second; otherwise from meta.json, else 24");
  command->add_option("--vertex-scale", options.vertex_scale,
                      "Metres per unit of the files' positions; otherwise from meta.json, else 1");
  command->add_option(
      "--velocity-scale", options.velocity_scale,
      "Metres per second per unit of the files' velocities; otherwise from meta.json, else as "
      "--vertex-scale; of Mantaflow there is no such last resort: this, --voxel-size or meta.json "
      "has to say it");
  command->add_option("--voxel-size", options.voxel_size_m,
                      "Mantaflow: edge of a simulation cell in metres; gives --velocity-scale; "
                      "otherwise from meta.json, else not known");
  command->add_flag("--allow-gaps", options.allow_gaps,
                    "Frame numbers may be missing; time goes on across the gap");
  command
      ->add_option("--frame-times", options.frame_times,
                   "T,T,...: when each frame is, in frames since the first, rising from 0; "
                   "otherwise from the numbers in the file names")
      ->delimiter(',');
  AddUp(options.up, "Direction that is up; otherwise found from parts that fall, else z", *command);
  AddPriority(flags->priority, *command);
  command->add_flag("--no-wait", flags->no_wait, "Return when the files are uploaded");
  command->footer(absl::StrCat("Flags that are left out come from meta.json beside the frames.\n\n",
                               kExitCodeHelp));
  command->callback([flags, &context] { context.status = RunImport(*flags, context); });
}

}  // namespace liquidblend::cli
