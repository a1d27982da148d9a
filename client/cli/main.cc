// The command `liquidblend`.
#include <openssl/crypto.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <memory>
#include <string>
#include <vector>

#include "client/cli/commands.h"
#include "client/cli/flags/clean_text.h"
#include "client/cli/flags/number_checks.h"
#include "client/cli/print/exit_code.h"
#include "core/base/nearest.h"
#include "core/base/version.h"

namespace {

using liquidblend::cli::Context;

void AddSecurityFlags(CLI::App& app, Context& context) {
  liquidblend::SecurityOptions& security = context.security;
  const std::string group = "Security";
  app.add_flag("--tls", security.tls, "Use TLS and the system's authorities")
      ->envname("LIQUIDBLEND_TLS")
      ->group(group);
  app.add_option("--tls-ca", security.tls_ca,
                 "PEM file of authorities to trust, otherwise the system's; means --tls")
      ->envname("LIQUIDBLEND_TLS_CA")
      ->group(group);
  app.add_option("--tls-cert", security.tls_cert,
                 "PEM file of a certificate to show; none unless given")
      ->envname("LIQUIDBLEND_TLS_CERT")
      ->group(group);
  app.add_option("--tls-key", security.tls_key, "PEM file of its key; none unless given")
      ->envname("LIQUIDBLEND_TLS_KEY")
      ->group(group);
  app.add_option("--tls-server-name", security.tls_server_name,
                 "Name that the server's certificate is for; otherwise the host's")
      ->envname("LIQUIDBLEND_TLS_SERVER_NAME")
      ->group(group);
  app.add_option("--storage-ca", security.storage_ca,
                 "PEM file of authorities that vouch for the object store; otherwise the system's")
      ->envname("LIQUIDBLEND_STORAGE_CA")
      ->group(group);
  app.add_option("--token-file", context.token_file,
                 "File whose first line is the bearer token; no token unless given")
      ->envname("LIQUIDBLEND_TOKEN_FILE")
      ->group(group);
  app.add_option("--token", security.token,
                 "The token itself, none unless given; better in the environment, for others see "
                 "command lines")
      ->envname("LIQUIDBLEND_TOKEN")
      ->group(group);
}

void AddGlobalFlags(CLI::App& app, Context& context) {
  app.add_option("--server", context.server,
                 "Where the server is, HOST:PORT; several of one store: HOST:PORT,HOST:PORT")
      ->envname("LIQUIDBLEND_SERVER")
      ->capture_default_str();
  app.add_option("--connect-timeout", context.connect_timeout_s, "Seconds to wait for the server")
      ->envname("LIQUIDBLEND_CONNECT_TIMEOUT")
      ->check(liquidblend::cli::Positive())
      ->capture_default_str();
  app.add_option(
         "--patience", context.patience_s,
         "Seconds that a call waits in all if the server asks it to try again later, and that "
         "--wait outlasts a server that is away; 0: never")
      ->check(liquidblend::cli::NonNegative())
      ->capture_default_str();
  app.add_flag("--no-direct", context.no_direct,
               "Send files by the server, even if it gives urls of its object store")
      ->envname("LIQUIDBLEND_NO_DIRECT");
  AddSecurityFlags(app, context);
  app.add_flag("--json", context.json, "Print results as JSON");
  app.add_flag("--quiet,-q", context.quiet, "No progress and no remarks");
  app.footer(liquidblend::cli::kExitCodeHelp);
  app.require_subcommand(1);
  app.fallthrough();
}

void AddCommands(CLI::App& app, Context& context) {
  using namespace liquidblend::cli;  // NOLINT: the list below is all of it
  AddImport(app, context);
  AddRegister(app, context);
  AddFrame(app, context);
  AddExport(app, context);
  AddConvert(app, context);
  AddStream(app, context);
  AddRender(app, context);
  AddList(app, context);
  AddInspect(app, context);
  AddOperations(app, context);
  AddCancel(app, context);
  AddRollback(app, context);
  AddDelete(app, context);
  AddDownload(app, context);
}

int ReportStatus(const absl::Status& status) {
  if (status.ok()) return liquidblend::cli::kExitOk;
  const liquidblend::cli::ExitCode code = liquidblend::cli::ToExitCode(status);
  const std::string message(status.message());
  std::fprintf(stderr, "liquidblend: %s\n",
               liquidblend::cli::CleanLine(message.empty() ? status.ToString() : message).c_str());
  const char* advice = liquidblend::cli::Advice(status);
  if (*advice != '\0') std::fprintf(stderr, "%s\n", advice);
  return code;
}

// A word that stands where a command should be. Returns whether there is one.
bool ExplainUnknownCommand(const CLI::App& app) {
  const std::vector<std::string> left_over = app.remaining();
  if (!app.get_subcommands().empty() || left_over.empty() || left_over[0][0] == '-') return false;
  std::vector<std::string> commands;
  for (const CLI::App* command : app.get_subcommands([](const CLI::App*) { return true; })) {
    commands.push_back(command->get_name());
  }
  std::fputs(
      liquidblend::base::UnknownCommandMessage("liquidblend", left_over[0], commands).c_str(),
      stderr);
  return true;
}

}  // namespace

int main(int argc, char** argv) {
  // No log of gRPC: the error says in one sentence why a connection fails.
  setenv("GRPC_VERBOSITY", "NONE", /*overwrite=*/0);
  // Threads of gRPC that still try to connect use OpenSSL when the program ends: it frees nothing.
  OPENSSL_init_crypto(OPENSSL_INIT_NO_ATEXIT, nullptr);
  CLI::App app("Blends registered liquid simulations: weights and a time in, a surface out.",
               "liquidblend");
  app.set_version_flag("--version", liquidblend::base::VersionLine("liquidblend"));
  Context context;
  context.trace = std::make_shared<liquidblend::cli::CommandTrace>(
      [&context](const std::string& line) { context.Remark("liquidblend: " + line); });
  AddGlobalFlags(app, context);
  AddCommands(app, context);
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    if (error.get_exit_code() != 0 && ExplainUnknownCommand(app)) {
      return liquidblend::cli::kExitUsage;
    }
    return app.exit(error) == 0 ? liquidblend::cli::kExitOk : liquidblend::cli::kExitUsage;
  } catch (const std::exception& exception) {  // no memory, or of a library
    context.status = liquidblend::cli::StatusOfException(exception);
  }
  const std::vector<CLI::App*> commands = app.get_subcommands();  // none: it threw before
  if (!commands.empty()) context.trace->End(commands.front()->get_name(), context.status);
  return ReportStatus(context.status);
}
