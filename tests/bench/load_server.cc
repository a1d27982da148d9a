#include "tests/bench/load_server.h"

#include <grpcpp/grpcpp.h>

#include <cstdlib>
#include <vector>

#include "absl/status/status.h"
#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/string_view.h"
#include "absl/strings/strip.h"
#include "core/base/status_macros.h"
#include "liquidblend/v1/liquidblend.grpc.pb.h"
#include "tests/server/http/http_client.h"

namespace liquidblend::bench {
namespace {

std::vector<std::string> Arguments(const LoadServerOptions& options) {
  return {"--data",        options.data,
          "--listen",      "127.0.0.1:0",
          "--http",        "127.0.0.1:0",
          "--workers",     "0",
          "--threads",     absl::StrCat(options.num_threads),
          "--frame-cache", absl::StrCat(static_cast<int64_t>(1e6 * options.frame_cache_mb))};
}

// What follows `prefix` on the next line that the program prints.
absl::StatusOr<std::string> Announced(const std::string& prefix, e2e::Process& process) {
  const std::string line = process.ReadLine();
  absl::string_view rest = line;
  if (absl::ConsumePrefix(&rest, prefix)) return std::string(rest);
  return absl::UnavailableError(absl::StrCat("the server says '", line, "', not '", prefix, "'"));
}

// The value of a sample in Prometheus' text format.
absl::StatusOr<double> ValueOf(const std::string& sample, const std::string& text) {
  const size_t at = text.find("\n" + sample + " ");
  if (at == std::string::npos) return absl::UnavailableError("no metric " + sample);
  return std::strtod(text.c_str() + at + sample.size() + 2, nullptr);
}

// What an event that has not been counted yet leaves out.
double ValueOrZero(const std::string& sample, const std::string& text) {
  return ValueOf(sample, text).value_or(0.0);
}

}  // namespace

absl::StatusOr<std::unique_ptr<LoadServer>> LoadServer::Start(const LoadServerOptions& options) {
  e2e::Process process("liquidblend-server", Arguments(options));
  LB_ASSIGN_OR_RETURN(const std::string address, Announced("listening on ", process));
  LB_ASSIGN_OR_RETURN(const std::string http, Announced("http on ", process));
  int http_port = 0;
  if (!absl::SimpleAtoi(http.substr(http.rfind(':') + 1), &http_port)) {
    return absl::UnavailableError(absl::StrCat("no port in '", http, "'"));
  }
  return std::unique_ptr<LoadServer>(new LoadServer(std::move(process), address, http_port));
}

absl::StatusOr<LoadTarget> LoadServer::Target(const std::string& family) const {
  const auto stub =
      v1::LiquidBlend::NewStub(grpc::CreateChannel(address_, grpc::InsecureChannelCredentials()));
  v1::GetFamilyRequest request;
  request.set_name(absl::StrCat("families/", family));
  grpc::ClientContext context;
  v1::Family found;
  const grpc::Status status = stub->GetFamily(&context, request, &found);
  if (!status.ok()) return absl::NotFoundError(status.error_message());
  return LoadTarget{address_, request.name(), found.targets_size(), found.duration_s()};
}

absl::StatusOr<std::string> LoadServer::ReadMetrics() const {
  const http::HttpReply reply = http::HttpClient(http_port_).Get("/metrics");
  if (reply.code == 200) return reply.body;
  return absl::UnavailableError(absl::StrCat("/metrics answers ", reply.code));
}

absl::StatusOr<StageSums> LoadServer::ReadStageSums() const {
  LB_ASSIGN_OR_RETURN(const std::string text, ReadMetrics());
  const auto seconds = [&](const std::string& stage) {
    return ValueOrZero("liquidblend_frame_stage_seconds_sum{stage=\"" + stage + "\"}", text);
  };
  return StageSums{seconds("queue"), seconds("slice"), seconds("encode"),
                   ValueOrZero("liquidblend_frame_stage_seconds_count{stage=\"encode\"}", text)};
}

absl::StatusOr<MemoryFigures> LoadServer::ReadMemory() const {
  LB_ASSIGN_OR_RETURN(const std::string text, ReadMetrics());
  LB_ASSIGN_OR_RETURN(const double resident, ValueOf("process_resident_memory_bytes", text));
  LB_ASSIGN_OR_RETURN(const double used, ValueOf("liquidblend_heap_bytes{state=\"used\"}", text));
  return MemoryFigures{resident / 1e6, used / 1e6};
}

}  // namespace liquidblend::bench
