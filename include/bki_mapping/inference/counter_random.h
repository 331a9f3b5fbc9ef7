/// @file Random numbers from a counter: the same place always draws the same number, on any thread.
#pragma once

#include <cstdint>

namespace bki_mapping {

/// The finaliser of SplitMix64 (Steele, Lea and Flood 2014).
inline std::uint64_t mixBits(std::uint64_t x) {
  x += 0x9E3779B97F4A7C15ull;
  x = (x ^ (x >> 30)) * 0xBF58476D1CE4E5B9ull;
  x = (x ^ (x >> 27)) * 0x94D049BB133111EBull;
  return x ^ (x >> 31);
}

/// @return a number uniform on [0, 1), a function of its four keys alone.
inline double counterRandom(std::uint64_t seed, std::uint64_t scan, std::uint64_t beam,
                            std::uint64_t sample) {
  const std::uint64_t bits = mixBits(mixBits(mixBits(mixBits(seed) ^ scan) ^ beam) ^ sample);
  return static_cast<double>(bits >> 11) * 0x1.0p-53;
}

}  // namespace bki_mapping
