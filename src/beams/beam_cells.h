/// @file Direction bins: rows of elevation and columns of azimuth on the sphere of directions.
#pragma once

#include <cmath>
#include <cstdint>

namespace bki_mapping {

/// Rows have equal height in the sine of the elevation, from -1 to 1.
constexpr int kBeamRows = 128;
/// Columns have equal width in the pseudo-angle, from 0 to 4, and so about equal width in azimuth, -pi to pi.
constexpr int kBeamColumns = 1024;

/// A cheap substitute for the azimuth atan2(y, x): grows with it from 0 at -pi to 4 at pi, by 1 for each
/// quadrant. 2 for (0, 0).
[[gnu::always_inline]] inline float pseudoAngle(float x, float y) {
  const float sum = std::abs(x) + std::abs(y);
  const float fraction = y / (sum > 0.0f ? sum : 1.0f);
  return x >= 0.0f ? 2.0f + fraction : (y >= 0.0f ? 4.0f - fraction : -fraction);
}

[[gnu::always_inline]] inline int beamColumn(float pseudo_angle) {
  const int column = static_cast<int>(pseudo_angle * (kBeamColumns / 4));
  return column < kBeamColumns ? column : kBeamColumns - 1;
}

/// @param sine of the elevation, -1 to 1; may exceed that by rounding.
[[gnu::always_inline]] inline int beamRow(float sine) {
  const float row = (sine * 0.5f + 0.5f) * kBeamRows;
  return row < 0.0f ? 0 : (row < kBeamRows - 1 ? static_cast<int>(row) : kBeamRows - 1);
}

/// The direction bins near each of the 64 voxels of a layer of a block: those of all lines through the sensor
/// that pass within some distance. Columns wrap where the first is after the last.
struct CellWindows {
  std::int32_t first_row[64], last_row[64], first_column[64], last_column[64];
};

/// Loops over beams may read up to this many elements past the end.
constexpr std::uint32_t kBeamPadding = 16;

/// The beams `first` to `last` - 1.
struct BeamRange {
  std::uint32_t first, last;
};

}  // namespace bki_mapping
