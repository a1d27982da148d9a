// What of a folder would be left if the power went: of a file the bytes of its last flush, of a
// folder the names of its last flush.
#pragma once

#include <cstdint>
#include <string>

namespace liquidblend::e2e {

// Remembers, in a folder `disk` on the same file system, that this is flushed now. Everything goes
// by inode numbers; a second link keeps that of a file from meaning another one later.
// Threads, processes: one at a time.
void KeepFile(const std::string& disk, const std::string& path);
void KeepFolder(const std::string& disk, const std::string& path);

// Both, of all that is below `folder`, which is flushed whole.
void KeepTree(const std::string& disk, const std::string& folder);

// Turns `folder` into what the disk has of it.
//   seed  0: all that was not flushed is lost; else each name and each page of 4 KiB that changed
//         since its flush is lost or not, by chance.
// Requires: nobody uses the folder.
void LosePower(const std::string& disk, const std::string& folder, uint32_t seed);

}  // namespace liquidblend::e2e
