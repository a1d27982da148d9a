// The programs' log: one line per event on standard error.
#pragma once

#include <string>

#include "absl/strings/string_view.h"

namespace liquidblend::base {

enum class LogLevel { kDebug, kInfo, kWarning, kError };

// Sets the program's name (in every line) and the lowest level that is printed. Call once in main.
void StartLog(absl::string_view program, LogLevel lowest);

// Threads: safe.
void Log(LogLevel level, absl::string_view message);
inline void LogInfo(absl::string_view message) { Log(LogLevel::kInfo, message); }
inline void LogWarning(absl::string_view message) { Log(LogLevel::kWarning, message); }
inline void LogError(absl::string_view message) { Log(LogLevel::kError, message); }

}  // namespace liquidblend::base
