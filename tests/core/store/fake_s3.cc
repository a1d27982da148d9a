#include "tests/core/store/fake_s3.h"

#include <arpa/inet.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <cstdlib>

#include "absl/strings/ascii.h"
#include "absl/strings/match.h"
#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_split.h"

namespace liquidblend::store {
namespace {

constexpr size_t kPageSize = 3;  // small, so that there are several

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

void Reset(int connection) {
  const linger at_once = {1, 0};
  setsockopt(connection, SOL_SOCKET, SO_LINGER, &at_once, sizeof(at_once));
}

}  // namespace

FakeS3::FakeS3() : listener_(socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0)) {
  sockaddr_in address = {};
  address.sin_family = AF_INET;
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  socklen_t size = sizeof(address);
  if (bind(listener_, reinterpret_cast<sockaddr*>(&address), size) != 0 ||
      listen(listener_, 64) != 0 ||
      getsockname(listener_, reinterpret_cast<sockaddr*>(&address), &size) != 0) {
    std::abort();
  }
  port_ = ntohs(address.sin_port);
  thread_ = std::thread([this] { Serve(); });
}

FakeS3::~FakeS3() {
  shutdown(listener_, SHUT_RDWR);
  thread_.join();
  close(listener_);
}

std::string FakeS3::endpoint() const { return absl::StrCat("http://127.0.0.1:", port_); }

void FakeS3::Plan(const std::string& method, std::vector<Fault> faults) {
  const absl::MutexLock lock(&mutex_);
  faults_[method].assign(faults.begin(), faults.end());
}

int FakeS3::Count(const std::string& method) {
  const absl::MutexLock lock(&mutex_);
  return counts_[method];
}

std::map<std::string, std::string> FakeS3::Objects() {
  const absl::MutexLock lock(&mutex_);
  return objects_;
}

int FakeS3::NumOpenUploads() {
  const absl::MutexLock lock(&mutex_);
  return static_cast<int>(uploads_.size());
}

void FakeS3::Serve() {
  std::vector<std::thread> threads;
  while (true) {
    const int connection = accept4(listener_, nullptr, nullptr, SOCK_CLOEXEC);
    if (connection < 0) break;
    threads.emplace_back([this, connection] {
      Handle(connection);
      close(connection);
    });
  }
  for (std::thread& thread : threads) thread.join();
}

// One request for each connection.
void FakeS3::Handle(int connection) {
  Request request;
  if (!Read(connection, request)) return;
  const Fault fault = NextFault(request.method);
  if (fault == Fault::kReset) return Reset(connection);
  Answer answer;
  if (fault == Fault::kStatus500) answer = {500, "", "<Error><Code>InternalError</Code></Error>"};
  if (fault == Fault::kStatus503) answer = {503, "", "<Error><Code>SlowDown</Code></Error>"};
  if (fault == Fault::kStatus403) answer = {403, "", "<Error><Code>AccessDenied</Code></Error>"};
  if (answer.status == 200) answer = Do(request);
  if (fault == Fault::kFlip && !answer.body.empty()) answer.body[answer.body.size() / 2] ^= 4;
  const std::string head =
      absl::StrCat("HTTP/1.1 ", answer.status,
                   " Status\r\nConnection: close\r\nContent-Length: ", answer.body.size(), "\r\n",
                   answer.headers, "\r\n");
  const bool is_head = request.method == "HEAD";
  absl::string_view body = is_head ? absl::string_view() : absl::string_view(answer.body);
  if (fault == Fault::kTruncate) body = body.substr(0, body.size() / 2);
  if (SendAll(connection, head)) SendAll(connection, body);
}

