/// @file Counter-based random numbers: each is a function of its keys, whichever thread draws it and when.
#pragma once

#include <cmath>
#include <cstdint>

namespace bki_mapping {

/// The finaliser of SplitMix64 (Steele, Lea and Flood 2014).
inline std::uint64_t mixBits(std::uint64_t x) {
  x += 0x9E3779B97F4A7C15ull;
  x = (x ^ (x >> 30)) * 0xBF58476D1CE4E5B9ull;
  x = (x ^ (x >> 27)) * 0x94D049BB133111EBull;
  return x ^ (x >> 31);
}

/// The random numbers of one scan.
class CounterRandom {
 public:
  CounterRandom(std::uint64_t seed, std::uint64_t scan) : key_(mixBits(mixBits(seed) ^ scan)) {}

  /// The key of one beam, for draw().
  std::uint64_t beamKey(std::uint64_t beam) const { return mixBits(key_ ^ beam); }
  /// @return a number uniform on [0, 1).
  static double draw(std::uint64_t beam_key, std::uint64_t sample) {
    return static_cast<double>(mixBits(beam_key ^ sample) >> 11) * 0x1.0p-53;
  }

 private:
  std::uint64_t key_;
};

/// @return a number uniform on [0, 1) that is a function of the four keys.
inline double counterRandom(std::uint64_t seed, std::uint64_t scan, std::uint64_t beam,
                            std::uint64_t sample) {
  return CounterRandom::draw(CounterRandom(seed, scan).beamKey(beam), sample);
}

/// @return a standard normal number that is a function of the three keys (Box and Muller 1958).
inline double counterNormal(std::uint64_t seed, std::uint64_t scan, std::uint64_t beam) {
  constexpr double kTwoPi = 6.28318530717958647692;
  const double u = 1.0 - counterRandom(seed, scan, beam, 0), v = counterRandom(seed, scan, beam, 1);
  return std::sqrt(-2.0 * std::log(u)) * std::cos(kTwoPi * v);
}

}  // namespace bki_mapping
