/// @file The sphere of directions about the sensor, cut into cells: rows of elevation, columns of azimuth.
#pragma once

#include <cmath>
#include <cstdint>

namespace bki_mapping {

/// Rows are of equal height in the sine of the elevation, from -1 to 1.
constexpr int kBeamRows = 128;
/// Columns are of about equal width in azimuth, from -pi to pi: equal in its pseudo-angle, from 0 to 4.
constexpr int kBeamColumns = 1024;

/// Grows with the azimuth atan2(y, x), from 0 at -pi to 4 at pi, by 1 a quadrant: the azimuth without its arc
/// tangent. (0, 0) gets 2.
[[gnu::always_inline]] inline float pseudoAngle(float x, float y) {
  const float sum = std::abs(x) + std::abs(y);
  const float share = y / (sum > 0.0f ? sum : 1.0f);
  return x >= 0.0f ? 2.0f + share : (y >= 0.0f ? 4.0f - share : -share);
}

[[gnu::always_inline]] inline int beamColumn(float pseudo_angle) {
  const int column = static_cast<int>(pseudo_angle * (kBeamColumns / 4));
  return column < kBeamColumns ? column : kBeamColumns - 1;
}

/// @param sine of the elevation, -1 to 1; rounding may have gone beyond.
[[gnu::always_inline]] inline int beamRow(float sine) {
  const float row = (sine * 0.5f + 0.5f) * kBeamRows;
  return row < 0.0f ? 0 : (row < kBeamRows - 1 ? static_cast<int>(row) : kBeamRows - 1);
}

/// Loops may read so many beams past the last.
constexpr std::uint32_t kBeamPadding = 16;

/// Beams first to before last.
struct BeamRange {
  std::uint32_t first, last;
};

}  // namespace bki_mapping
