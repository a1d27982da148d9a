#include "tests/bench/load_server.h"

#include <grpcpp/grpcpp.h>

#include <cstdlib>
#include <vector>

#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/string_view.h"
#include "absl/strings/strip.h"
#include "liquidblend/v1/liquidblend.grpc.pb.h"
#include "tests/bench/load_family.h"
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
std::string Announced(e2e::Process& process, const std::string& prefix) {
  const std::string line = process.ReadLine();
  absl::string_view rest = line;
  if (absl::ConsumePrefix(&rest, prefix)) return std::string(rest);
  Require(absl::UnavailableError(absl::StrCat("the server says '", line, "', not '", prefix, "'")));
  return "";
}

// The value of a sample in Prometheus' text format; 0 if it is not there.
double ValueOf(const std::string& text, const std::string& sample) {
  const size_t at = text.find("\n" + sample + " ");
  return at == std::string::npos ? 0.0
                                 : std::strtod(text.c_str() + at + sample.size() + 2, nullptr);
}

}  // namespace

LoadServer::LoadServer(const LoadServerOptions& options)
    : process_("liquidblend-server", Arguments(options)),
      address_(Announced(process_, "listening on ")) {
  const std::string http = Announced(process_, "http on ");
  if (!absl::SimpleAtoi(http.substr(http.rfind(':') + 1), &http_port_)) {
    Require(absl::UnavailableError(absl::StrCat("no port in '", http, "'")));
  }
}

LoadTarget LoadServer::Target(const std::string& family) const {
  const auto stub =
      v1::LiquidBlend::NewStub(grpc::CreateChannel(address_, grpc::InsecureChannelCredentials()));
  v1::GetFamilyRequest request;
  request.set_name(absl::StrCat("families/", family));
  grpc::ClientContext context;
  v1::Family found;
  const grpc::Status status = stub->GetFamily(&context, request, &found);
  if (!status.ok()) Require(absl::NotFoundError(status.error_message()));
  return {address_, request.name(), found.targets_size(), found.duration_s()};
}

StageSums LoadServer::stage_sums() const {
  const std::string text = http::HttpClient(http_port_).Get("/metrics").body;
  const auto seconds = [&](const std::string& stage) {
    return ValueOf(text, "liquidblend_frame_stage_seconds_sum{stage=\"" + stage + "\"}");
  };
  return {seconds("queue"), seconds("slice"), seconds("encode"),
          ValueOf(text, "liquidblend_frame_stage_seconds_count{stage=\"encode\"}")};
}

MemoryFigures LoadServer::memory() const {
  const std::string text = http::HttpClient(http_port_).Get("/metrics").body;
  return {ValueOf(text, "process_resident_memory_bytes") / 1e6,
          ValueOf(text, "liquidblend_heap_bytes{state=\"used\"}") / 1e6};
}

}  // namespace liquidblend::bench
