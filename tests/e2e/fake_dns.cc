#include "tests/e2e/fake_dns.h"

#include <arpa/inet.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <cstdlib>
#include <utility>

#include "absl/strings/str_cat.h"

namespace liquidblend::e2e {
namespace {

constexpr size_t kHeaderBytes = 12;  // RFC 1035, 4.1.1
constexpr int kTypeA = 1;

std::string TwoBytes(int value) {
  return {static_cast<char>(value >> 8 & 0xff), static_cast<char>(value & 0xff)};
}

// The end of the question, after its name, type and class; 0 if it is cut short.
size_t EndOfQuestion(const std::string& message) {
  size_t at = kHeaderBytes;
  while (at < message.size() && message[at] != 0) at += 1 + static_cast<unsigned char>(message[at]);
  return at + 5 <= message.size() ? at + 5 : 0;
}

}  // namespace

FakeDns::FakeDns(std::vector<std::string> addresses) : addresses_(std::move(addresses)) {
  socket_ = socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
  sockaddr_in local = {};
  local.sin_family = AF_INET;
  local.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  socklen_t size = sizeof(local);
  auto* const address = reinterpret_cast<sockaddr*>(&local);
  if (bind(socket_, address, size) != 0 || getsockname(socket_, address, &size) != 0) std::abort();
  port_ = ntohs(local.sin_port);
  thread_ = std::thread([this] { Serve(); });
}

FakeDns::~FakeDns() {
  sockaddr_in to = {};
  to.sin_family = AF_INET;
  to.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  to.sin_port = htons(static_cast<uint16_t>(port_));
  sendto(socket_, "", 0, 0, reinterpret_cast<const sockaddr*>(&to), sizeof(to));  // ends Serve()
  thread_.join();
  close(socket_);
}

void FakeDns::SetAddresses(std::vector<std::string> addresses) {
  const absl::MutexLock lock(&mutex_);
  addresses_ = std::move(addresses);
}

std::string FakeDns::Target(const std::string& name, int port) const {
  return absl::StrCat("dns://127.0.0.1:", port_, "/", name, ":", port);
}

void FakeDns::Serve() {
  std::array<char, 512> buffer;
  while (true) {
    sockaddr_in from = {};
    socklen_t size = sizeof(from);
    auto* const address = reinterpret_cast<sockaddr*>(&from);
    const ssize_t length = recvfrom(socket_, buffer.data(), buffer.size(), 0, address, &size);
    if (length <= 0) return;
    const std::string answer = AnswerTo(std::string(buffer.data(), static_cast<size_t>(length)));
    if (!answer.empty()) sendto(socket_, answer.data(), answer.size(), 0, address, size);
  }
}

std::string FakeDns::AnswerTo(const std::string& question) {
  const size_t end = EndOfQuestion(question);
  if (end == 0) return "";
  const bool is_for_ipv4 = question[end - 4] == 0 && question[end - 3] == kTypeA;
  const absl::MutexLock lock(&mutex_);
  const int num_answers = is_for_ipv4 ? static_cast<int>(addresses_.size()) : 0;
  std::string answer =
      absl::StrCat(question.substr(0, 2), TwoBytes(0x8180), TwoBytes(1), TwoBytes(num_answers),
                   TwoBytes(0), TwoBytes(0), question.substr(kHeaderBytes, end - kHeaderBytes));
  for (int k = 0; k < num_answers; ++k) {
    in_addr ip;
    inet_pton(AF_INET, addresses_[static_cast<size_t>(k)].c_str(), &ip);
    // The question's name, type A, class IN, no time to live, four bytes.
    absl::StrAppend(&answer, TwoBytes(0xc00c), TwoBytes(kTypeA), TwoBytes(1), TwoBytes(0),
                    TwoBytes(0), TwoBytes(4),
                    std::string(reinterpret_cast<const char*>(&ip), sizeof(ip)));
  }
  return answer;
}

}  // namespace liquidblend::e2e
