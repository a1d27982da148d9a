// The subcommands: each function adds one to the parser. When it is chosen and its flags are
// right, it runs and leaves its status in the context, which must outlive the parser.
#pragma once

#include <CLI/App.hpp>

#include "client/cli/flags/context.h"

namespace liquidblend::cli {

void AddImport(CLI::App& app, Context& context);
void AddRegister(CLI::App& app, Context& context);
void AddFrame(CLI::App& app, Context& context);
void AddExport(CLI::App& app, Context& context);
void AddConvert(CLI::App& app, Context& context);
void AddStream(CLI::App& app, Context& context);
void AddRender(CLI::App& app, Context& context);
void AddList(CLI::App& app, Context& context);
void AddInspect(CLI::App& app, Context& context);
void AddOperations(CLI::App& app, Context& context);
void AddCancel(CLI::App& app, Context& context);
void AddRollback(CLI::App& app, Context& context);
void AddDelete(CLI::App& app, Context& context);
void AddDownload(CLI::App& app, Context& context);

}  // namespace liquidblend::cli
