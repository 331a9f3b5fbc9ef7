/// @file The innermost loop of line evidence, compiled for several instruction sets.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "bki_mapping/core/config.h"
#include "bki_mapping/inference/beam_raster.h"

namespace bki_mapping {

/// Adds w(rho) k(d) of each beam to the 512 voxels of a block: k the sparse kernel of unit scale, d the
/// distance to the beam's line, w the weight along it, 0 unless 0 < rho < 1.
/// @param reach length of the kernel [voxels].
using AddBeamRows = void (*)(const LocalBeam* beams, std::size_t count, BeamWeight weight, float reach,
                             float* sums);

/// The instruction sets that this build and this processor have: "generic" first, better ones behind it.
std::vector<std::string> instructionSets();

/// The loop for one of instructionSets(). @throws std::invalid_argument for any other.
AddBeamRows addBeamRowsFor(const std::string& instruction_set);

}  // namespace bki_mapping
