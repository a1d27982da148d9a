// What both readers share of libarchive's use. Only for sources of this room.
#pragma once

#include <archive.h>
#include <archive_entry.h>

#include <new>
#include <string>

namespace liquidblend::tar {

// Takes over what libarchive has allocated.
template <typename T>
T* NotNull(T* allocated) {
  if (allocated == nullptr) throw std::bad_alloc();
  return allocated;
}

// Without "./" in front. Names in UTF-8 that this locale cannot show are given in UTF-8.
inline std::string NameOf(archive_entry* entry) {
  const char* path = archive_entry_pathname(entry);
  if (path == nullptr) path = archive_entry_pathname_utf8(entry);
  std::string name = path == nullptr ? "" : path;
  while (name.rfind("./", 0) == 0) name.erase(0, 2);
  return name;
}

}  // namespace liquidblend::tar
