#include "client/cli/flags/context.h"

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <fstream>
#include <nlohmann/json.hpp>

#include "absl/strings/ascii.h"
#include "absl/strings/str_cat.h"
#include "client/cli/flags/clean_text.h"
#include "client/src/status_macros.h"

namespace liquidblend::cli {
namespace {

// The first line, which holds nothing else.
absl::StatusOr<std::string> ReadToken(const std::string& path) {
  std::ifstream file(path);
  if (!file) {
    return absl::NotFoundError(
        absl::StrCat("--token-file ", path, ": cannot be read: ", std::strerror(errno)));
  }
  std::string line;
  std::getline(file, line);
  const std::string token(absl::StripAsciiWhitespace(line));
  if (token.empty()) {
    return absl::NotFoundError(absl::StrCat("--token-file ", path, ": holds no token"));
  }
  if (token.find(' ') != std::string::npos) {
    return absl::InvalidArgumentError(absl::StrCat(
        "--token-file ", path, ": its first line must be the token alone, and has spaces"));
  }
  return token;
}

}  // namespace

absl::StatusOr<std::unique_ptr<Client>> Context::Connect() const {
  ConnectOptions options;
  options.target = server;
  options.connect_timeout = absl::Seconds(connect_timeout_s);
  options.retry.patience = absl::Seconds(patience_s);
  options.security = security;
  options.direct_transfers = !no_direct;
  if (trace != nullptr) options.trace = [trace = trace] { return trace->HeadersOfCall(); };
  if (!token_file.empty()) {
    LBC_ASSIGN_OR_RETURN(options.security.token, ReadToken(token_file));
  }
  return Client::Connect(options);
}

void Context::Print(const std::string& line) const { PrintText(CleanLine(line)); }

void Context::PrintText(const std::string& text) const {
  if (json) return;
  std::fprintf(stdout, "%s\n", CleanText(text).c_str());
  std::fflush(stdout);
}

void Context::PrintJson(const nlohmann::ordered_json& value) const {
  if (!json) return;
  const std::string text =
      EscapeJson(value.dump(2, ' ', false, nlohmann::ordered_json::error_handler_t::replace));
  std::fprintf(stdout, "%s\n", text.c_str());
  std::fflush(stdout);
}

void Context::Remark(const std::string& line) const {
  if (!quiet) std::fprintf(stderr, "%s\n", CleanLine(line).c_str());
}

}  // namespace liquidblend::cli
