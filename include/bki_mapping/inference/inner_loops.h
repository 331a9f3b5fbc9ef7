/// @file The innermost loops of point and line evidence, compiled for several instruction sets.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "bki_mapping/core/config.h"
#include "bki_mapping/inference/beam_block.h"
#include "bki_mapping/inference/beam_cells.h"
#include "bki_mapping/inference/local_point.h"

namespace bki_mapping {

/// The loops for one instruction set. All sums are of the 512 voxels of a block, and of the sparse kernel of
/// unit scale.
struct InnerLoops {
  const char* instruction_set;
  /// Adds k(|x - c|) of each point that reaches the block. @param reach length of the kernel [voxels].
  void (*add_points)(const LocalPoint* points, std::size_t count, float reach, float* sums);
  /// Adds w(rho) k(d) of each beam: d the distance to the beam's line, w the weight along it, 0 unless
  /// 0 < rho < 1.
  void (*add_beams)(const BeamArrays& beams, const BeamBlock& block, BeamWeight weight, float* sums);
  /// The same, of the given beams alone.
  void (*add_some_beams)(const BeamArrays& beams, const BeamRange* ranges, std::size_t count,
                         const BeamBlock& block, BeamWeight weight, float* sums);
};

/// The instruction sets that this build and this processor have: "generic" first, better ones behind it.
std::vector<std::string> instructionSets();

/// The loops for one of instructionSets(); for the best of them if the name is empty.
/// @throws std::invalid_argument for any other name.
const InnerLoops& innerLoopsFor(const std::string& instruction_set);

}  // namespace bki_mapping
