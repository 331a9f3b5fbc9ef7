/// @file Settings of free space.
#pragma once

#include <cstdint>
#include <string>

#include "bki_mapping/beams/beam_config.h"

namespace bki_mapping {

struct FreeSpaceConfig {
  std::string mode = "line";                            ///< a name of the registry in free_space/registry.h
  double gap = 1.0;                                     ///< mode even: distance between samples of a beam [m]
  int samples_per_beam = 1;                             ///< modes uniform and linear
  std::int64_t seed = 1;                                ///< modes uniform and linear
  BeamWeight weight = BeamWeight::kBilinear;            ///< mode line
  FreeSpaceExtent extent = FreeSpaceExtent::kObserved;  ///< mode line
  BeamIndexType beam_index = BeamIndexType::kTable;     ///< mode line, and occlusion
  bool hits_before_misses = false;      ///< voxels that hold a hit are not cleared by its scan
  bool evidence_before_misses = false;  ///< nor are voxels that a hit's kernel reaches
};

}  // namespace bki_mapping
