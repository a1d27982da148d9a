// Whether processes that a test has started are still there.
#pragma once

#include <sys/types.h>

#include <fstream>
#include <string>

namespace liquidblend {

// The state letter in /proc/PID/stat; 'X' if there is no such process.
inline char StateOf(pid_t pid) {
  std::ifstream file("/proc/" + std::to_string(pid) + "/stat");
  std::string text;
  std::getline(file, text);
  const size_t end_of_name = text.rfind(") ");
  return end_of_name == std::string::npos ? 'X' : text[end_of_name + 2];
}

}  // namespace liquidblend
