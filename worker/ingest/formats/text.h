// Words and numbers of text formats.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

namespace liquidblend::ingest {

// Cuts the first word off `text`; words are separated by blanks, tabs, line ends and backslashes
// (OBJ continues lines with them). Empty at the end.
std::string_view NextWord(std::string_view& text);

enum class LineEnds {
  kPlain,
  kContinued  // a backslash before the line's end joins the next line on
};

// Cuts the first line off `text`, without its end (\n or \r\n).
std::string_view NextLine(std::string_view& text, LineEnds ends = LineEnds::kPlain);

// Parses the whole word as a number; false if it is not one. "nan" and "inf" are numbers.
bool ParseNumber(std::string_view word, double& value);
bool ParseInteger(std::string_view word, int64_t& value);

// Converts to float; infinity beyond the largest float.
float ToFloat(double value);

// The word for messages: in quotes, unprintable characters escaped, at most 40 characters.
std::string Quoted(std::string_view word);

}  // namespace liquidblend::ingest