bool FakeS3::Read(int connection, Request& request) {
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

FakeS3::Fault FakeS3::NextFault(const std::string& method) {
  const absl::MutexLock lock(&mutex_);
  ++counts_[method];
  std::deque<Fault>& faults = faults_[method];
  if (faults.empty()) return Fault::kNone;
  const Fault fault = faults.front();
  faults.pop_front();
  return fault;
}

FakeS3::Answer FakeS3::Do(const Request& request) {
  const absl::MutexLock lock(&mutex_);
  const std::string bucket = "/bucket";
  if (!absl::StartsWith(request.path, bucket)) {
    return {404, "", "<Error><Code>NoSuchBucket</Code><Message>none</Message></Error>"};
  }
  const std::string key =
      request.path.size() > bucket.size() ? request.path.substr(bucket.size() + 1) : "";
  if (key.empty()) return List(request);
  if (request.query.count("uploads") + request.query.count("uploadId") > 0) {
    return DoUpload(request, key);
  }
  if (request.method == "PUT") {
    objects_[key] = request.body;
    return {200, "ETag: \"1\"\r\n", ""};
  }
  if (request.method == "DELETE") return {objects_.erase(key) > 0 ? 204 : 404, "", ""};
  const auto object = objects_.find(key);
  if (object == objects_.end()) return {404, "", "<Error><Code>NoSuchKey</Code></Error>"};
  const auto range = request.headers.find("range");
  if (range == request.headers.end()) {
    return {200, "Last-Modified: Fri, 02 Jan 2026 03:04:05 GMT\r\n", object->second};
  }
  size_t begin = 0, last = 0;
  const std::vector<std::string> ends =
      absl::StrSplit(range->second.substr(std::string("bytes=").size()), '-');
  if (!absl::SimpleAtoi(ends[0], &begin) || !absl::SimpleAtoi(ends[1], &last) ||
      begin >= object->second.size()) {
    return {416, "", "<Error><Code>InvalidRange</Code></Error>"};
  }
  return {206, "", object->second.substr(begin, last - begin + 1)};
}

FakeS3::Answer FakeS3::DoUpload(const Request& request, const std::string& key) {
  if (request.query.count("uploads") > 0) {
    const std::string id = absl::StrCat("upload ", ++num_uploads_);
    uploads_[id];
    return {200, "", absl::StrCat("<UploadId>", id, "</UploadId>")};
  }
  const auto upload = uploads_.find(request.query.at("uploadId"));
  if (upload == uploads_.end()) return {404, "", "<Error><Code>NoSuchUpload</Code></Error>"};
  if (request.method == "PUT") {
    int number = 0;
    if (!absl::SimpleAtoi(request.query.at("partNumber"), &number)) return {400, "", ""};
    upload->second[number] = request.body;
    return {200, absl::StrCat("ETag: \"part-", number, "\"\r\n"), ""};
  }
  std::string whole;
  for (const auto& [number, part] : upload->second) {
    if (request.method == "POST" &&
        !absl::StrContains(request.body, absl::StrCat("<PartNumber>", number, "</PartNumber><ETag>",
                                                      "\"part-", number, "\""))) {
      return {400, "", "<Error><Code>InvalidPart</Code></Error>"};
    }
    whole += part;
  }
  uploads_.erase(upload);
  if (request.method == "POST") objects_[key] = std::move(whole);
  return {200, "", "<CompleteMultipartUploadResult/>"};
}

FakeS3::Answer FakeS3::List(const Request& request) {
  const auto get = [&](const char* name) {
    const auto found = request.query.find(name);
    return found == request.query.end() ? std::string() : found->second;
  };
  std::string body = "<ListBucketResult>";
  size_t count = 0;
  std::string last;
  for (const auto& [key, content] : objects_) {
    if (!absl::StartsWith(key, get("prefix")) || key <= get("continuation-token")) continue;
    if (count++ == kPageSize) {
      absl::StrAppend(&body, "<NextContinuationToken>", last, "</NextContinuationToken>");
      break;
    }
    last = key;
    absl::StrAppend(&body, "<Contents><Key>", key,
                    "</Key><LastModified>2026-01-02T03:04:05.000Z</LastModified><Size>",
                    content.size(), "</Size></Contents>");
  }
  return {200, "", body + "</ListBucketResult>"};
}

}  // namespace liquidblend::store
