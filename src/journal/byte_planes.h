/// @file Lists of numbers as planes of bytes, in one zlib stream.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace bki_mapping {

/// The bytes that an unsigned number needs; 0 needs none.
inline int byteCount(std::uint32_t n) {
  return n == 0 ? 0 : n < 0x100 ? 1 : n < 0x10000 ? 2 : n < 0x1000000 ? 3 : 4;
}

/// Writes lists of numbers. A plane has one byte of each number of a list, those of the lowest bytes come
/// first.
class PlaneWriter {
 public:
  /// @param size of all planes together [bytes].
  explicit PlaneWriter(std::size_t size) { bytes_.reserve(size); }

  /// @param valueAt called as valueAt(n), returns an unsigned number; in rising order of n, once for each
  /// byte.
  template <typename ValueAt>
  void write(std::size_t count, int bytes, ValueAt&& valueAt) {
    for (int byte = 0; byte < bytes; ++byte) {
      const std::size_t begin = bytes_.size();
      bytes_.resize(begin + count);
      char* const plane = bytes_.data() + begin;
      for (std::size_t n = 0; n < count; ++n) plane[n] = static_cast<char>(valueAt(n) >> (8 * byte) & 0xff);
      ends_.push_back(bytes_.size());
    }
  }
  /// The planes, one after another, as one zlib stream.
  std::string packed() const;

 private:
  std::string bytes_;
  std::vector<std::size_t> ends_;  ///< of the planes
};

/// Reads what PlaneWriter writes.
class PlaneReader {
 public:
  /// @param bytes the planes; they must hold all that is read, and outlive this.
  explicit PlaneReader(const std::string& bytes) : next_(bytes.data()) {}

  template <typename Value>
  void read(std::vector<Value>& values, std::size_t count, int bytes = sizeof(Value)) {
    values.assign(count, 0);
    for (int byte = 0; byte < bytes; ++byte) {
      for (Value& value : values) {
        value =
            static_cast<Value>(value | static_cast<Value>(static_cast<std::uint8_t>(*next_++)) << (8 * byte));
      }
    }
  }

 private:
  const char* next_;
};

/// The planes of a zlib stream; none if it is damaged, or has another size than this.
/// @throws std::bad_alloc.
std::optional<std::string> unpackedPlanes(std::string_view packed, std::size_t size);

}  // namespace bki_mapping
