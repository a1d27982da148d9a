// Reader of a binary file: takes numbers and pieces off its front, never beyond its end.
#pragma once

#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>
#include <string_view>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/str_cat.h"

namespace liquidblend::ingest {

static_assert(std::endian::native == std::endian::little, "numbers are little endian");

// Errors of all calls: kDataLoss, with the position, if the file ends before.
class ByteReader {
 public:
  explicit ByteReader(std::span<const std::byte> bytes) : bytes_(bytes) {}

  absl::StatusOr<std::span<const std::byte>> Take(uint64_t size) {
    if (size > bytes_.size() - position_) {
      return absl::DataLossError(absl::StrCat("the file is truncated: ", size,
                                              " bytes should follow byte ", position_, ", but ",
                                              bytes_.size() - position_, " do"));
    }
    const auto taken = bytes_.subspan(position_, size);
    position_ += size;
    return taken;
  }

  template <typename Number>
  absl::Status Read(Number& number) {
    const auto taken = Take(sizeof(number));
    if (!taken.ok()) return taken.status();
    std::memcpy(&number, taken->data(), sizeof(number));
    return absl::OkStatus();
  }

  // uint32 size, then as many characters.
  absl::Status ReadString(std::string_view& text) {
    uint32_t size = 0;
    if (absl::Status status = Read(size); !status.ok()) return status;
    const auto taken = Take(size);
    if (!taken.ok()) return taken.status();
    text = {reinterpret_cast<const char*>(taken->data()), taken->size()};
    return absl::OkStatus();
  }

  size_t position() const { return position_; }

 private:
  std::span<const std::byte> bytes_;
  size_t position_ = 0;
};

}  // namespace liquidblend::ingest
