#include "tests/e2e/faults/fault_disk.h"

#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <map>
#include <random>
#include <set>

namespace liquidblend::e2e {
namespace {

namespace fs = std::filesystem;

constexpr size_t kPageBytes = 4096;

struct Entry {
  ino_t inode = 0;
  bool is_folder = false;
  bool operator==(const Entry&) const = default;
};
using Entries = std::map<std::string, Entry>;

ino_t InodeOf(const std::string& path) {
  struct stat info = {};
  return lstat(path.c_str(), &info) == 0 ? info.st_ino : 0;
}

// What was flushed of the inode, and the inode itself, as it is now.
std::string FlushedPath(const std::string& disk, ino_t inode) {
  return disk + "/flushed-" + std::to_string(inode);
}
std::string LinkPath(const std::string& disk, ino_t inode) {
  return disk + "/inode-" + std::to_string(inode);
}

std::string Read(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  return std::string(std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>());
}

// In one step: whoever does it may be killed.
void Replace(const std::string& path, const std::string& bytes) {
  const std::string next = path + ".next";
  std::ofstream(next, std::ios::binary | std::ios::trunc) << bytes;
  ::rename(next.c_str(), path.c_str());
}

Entries List(const std::string& folder) {
  Entries entries;
  std::error_code error;
  for (fs::directory_iterator entry(folder, error), end; !error && entry != end;
       entry.increment(error)) {
    std::error_code gone;
    const bool is_folder = entry->is_directory(gone);
    const ino_t inode = InodeOf(entry->path());
    if (inode != 0) entries[entry->path().filename()] = {inode, is_folder};
  }
  return entries;
}

Entries ParseEntries(const std::string& path) {
  Entries entries;
  std::ifstream file(path);
  char kind = 0;
  ino_t inode = 0;
  std::string name;
  while (file >> kind >> inode && file.ignore() && std::getline(file, name)) {
    entries[name] = {inode, kind == 'd'};
  }
  return entries;
}

// Rebuilds a folder.
class Rebuilder {
 public:
  Rebuilder(std::string disk, uint32_t seed) : disk_(std::move(disk)), seed_(seed), random_(seed) {}

  // Files that were made after the last flush of their folder can be found by a link only now.
  void LinkAll(const std::string& folder) const {
    for (const auto& [name, entry] : List(folder)) {
      const std::string path = folder + "/" + name;
      if (entry.is_folder) LinkAll(path);
      if (!entry.is_folder) link(path.c_str(), LinkPath(disk_, entry.inode).c_str());
    }
  }

  // The tree of a folder as it is, by inodes: it is about to go.
  void Remember(const std::string& folder) {
    Entries& entries = current_[InodeOf(folder)] = List(folder);
    for (const auto& [name, entry] : entries) {
      if (entry.is_folder) Remember(folder + "/" + name);
    }
  }

  void Build(ino_t inode, const std::string& folder) {
    fs::create_directories(folder);
    const Entries flushed = ParseEntries(FlushedPath(disk_, inode));
    const Entries& current = current_[inode];
    std::set<std::string> names;
    for (const auto* entries : {&flushed, &current}) {
      for (const auto& [name, entry] : *entries) names.insert(name);
    }
    for (const std::string& name : names) {
      const Entries& side = Survives() ? current : flushed;
      const auto entry = side.find(name);
      if (entry == side.end()) continue;
      const std::string path = folder + "/" + name;
      if (entry->second.is_folder) Build(entry->second.inode, path);
      if (!entry->second.is_folder) BuildFile(entry->second.inode, path);
    }
  }

 private:
  // Whether what was not flushed is there all the same.
  bool Survives() { return seed_ != 0 && random_() % 2 == 0; }

  void BuildFile(ino_t inode, const std::string& path) {
    const std::string flushed = Read(FlushedPath(disk_, inode));
    const std::string live = LinkPath(disk_, inode);
    const std::string current = Read(live);
    std::string bytes = flushed;
    if (Survives()) bytes.resize(current.size());
    for (size_t begin = 0; begin < std::min(bytes.size(), current.size()); begin += kPageBytes) {
      if (!Survives()) continue;
      const size_t size = std::min(kPageBytes, std::min(bytes.size(), current.size()) - begin);
      bytes.replace(begin, size, current, begin, size);
    }
    std::ofstream(path, std::ios::binary) << bytes;
    struct stat info = {};
    if (stat(live.c_str(), &info) == 0) chmod(path.c_str(), info.st_mode & 07777);
  }

  const std::string disk_;
  const uint32_t seed_;
  std::mt19937 random_;
  std::map<ino_t, Entries> current_;
};

}  // namespace

void KeepFile(const std::string& disk, const std::string& path) {
  const ino_t inode = InodeOf(path);
  if (inode == 0) return;
  link(path.c_str(), LinkPath(disk, inode).c_str());
  Replace(FlushedPath(disk, inode), Read(path));
}

void KeepFolder(const std::string& disk, const std::string& path) {
  std::string lines;
  for (const auto& [name, entry] : List(path)) {
    if (!entry.is_folder) link((path + "/" + name).c_str(), LinkPath(disk, entry.inode).c_str());
    lines += (entry.is_folder ? "d " : "f ") + std::to_string(entry.inode) + " " + name + "\n";
  }
  Replace(FlushedPath(disk, InodeOf(path)), lines);
}

void KeepTree(const std::string& disk, const std::string& folder) {
  KeepFolder(disk, folder);
  for (const auto& [name, entry] : List(folder)) {
    const std::string path = folder + "/" + name;
    if (entry.is_folder) KeepTree(disk, path);
    if (!entry.is_folder) KeepFile(disk, path);
  }
}

void LosePower(const std::string& disk, const std::string& folder, uint32_t seed) {
  Rebuilder rebuilder(disk, seed);
  rebuilder.LinkAll(folder);
  rebuilder.Remember(folder);
  const std::string next = folder + ".next";
  rebuilder.Build(InodeOf(folder), next);
  fs::remove_all(folder);
  fs::rename(next, folder);
}

}  // namespace liquidblend::e2e
