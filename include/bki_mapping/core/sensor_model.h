/// @file The range limits of a sensor.
#pragma once

namespace bki_mapping {

struct SensorModelConfig {
  double min_range = 0.0;   ///< hits closer than this are dropped [m]
  double max_range = -1.0;  ///< hits beyond this do not occupy voxels [m]; -1: not known

  /// With an unknown max_range, points beyond this are taken for faults of the driver [m]: they neither
  /// occupy nor clear. Lidars see up to about 250 m, but a corrupt point may lie anywhere.
  static constexpr double kFarthest = 300.0;
  bool knowsRange() const { return max_range > 0.0; }
  double reach() const { return knowsRange() ? max_range : kFarthest; }  ///< range of the farthest hit [m]
};

}  // namespace bki_mapping
