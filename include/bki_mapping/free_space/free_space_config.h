/// @file Settings of free space.
#pragma once

#include <cstdint>
#include <string>

#include "bki_mapping/beams/beam_config.h"

namespace bki_mapping {

struct FreeSpaceConfig {
  std::string mode = "line";                            ///< one of freeSpaceModes()
  double gap = 1.0;                                     ///< mode even: distance between samples of a beam [m]
  int samples_per_beam = 1;                             ///< modes uniform and linear
  std::int64_t seed = 1;                                ///< modes uniform and linear
  BeamWeight weight = BeamWeight::kBilinear;            ///< mode line
  FreeSpaceExtent extent = FreeSpaceExtent::kObserved;  ///< mode line
  BeamIndexType beam_index = BeamIndexType::kTable;     ///< mode line, and occlusion
};

}  // namespace bki_mapping
