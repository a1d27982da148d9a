#include "tests/e2e/faults/fault_proxy.h"

#include <arpa/inet.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <algorithm>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <utility>

namespace liquidblend::e2e {
namespace {

constexpr int kPollMs = 5;

bool SendAll(int to, const std::string& bytes) {
  for (size_t begin = 0; begin < bytes.size();) {
    const ssize_t sent = send(to, bytes.data() + begin, bytes.size() - begin, MSG_NOSIGNAL);
    if (sent <= 0) return false;
    begin += static_cast<size_t>(sent);
  }
  return true;
}

// A socket that is connected to the address, or -1.
template <typename Address>
int ConnectTo(const Address& address, int family) {
  const int server = socket(family, SOCK_STREAM | SOCK_CLOEXEC, 0);
  if (connect(server, reinterpret_cast<const sockaddr*>(&address), sizeof(address)) == 0) {
    return server;
  }
  close(server);
  return -1;
}

int ConnectToPath(const std::string& path) {
  sockaddr_un address = {};
  address.sun_family = AF_UNIX;
  std::strncpy(address.sun_path, path.c_str(), sizeof(address.sun_path) - 1);
  return ConnectTo(address, AF_UNIX);
}

int ConnectToPort(int port) {
  sockaddr_in address = {};
  address.sin_family = AF_INET;
  address.sin_port = htons(static_cast<uint16_t>(port));
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  return ConnectTo(address, AF_INET);
}

}  // namespace

FaultProxy::FaultProxy(const std::string& socket_path)
    : FaultProxy([socket_path] { return ConnectToPath(socket_path); }) {}

FaultProxy::FaultProxy(int server_port)
    : FaultProxy([server_port] { return ConnectToPort(server_port); }) {}

FaultProxy::FaultProxy(std::function<int()> connect) : connect_(std::move(connect)) {
  thread_ = std::thread([this] { Serve(); });
}

FaultProxy::~FaultProxy() {
  is_over_ = true;
  listener_.Shutdown();
  thread_.join();
}

void FaultProxy::Once(const std::string& words, int number, std::function<void()> before,
                      std::function<void()> after) {
  is_struck_ = false;
  const absl::MutexLock lock(&mutex_);
  strike_ = {words, number, std::move(before), std::move(after)};
}

void FaultProxy::Serve() {
  std::vector<std::thread> threads;
  while (true) {
    const int client = listener_.Accept();
    if (client < 0) break;
    threads.emplace_back([this, client] {
      Handle(client);
      close(client);
    });
  }
  for (std::thread& thread : threads) thread.join();
}

void FaultProxy::Handle(int client) {
  while (is_cut_ && !is_over_) poll(nullptr, 0, kPollMs);
  const int server = connect_();
  if (server < 0) return;
  while (!is_over_) {
    if (is_cut_) {
      poll(nullptr, 0, kPollMs);
      continue;
    }
    pollfd ends[2] = {{client, POLLIN, 0}, {server, POLLIN, 0}};
    if (poll(ends, 2, kPollMs) <= 0 || is_cut_) continue;
    if (ends[0].revents != 0 && !Forward(client, server, true)) break;
    if (ends[1].revents != 0 && !is_cut_ && !Forward(server, client, false)) break;
  }
  close(server);
}

bool FaultProxy::Forward(int from, int to, bool is_from_client) {
  std::string bytes(65536, '\0');
  const ssize_t received = recv(from, bytes.data(), bytes.size(), 0);
  if (received <= 0) return false;
  bytes.resize(static_cast<size_t>(received));
  const Strike strike = is_from_client ? StrikeAt(bytes) : Strike();
  if (strike.before) strike.before();
  while (is_cut_ && !is_over_) poll(nullptr, 0, kPollMs);
  const bool is_sent = SendAll(to, bytes);
  if (strike.after) strike.after();
  if (!strike.words.empty()) is_struck_ = true;
  return is_sent;
}

FaultProxy::Strike FaultProxy::StrikeAt(const std::string& bytes) {
  const absl::MutexLock lock(&mutex_);
  if (strike_.words.empty() || bytes.find(strike_.words) == std::string::npos) return {};
  if (--strike_.number > 0) return {};
  return std::exchange(strike_, {});
}

}  // namespace liquidblend::e2e
