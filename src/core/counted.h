/// @file Counts, fractions and numbers of scans in sentences.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <string>

#include "bki_mapping/core/named_parameter.h"

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

/// A fraction as "12 %"; with three decimals near 0 and 100, to distinguish it from these.
inline std::string percentText(double fraction) {
  const double rounded =
      fraction > 0.99 || fraction < 0.01 ? std::round(1e5 * fraction) / 1e3 : std::round(100.0 * fraction);
  return numberText(rounded) + " %";
}

}  // namespace bki_mapping
