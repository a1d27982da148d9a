#include "tests/core/store/blobs/http_fake.h"

#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cstdlib>
#include <list>
#include <memory>
#include <utility>
#include <vector>

#include "absl/strings/ascii.h"
#include "absl/strings/match.h"
#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_split.h"

namespace liquidblend::store {
namespace {

std::string Decode(absl::string_view text) {
  std::string decoded;
  for (size_t k = 0; k < text.size(); ++k) {
    if (text[k] == '%' && k + 2 < text.size()) {
      decoded.push_back(
          static_cast<char>(std::strtol(std::string(text.substr(k + 1, 2)).c_str(), nullptr, 16)));
      k += 2;
    } else {
      decoded.push_back(text[k]);
    }
  }
  return decoded;
}

bool SendAll(int connection, absl::string_view bytes) {
  while (!bytes.empty()) {
    const ssize_t sent = send(connection, bytes.data(), bytes.size(), MSG_NOSIGNAL);
    if (sent <= 0) return false;
    bytes.remove_prefix(static_cast<size_t>(sent));
  }
  return true;
}

bool Read(int connection, HttpFake::Request& request) {
  std::string bytes;
  char buffer[65536];
  const auto more = [&] {
    const ssize_t received = recv(connection, buffer, sizeof(buffer), 0);
    if (received > 0) bytes.append(buffer, static_cast<size_t>(received));
    return received > 0;
  };
  while (!absl::StrContains(bytes, "\r\n\r\n")) {
    if (!more()) return false;
  }
  const size_t end = bytes.find("\r\n\r\n");
  const std::vector<std::string> lines = absl::StrSplit(bytes.substr(0, end), "\r\n");
  const std::vector<std::string> words = absl::StrSplit(lines[0], ' ');
  const std::vector<std::string> target = absl::StrSplit(words[1], absl::MaxSplits('?', 1));
  request.method = words[0];
  request.path = Decode(target[0]);
  for (size_t k = 1; k < lines.size(); ++k) {
    const std::pair<std::string, std::string> header =
        absl::StrSplit(lines[k], absl::MaxSplits(':', 1));
    request.headers[absl::AsciiStrToLower(header.first)] =
        std::string(absl::StripAsciiWhitespace(header.second));
  }
  if (target.size() > 1) {
    for (const auto& item : absl::StrSplit(target[1], '&')) {
      const std::pair<std::string, std::string> pair =
          absl::StrSplit(item, absl::MaxSplits('=', 1));
      request.query[Decode(pair.first)] = Decode(pair.second);
    }
  }
  size_t length = 0;
  if (!absl::SimpleAtoi(request.headers["content-length"], &length)) length = 0;
  while (bytes.size() < end + 4 + length) {
    if (!more()) return false;
  }
  request.body = bytes.substr(end + 4, length);
  return true;
}

}  // namespace

void HttpFake::Connection::Send(const Answer& answer, size_t num_sent) {
  const std::string head =
      absl::StrCat("HTTP/1.1 ", answer.status,
                   " Status\r\nConnection: close\r\nContent-Length: ", answer.body.size(), "\r\n",
                   answer.headers, "\r\n");
  if (SendAll(fd_, head)) SendAll(fd_, absl::string_view(answer.body).substr(0, num_sent));
}

bool HttpFake::Connection::SendMore(const std::string& bytes) { return SendAll(fd_, bytes); }

void HttpFake::Connection::Reset() {
  const linger at_once = {1, 0};
  setsockopt(fd_, SOL_SOCKET, SO_LINGER, &at_once, sizeof(at_once));
}

HttpFake::HttpFake(Handler handler)
    : HttpFake(RawHandler(
          [this, handler = std::move(handler)](Connection& connection, const Request& request) {
            Answer answer;
            {
              const absl::MutexLock lock(&handler_mutex_);
              answer = handler(request);
            }
            connection.Send(answer, request.method == "HEAD" ? 0 : answer.body.size());
          })) {}

HttpFake::HttpFake(RawHandler handler) : handler_(std::move(handler)) {
  thread_ = std::thread([this] { Serve(); });
}

HttpFake::~HttpFake() {
  listener_.Shutdown();
  thread_.join();
}

std::string HttpFake::url() const { return absl::StrCat("http://127.0.0.1:", listener_.port()); }

int HttpFake::num_requests() {
  const absl::MutexLock lock(&mutex_);
  return num_requests_;
}

void HttpFake::Serve() {
  struct Served {
    std::thread thread;
    std::unique_ptr<std::atomic<bool>> is_done = std::make_unique<std::atomic<bool>>(false);
  };
  std::list<Served> all;
  while (true) {
    const int connection = listener_.Accept();
    if (connection < 0) break;
    all.remove_if([](Served& one) {
      if (!*one.is_done) return false;
      one.thread.join();
      return true;
    });
    Served& served = all.emplace_back();
    served.thread = std::thread([this, connection, is_done = served.is_done.get()] {
      Handle(connection);
      close(connection);
      *is_done = true;
    });
  }
  for (Served& one : all) one.thread.join();
}

void HttpFake::Handle(int fd) {
  Request request;
  if (!Read(fd, request)) return;
  {
    const absl::MutexLock lock(&mutex_);
    ++num_requests_;
  }
  Connection connection(fd);
  handler_(connection, std::move(request));
}

}  // namespace liquidblend::store
