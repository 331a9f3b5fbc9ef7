/// @file Changes evidence in chosen voxels of a plane.
#pragma once

#include "update/sum_kernels.h"
#include "update/voxel_mask.h"

namespace bki_mapping {

/// Adds evidence to some voxels of a plane, where it saturates at kMostUnits. @param units at least 0.
/// @param[in,out] counts increased; a voxel that was saturated before does not count again.
/// @return whether any evidence in those voxels is not 0.
bool addToVoxels(const LayerBits& voxels, EvidenceUnits units, EvidenceUnits* plane, SumCounts& counts);
/// The opposite, which saturates at -kMostUnits. Voxels that become negative count.
bool withdrawFromVoxels(const LayerBits& voxels, EvidenceUnits units, EvidenceUnits* plane,
                        SumCounts& counts);

/// The same for some of 64 voxels. @param units that of each of the 64.
bool addToLayer(std::uint64_t voxels, const EvidenceUnits* units, EvidenceUnits* plane, SumCounts& counts);
bool withdrawFromLayer(std::uint64_t voxels, const EvidenceUnits* units, EvidenceUnits* plane,
                       SumCounts& counts);

}  // namespace bki_mapping
