// State that the sessions of a port share. Only for port.cc: Boost.Beast takes half a minute to
// compile.
#pragma once

#include <utility>  // which this version of asio forgets

#include <boost/asio/dispatch.hpp>
#include <boost/asio/executor_work_guard.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/asio/strand.hpp>
#include <boost/beast/core.hpp>
#include <boost/beast/http.hpp>
#include <boost/beast/websocket.hpp>
#include <chrono>
#include <memory>
#include <string>

#include "server/http/connections.h"
#include "server/http/exchange/host.h"
#include "server/http/port.h"

namespace liquidblend::http {

namespace asio = boost::asio;
namespace beast = boost::beast;
namespace bhttp = boost::beast::http;
namespace websocket = boost::beast::websocket;
using asio::ip::tcp;
using boost::system::error_code;
using HttpRequest = bhttp::request<bhttp::empty_body>;
using HttpResponse = bhttp::response<bhttp::string_body>;

inline constexpr char kServerName[] = "liquidblend";

// The router's options, with the name that the port listens on, if it is one.
inline RouterOptions RouterOptionsOf(const PortOptions& options) {
  RouterOptions router = options.router;
  const std::string host = options.listen.substr(0, options.listen.rfind(':'));
  if (IsHostName(host)) router.hosts.push_back(host);
  return router;
}

// Sessions hold it, so it outlives them.
struct Core {
  Core(server::Api& the_api, const PortOptions& port_options)
      : options(port_options), api(the_api), router(api, RouterOptionsOf(options)) {}

  const PortOptions options;
  server::Api& api;
  Router router;
  const std::shared_ptr<Connections> connections = std::make_shared<Connections>();
  asio::io_context io;
};

inline std::chrono::nanoseconds ChronoOf(absl::Duration duration) {
  return absl::ToChronoNanoseconds(duration);
}

}  // namespace liquidblend::http
