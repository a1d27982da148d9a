#include "client/cli/context.h"

#include <cstdio>
#include <nlohmann/json.hpp>

namespace liquidblend::cli {

absl::StatusOr<std::unique_ptr<Client>> Context::Connect() const {
  ConnectOptions options;
  options.target = server;
  options.connect_timeout = absl::Seconds(connect_timeout_s);
  return Client::Connect(options);
}

void Context::Print(const std::string& line) const {
  if (json) return;
  std::fprintf(stdout, "%s\n", line.c_str());
  std::fflush(stdout);
}

void Context::PrintJson(const nlohmann::ordered_json& value) const {
  if (!json) return;
  const std::string text =
      value.dump(2, ' ', false, nlohmann::ordered_json::error_handler_t::replace);
  std::fprintf(stdout, "%s\n", text.c_str());
  std::fflush(stdout);
}

void Context::Remark(const std::string& line) const {
  if (!quiet) std::fprintf(stderr, "%s\n", line.c_str());
}

}  // namespace liquidblend::cli
