// The HTTP port by Boost.Beast, which no other source includes, as it takes half a minute to
// compile.
#include "server/http/port.h"

#include <netinet/tcp.h>

#include <exception>
#include <optional>
#include <thread>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/synchronization/mutex.h"
#include "core/base/log.h"
#include "core/base/status_macros.h"
#include "server/http/core.h"
#include "server/http/http_session.h"

namespace liquidblend::http {
namespace {

constexpr std::chrono::milliseconds kAcceptPause(100);  // when no connection can be had

std::string AddressOf(const tcp::endpoint& endpoint) {
  const std::string host = endpoint.address().to_string();
  return endpoint.address().is_v6() ? absl::StrCat("[", host, "]:", endpoint.port())
                                    : absl::StrCat(host, ":", endpoint.port());
}

// A peer that has vanished without a word is noticed within a minute, even if nothing is sent to
// it.
void NoticeVanishedPeer(tcp::socket& socket) {
  error_code ignored;
  socket.set_option(asio::socket_base::keep_alive(true), ignored);
  const auto set = [&](auto option) { socket.set_option(option, ignored); };
  set(asio::detail::socket_option::integer<IPPROTO_TCP, TCP_KEEPIDLE>(30));
  set(asio::detail::socket_option::integer<IPPROTO_TCP, TCP_KEEPINTVL>(10));
  set(asio::detail::socket_option::integer<IPPROTO_TCP, TCP_KEEPCNT>(3));
}

}  // namespace

// Held by the accepting operations.
struct Port::Impl : std::enable_shared_from_this<Port::Impl> {
  Impl(server::Api& api, const PortOptions& options) : core(std::make_shared<Core>(api, options)) {}

  absl::Status Listen();
  void Accept();
  void AcceptLater();
  void OnAccept(error_code error, tcp::socket socket);
  void Run();

  const std::shared_ptr<Core> core;
  asio::executor_work_guard<asio::io_context::executor_type> work{core->io.get_executor()};
  tcp::acceptor acceptor{asio::make_strand(core->io)};
  asio::steady_timer pause{acceptor.get_executor()};
  std::string address;
  int port = 0;
  absl::Mutex stopping;  // held by whoever stops it
  std::vector<std::thread> threads;
};

absl::Status Port::Impl::Listen() {
  const size_t colon = core->options.listen.rfind(':');
  std::string host = core->options.listen.substr(0, colon);
  if (host.size() > 2 && host.front() == '[') host = host.substr(1, host.size() - 2);
  error_code error;
  const auto found = tcp::resolver(core->io).resolve(host, core->options.listen.substr(colon + 1),
                                                     tcp::resolver::passive, error);
  const tcp::endpoint endpoint = error ? tcp::endpoint() : found.begin()->endpoint();
  if (!error) acceptor.open(endpoint.protocol(), error);
  if (!error) acceptor.set_option(tcp::acceptor::reuse_address(true), error);
  if (!error) acceptor.bind(endpoint, error);
  if (!error) acceptor.listen(asio::socket_base::max_listen_connections, error);
  if (error) {
    return absl::FailedPreconditionError(
        absl::StrCat("cannot serve HTTP on ", core->options.listen, ": ", error.message(),
                     "; stop what listens there, or give another --http"));
  }
  port = acceptor.local_endpoint().port();
  address = absl::StrCat(core->options.listen.substr(0, colon), ":", port);
  return absl::OkStatus();
}

void Port::Impl::Accept() {
  acceptor.async_accept(asio::make_strand(core->io),
                        [self = shared_from_this()](error_code error, tcp::socket socket) {
                          self->OnAccept(error, std::move(socket));
                        });
}

void Port::Impl::AcceptLater() {
  pause.expires_after(kAcceptPause);
  pause.async_wait([self = shared_from_this()](error_code cancelled) {
    if (cancelled || !self->acceptor.is_open()) return;
    try {
      self->Accept();
    } catch (const std::exception&) {
      self->AcceptLater();
    }
  });
}

void Port::Impl::OnAccept(error_code error, tcp::socket socket) {
  if (!acceptor.is_open()) return;
  if (error) return AcceptLater();  // out of file descriptors: some will be free again
  try {
    Accept();
  } catch (const std::exception&) {  // out of memory: likewise
    AcceptLater();
  }
  std::optional<Connections::Ticket> ticket =
      core->connections->Enter(core->options.max_connections);
  if (!ticket.has_value()) return core->api.metrics().CountRefusedConnection();
  error_code ignored;
  socket.set_option(tcp::no_delay(true), ignored);
  NoticeVanishedPeer(socket);
  socket.non_blocking(true, ignored);
  const std::string peer = AddressOf(socket.remote_endpoint(ignored));
  std::make_shared<HttpSession>(core, *std::move(ticket), std::move(socket), peer)->Begin();
}

// Until nothing is left to do. What a handler throws (out of memory) ends its connection only.
void Port::Impl::Run() {
  while (true) {
    try {
      core->io.run();
      return;
    } catch (const std::exception& error) {
      base::LogError(absl::StrCat("http: ", error.what()));
    }
  }
}

absl::StatusOr<std::unique_ptr<Port>> Port::Start(server::Api& api, const PortOptions& options) {
  LB_RETURN_IF_ERROR(options.Validate());
  auto impl = std::make_shared<Impl>(api, options);
  LB_RETURN_IF_ERROR(impl->Listen());
  impl->Accept();
  for (int i = 0; i < options.num_threads; ++i) {
    impl->threads.emplace_back([&port = *impl] { port.Run(); });
  }
  return std::unique_ptr<Port>(new Port(std::move(impl)));
}

Port::Port(std::shared_ptr<Impl> impl) : impl_(std::move(impl)) {}

Port::~Port() { Stop(absl::ZeroDuration()); }

const std::string& Port::address() const { return impl_->address; }

int Port::port() const { return impl_->port; }

void Port::Drain() {
  absl::MutexLock lock(&impl_->stopping);
  impl_->core->router.SetDraining();
  impl_->core->connections->Advance(Phase::kDraining);
}

void Port::Stop(absl::Duration patience) {
  Drain();
  absl::MutexLock lock(&impl_->stopping);
  if (impl_->threads.empty()) return;  // nobody would run what is posted now
  asio::post(impl_->acceptor.get_executor(), [impl = impl_] {
    error_code ignored;
    impl->acceptor.close(ignored);
    impl->pause.cancel();
  });
  impl_->core->connections->Advance(Phase::kStopping);
  if (!impl_->core->connections->AwaitNone(patience)) {
    impl_->core->connections->Advance(Phase::kAborting);
    impl_->core->connections->AwaitNone(absl::InfiniteDuration());
  }
  impl_->work.reset();
  for (std::thread& thread : impl_->threads) thread.join();
  impl_->threads.clear();
}

}  // namespace liquidblend::http
