// Routes: what a path leads to.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "liquidblend/v1/liquidblend.pb.h"
#include "server/api/methods.h"
#include "server/transcode/route_table.h"

namespace liquidblend::http {

enum class Resource {
  kNone,
  kHealth,
  kReady,
  kMetrics,
  kPage,
  kFrame,
  kAnimationFrame,
  kStream,
  kMethod
};

struct Route {
  Resource resource = Resource::kNone;
  std::string pattern = "other";                      // the path, for metrics
  std::string family;                                 // or animation: its id, of a frame
  v1::Encoding::Format format = v1::Encoding::DRACO;  // of a frame
  std::vector<std::string> allowed;                   // HTTP methods of the path, but for OPTIONS
  // Method and rule of the API: of kMethod, if the HTTP method is allowed.
  const server::Method* method = nullptr;
  const transcode::HttpRule* rule = nullptr;
  std::string variable;  // what the rule's field gets

  bool Allows(std::string_view http_method) const;
  bool takes_body() const;
};

// All paths of the port.  Threads: safe.
class Routes {
 public:
  Routes();

  // A HEAD takes the way of its GET.
  Route Find(std::string_view http_method, const std::string& path) const;

  const transcode::RouteTable& table() const { return table_; }

 private:
  const transcode::RouteTable table_;
};

}  // namespace liquidblend::http
