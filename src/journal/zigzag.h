/// @file Differences of signed numbers as unsigned ones.
#pragma once

#include <cstdint>

namespace bki_mapping {

/// 2 d for a difference d >= 0, otherwise -2 d - 1, modulo 2^32: small numbers for small differences.
inline std::uint32_t zigzagBetween(std::int32_t from, std::int32_t to) {
  const std::uint32_t d = static_cast<std::uint32_t>(to) - static_cast<std::uint32_t>(from);
  return (d << 1) ^ (0u - (d >> 31));
}
/// The number to which a difference leads.
inline std::int32_t zigzagFrom(std::int32_t from, std::uint32_t zigzag) {
  const std::uint32_t d = (zigzag >> 1) ^ (0u - (zigzag & 1));
  return static_cast<std::int32_t>(static_cast<std::uint32_t>(from) + d);
}

}  // namespace bki_mapping
