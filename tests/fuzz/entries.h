// Entry points of the fuzzers and of the replay of findings: bytes in, promises checked.
#pragma once

#include <cstddef>
#include <span>
#include <string_view>

namespace liquidblend::fuzz {

struct Entry {
  std::string_view name;  // of the folders in tests/fuzz/corpus and tests/fuzz/regressions, too
  // Takes the bytes; ends the process if a promise is broken.
  void (*run)(std::span<const std::byte> bytes);
};

// Readers of files and parsers.
std::span<const Entry> ReaderEntries();
void RunS3Answer(std::span<const std::byte> bytes);
void RunCredentials(std::span<const std::byte> bytes);

// What clients on the network reach: connections, streams, requests. The same bytes give the same
// run.
std::span<const Entry> PeerEntries();
void RunHttp(std::span<const std::byte> bytes);
void RunWebSocket(std::span<const std::byte> bytes);
void RunStream(std::span<const std::byte> bytes);
void RunTokens(std::span<const std::byte> bytes);
void RunUpload(std::span<const std::byte> bytes);
void RunPages(std::span<const std::byte> bytes);

}  // namespace liquidblend::fuzz
