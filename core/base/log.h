// The programs' log: one line per event on standard error.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"

namespace liquidblend::base {

// Level of an event in the log.
enum class LogLevel { kDebug, kInfo, kWarning, kError };

// Form of the lines of the log.
//   kText  TIME PROGRAM[PID] LEVEL: MESSAGE name=value ...
//   kJson  {"time", "program", "pid", "level", "message", and each field as a string}
enum class LogFormat { kText, kJson };

// The format with this name, "text" or "json".  Errors: kInvalidArgument.
absl::StatusOr<LogFormat> ParseLogFormat(absl::string_view name);

// Fields of an event, in order: names of [a-z_]+, any values.
using LogFields = std::vector<std::pair<std::string, std::string>>;

// Sets the program's name (in every line), the lowest level that is printed and the form of the
// lines. Call once in main.
void StartLog(absl::string_view program, LogLevel lowest, LogFormat format = LogFormat::kText);

// Whether events of this level are printed. If not, callers need not assemble them.
bool IsLogged(LogLevel level);

// Prints one line whatever the message and the values hold: control characters are escaped.
// Threads: safe.
void Log(LogLevel level, absl::string_view message, const LogFields& fields = {});
inline void LogInfo(absl::string_view message) { Log(LogLevel::kInfo, message); }
inline void LogWarning(absl::string_view message) { Log(LogLevel::kWarning, message); }
inline void LogError(absl::string_view message) { Log(LogLevel::kError, message); }

}  // namespace liquidblend::base
