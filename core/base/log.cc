#include "core/base/log.h"

#include <spdlog/sinks/stdout_sinks.h>
#include <spdlog/spdlog.h>
#include <unistd.h>

#include <atomic>
#include <nlohmann/json.hpp>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "absl/time/clock.h"
#include "absl/time/time.h"

namespace liquidblend::base {
namespace {

std::atomic<LogFormat> log_format = LogFormat::kText;

spdlog::level::level_enum SpdlogLevel(LogLevel level) {
  switch (level) {
    case LogLevel::kDebug:
      return spdlog::level::debug;
    case LogLevel::kInfo:
      return spdlog::level::info;
    case LogLevel::kWarning:
      return spdlog::level::warn;
    case LogLevel::kError:
      return spdlog::level::err;
  }
  return spdlog::level::info;
}

const char* LevelName(LogLevel level) {
  switch (level) {
    case LogLevel::kDebug:
      return "debug";
    case LogLevel::kInfo:
      return "info";
    case LogLevel::kWarning:
      return "warning";
    case LogLevel::kError:
      return "error";
  }
  return "";
}

// Escapes line ends, so that text from clients cannot imitate log lines.
std::string OnOneLine(absl::string_view text) {
  std::string line;
  for (const char c : text) {
    const auto byte = static_cast<unsigned char>(c);
    if (byte < 0x20 || byte == 0x7F) {
      absl::StrAppendFormat(&line, "\\x%02x", byte);
    } else {
      line += c;
    }
  }
  return line;
}

// The value, in quotes if its end would not be clear without.
std::string Value(const std::string& text) {
  const bool is_plain = !text.empty() && text.find_first_of(" \"=\\") == std::string::npos;
  if (is_plain) return text;
  std::string quoted = "\"";
  for (const char c : text) {
    if (c == '"' || c == '\\') quoted += '\\';
    quoted += c;
  }
  return quoted + "\"";
}

std::string TextLine(absl::string_view message, const LogFields& fields) {
  std::string line = OnOneLine(message);
  for (const auto& [name, value] : fields) {
    absl::StrAppend(&line, " ", name, "=", Value(OnOneLine(value)));
  }
  return line;
}

std::string JsonLine(const std::string& program, LogLevel level, absl::string_view message,
                     const LogFields& fields) {
  nlohmann::ordered_json line;
  line["time"] = absl::FormatTime("%Y-%m-%dT%H:%M:%E3SZ", absl::Now(), absl::UTCTimeZone());
  line["program"] = program;
  line["pid"] = getpid();
  line["level"] = LevelName(level);
  line["message"] = std::string(message);
  for (const auto& [name, value] : fields) line[name] = value;
  return line.dump(-1, ' ', false, nlohmann::ordered_json::error_handler_t::replace);
}

}  // namespace

absl::StatusOr<LogFormat> ParseLogFormat(absl::string_view name) {
  if (name == "text") return LogFormat::kText;
  if (name == "json") return LogFormat::kJson;
  return absl::InvalidArgumentError(
      absl::StrCat("a log's format is text or json, got '", name, "'"));
}

void StartLog(absl::string_view program, LogLevel lowest, LogFormat format) {
  spdlog::drop(std::string(program));
  auto logger = spdlog::stderr_logger_mt(std::string(program));
  logger->set_pattern(format == LogFormat::kJson ? "%v" : "%Y-%m-%dT%H:%M:%S.%e %n[%P] %l: %v");
  logger->set_level(SpdlogLevel(lowest));
  logger->flush_on(spdlog::level::info);
  log_format = format;
  spdlog::set_default_logger(std::move(logger));
}

bool IsLogged(LogLevel level) {
  return spdlog::default_logger_raw()->should_log(SpdlogLevel(level));
}

void Log(LogLevel level, absl::string_view message, const LogFields& fields) {
  if (!IsLogged(level)) return;
  spdlog::logger& logger = *spdlog::default_logger_raw();
  const std::string line = log_format == LogFormat::kJson
                               ? JsonLine(logger.name(), level, message, fields)
                               : TextLine(message, fields);
  logger.log(SpdlogLevel(level), spdlog::string_view_t(line.data(), line.size()));
}

}  // namespace liquidblend::base
