// Seeds of the fuzzers on their way to tests/fuzz/corpus.
#pragma once

#include <filesystem>
#include <fstream>
#include <span>
#include <string>
#include <utility>

namespace liquidblend::fuzz {

class Corpus {
 public:
  explicit Corpus(std::string root) : root_(std::move(root)) {}

  void Add(const std::string& fuzzer, const std::string& name,
           std::span<const std::byte> bytes) const {
    const std::filesystem::path folder = std::filesystem::path(root_) / fuzzer;
    std::filesystem::create_directories(folder);
    std::ofstream(folder / name, std::ios::binary)
        .write(reinterpret_cast<const char*>(bytes.data()),
               static_cast<std::streamsize>(bytes.size()));
  }

 private:
  std::string root_;
};

// Seeds of what S3 and sources of credentials answer.
void AddCloudSeeds(const Corpus& corpus);

// Seeds of what clients on the network send.
void AddPeerSeeds(const Corpus& corpus);

}  // namespace liquidblend::fuzz
