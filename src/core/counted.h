/// @file Counts and numbers of scans in sentences.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <string>

namespace bki_mapping {

/// A count with its noun, such as "1 tile" or "12 tiles". @param noun whose plural takes an s.
inline std::string counted(std::uint64_t count, const std::string& noun) {
  return std::to_string(count) + " " + noun + (count == 1 ? "" : "s");
}

/// The number of a scan as in the name of its file: with at least six digits.
inline std::string sixDigits(std::uint64_t number) {
  const std::string digits = std::to_string(number);
  return std::string(6 - std::min<std::size_t>(digits.size(), 6), '0') + digits;
}

}  // namespace bki_mapping
