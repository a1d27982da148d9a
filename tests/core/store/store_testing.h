// What the tests of the store share: folders that go away, child processes that may be killed,
// blobs in memory.
#pragma once

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <stdlib.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cstring>
#include <filesystem>
#include <fstream>
#include <functional>
#include <string>
#include <vector>

#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "core/store/blobs/blob_store.h"

namespace liquidblend::store {

// A new folder that is removed at the end.
class TemporaryFolder {
 public:
  TemporaryFolder() : path_(std::filesystem::canonical(::testing::TempDir()) / "lb_store_XXXXXX") {
    EXPECT_NE(mkdtemp(path_.data()), nullptr);
    std::filesystem::permissions(path_, std::filesystem::perms(0755));
  }
  ~TemporaryFolder() {
    std::error_code ignored;
    std::filesystem::remove_all(path_, ignored);
  }
  TemporaryFolder(const TemporaryFolder&) = delete;
  TemporaryFolder& operator=(const TemporaryFolder&) = delete;
  const std::string& path() const { return path_; }

 private:
  std::string path_;
};

// Starts a process that runs `body` and exits with its result; waits with WaitFor().
inline pid_t StartChild(const std::function<int()>& body) {
  const pid_t child = fork();
  if (child == 0) _exit(body());
  return child;
}

// The wait status: see WIFEXITED and the like.
inline int WaitFor(pid_t child) {
  int status = 0;
  EXPECT_EQ(waitpid(child, &status, 0), child);
  return status;
}

inline int RunChild(const std::function<int()>& body) { return WaitFor(StartChild(body)); }

// Runs `body` in a process that is to be killed at a fault point; whether that happened.
inline bool DiesAt(const std::string& fault_point, const std::function<void()>& body) {
  const int status = RunChild([&] {
    setenv("LIQUIDBLEND_FAULT_POINT", fault_point.c_str(), 1);
    body();
    return 0;
  });
  return WIFSIGNALED(status) && WTERMSIG(status) == SIGKILL;
}

inline std::span<const std::byte> AsBytes(const std::string& text) {
  return std::as_bytes(std::span(text));
}

inline std::string AsString(std::span<const std::byte> bytes) {
  return std::string(reinterpret_cast<const char*>(bytes.data()), bytes.size());
}

// Bytes that do not repeat.
inline std::string SampleBytes(size_t size, uint32_t seed = 1) {
  std::string bytes(size, '\0');
  for (char& byte : bytes) byte = static_cast<char>((seed = seed * 1664525u + 1013904223u) >> 24);
  return bytes;
}

// Two contents of one XXH3-128. In two stripes of a block, lane 0 is made equal to the low half of
// the hash's secret, so that the product it contributes is zero whatever the high half is, and the
// sum of the high halves stays the same.
inline std::pair<std::string, std::string> CollidingContents() {
  constexpr uint32_t kSecretLow[2] = {0x396cfeb8, 0x2c81017c};  // of bytes 0 to 3 and 8 to 11
  const auto make = [&](uint32_t high0, uint32_t high1) {
    std::string bytes = SampleBytes(1024);
    std::memcpy(bytes.data(), &kSecretLow[0], 4);
    std::memcpy(bytes.data() + 4, &high0, 4);
    std::memcpy(bytes.data() + 64, &kSecretLow[1], 4);
    std::memcpy(bytes.data() + 68, &high1, 4);
    return bytes;
  };
  return {make(5, 7), make(6, 6)};
}

inline std::string ReadFile(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  return std::string(std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>());
}

inline void WriteFile(const std::string& path, const std::string& bytes) {
  std::filesystem::remove(path);
  std::ofstream(path, std::ios::binary) << bytes;
}

inline int CountFiles(const std::string& folder) {
  int count = 0;
  for (const auto& entry : std::filesystem::recursive_directory_iterator(folder)) {
    count += entry.is_regular_file() ? 1 : 0;
  }
  return count;
}

// Collects what is written.
class MemoryWriter : public BlobWriter {
 public:
  absl::Status Append(std::span<const std::byte> bytes) override {
    content += AsString(bytes);
    return absl::OkStatus();
  }
  absl::StatusOr<BlobId> Commit() override { return BlobId("in memory"); }
  std::string content;
};

// A copy in memory, aligned like a mapped file (plus `shift` bytes).
class MemoryBlob : public Blob {
 public:
  explicit MemoryBlob(const std::string& content, size_t shift = 0)
      : lines_((content.size() + shift) / sizeof(Line) + 1), shift_(shift), size_(content.size()) {
    std::memcpy(lines_.front().bytes + shift, content.data(), content.size());
  }
  std::span<const std::byte> bytes() const override {
    return {lines_.front().bytes + shift_, size_};
  }

 private:
  struct alignas(64) Line {
    std::byte bytes[64];
  };
  std::vector<Line> lines_;
  size_t shift_;
  size_t size_;
};

inline absl::Status StatusOf(const absl::Status& result) { return result; }
template <typename T>
absl::Status StatusOf(const absl::StatusOr<T>& result) {
  return result.status();
}

// A status of this code whose message holds these words.
MATCHER_P2(Fails, code, words, "") {
  const absl::Status status = StatusOf(arg);
  *result_listener << status;
  return status.code() == code && absl::StrContains(status.message(), words);
}

MATCHER(Succeeds, "") {
  *result_listener << StatusOf(arg);
  return arg.ok();
}

}  // namespace liquidblend::store
