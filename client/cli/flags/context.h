// Context of every subcommand: the global flags, and output.
#pragma once

#include <memory>
#include <nlohmann/json_fwd.hpp>
#include <string>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "client/cli/flags/command_trace.h"
#include "liquidblend/client.h"

namespace liquidblend::cli {

struct Context {
  std::string server = "127.0.0.1:50051";
  double connect_timeout_s = 5.0;  // > 0
  double patience_s = 30.0;        // >= 0; RetryOptions::patience
  SecurityOptions security;
  std::string token_file;               // or the token is in security
  bool no_direct = false;               // not ConnectOptions::direct_transfers
  bool json = false;                    // results as JSON on standard output
  bool quiet = false;                   // results and errors only
  absl::Status status;                  // of the subcommand that ran
  std::shared_ptr<CommandTrace> trace;  // of the calls; null: they are in none

  absl::StatusOr<std::unique_ptr<Client>> Connect() const;

  // Prints to standard output: a result for people (not with --json), or for programs (only with
  // --json). Words may be a server's: control characters are replaced. A line has no newline, a
  // text only those of the command itself: its parts went through CleanLine().
  void Print(const std::string& line) const;
  void PrintText(const std::string& text) const;
  void PrintJson(const nlohmann::ordered_json& value) const;

  // Prints a note to standard error, unless --quiet; as Print().
  void Remark(const std::string& line) const;
};

}  // namespace liquidblend::cli
