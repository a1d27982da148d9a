// Runs every seed and every former finding of the fuzzers through the same entries.
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <ostream>
#include <string>
#include <vector>

#include "tests/fuzz/entries.h"
#include "tests/paths.h"

namespace liquidblend::fuzz {
namespace {

namespace fs = std::filesystem;

class Replay : public testing::TestWithParam<Entry> {};

std::vector<fs::path> FilesIn(const fs::path& folder) {
  std::vector<fs::path> files;
  if (!fs::exists(folder)) return files;
  for (const auto& entry : fs::directory_iterator(folder)) files.push_back(entry.path());
  std::sort(files.begin(), files.end());
  return files;
}

std::vector<char> Load(const fs::path& path) {
  std::ifstream stream(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(stream), {}};
}

// A finding ends the process, or the sanitizers end it.
TEST_P(Replay, SeedsAndFindingsKeepThePromises) {
  const std::string name(GetParam().name);
  const fs::path root = paths::Source("tests/fuzz");
  const std::vector<fs::path> seeds = FilesIn(root / "corpus" / name);
  EXPECT_GE(seeds.size(), 2u);
  std::vector<fs::path> files = FilesIn(root / "regressions" / name);
  files.insert(files.end(), seeds.begin(), seeds.end());
  for (const fs::path& file : files) {
    SCOPED_TRACE(file.string());
    const std::vector<char> bytes = Load(file);
    GetParam().run(std::as_bytes(std::span(bytes)));
  }
}

std::string NameOf(const testing::TestParamInfo<Entry>& info) {
  return std::string(info.param.name);
}

INSTANTIATE_TEST_SUITE_P(Readers, Replay,
                         testing::ValuesIn(ReaderEntries().begin(), ReaderEntries().end()), NameOf);
INSTANTIATE_TEST_SUITE_P(Peers, Replay,
                         testing::ValuesIn(PeerEntries().begin(), PeerEntries().end()), NameOf);

}  // namespace
}  // namespace liquidblend::fuzz
