/// @file A block as seen from the sensor.
#pragma once

namespace bki_mapping {

struct BeamBlock {
  double first[3];    ///< centre of the block's first voxel, relative to the sensor [m]
  double resolution;  ///< [m]
  float length;       ///< of the kernel [m]
};

}  // namespace bki_mapping
