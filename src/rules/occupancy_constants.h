/// @file The constants of the occupancy, Equation 13 in docs/method.md, which is not in the paper. They were
/// fitted to drives whose truth is known (docs/tuning.md).
#pragma once

namespace bki_mapping {

/// Prior concentrations of something and of nothing, in units of the prior alpha0 of a class. Their sum says
/// how much evidence outweighs them: some hundredths of that of one hit.
constexpr double kPriorOfSomething = 0.2, kPriorOfNothing = 6.0;
/// Weight of the evidence for `free`: beams that pass through a voxel without hitting what is in it are that
/// common: kFreeOfOneHit units of it are worth a unit of hits. A gain above 1 multiplies it.
constexpr int kFreeOfOneHit = 20;
constexpr double kWeightOfFree = 1.0 / kFreeOfOneHit;
/// Evidence for nothing that comes with each unit of evidence of hits: kernels reach voxels beside the
/// surfaces that were hit.
constexpr double kBesideSurfaces = 0.1;
/// Evidence for something that comes with each weighted unit of evidence for `free`: beams cross voxels that
/// hold the surface of a road in their lowest part, or something that none of them hits.
constexpr double kInFreeSpace = 0.03;

}  // namespace bki_mapping
