/// @file The named parameters of ScanLimitConfig.
#pragma once

#include <vector>

#include "bki_mapping/core/named_parameter.h"
#include "bki_mapping/rules/scan_limit_config.h"

namespace bki_mapping {

/// Those below `free_space/`: which evidence for free a scan leaves out.
inline std::vector<NamedParameter<ScanLimitConfig>> missParameters() {
  using C = ScanLimitConfig;
  return {
      truthParameter("hits_before_misses", &C::hits_before_misses, Changes::kWhileMapping,
                     "Ignore a scan's evidence for free in voxels that contain one of its hits after "
                     "down-sampling. Set true to keep surfaces and thin objects that beams graze."),
      truthParameter("evidence_before_misses", &C::evidence_before_misses, Changes::kWhileMapping,
                     "Ignore a scan's evidence for free in all voxels that one of its hits adds evidence to. "
                     "Set true to keep the voxels next to a hit as well."),
  };
}

/// Those below `scan_limit/`.
inline std::vector<NamedParameter<ScanLimitConfig>> scanLimitParameters() {
  using C = ScanLimitConfig;
  const NumberRange evidence = NumberRange::atLeast(0.0).upTo(kMostEvidence).slider(0.0, 1e6);
  return {
      realParameter(
          "hits", &C::hits, evidence, "", Changes::kWhileMapping,
          "Largest evidence that the hits of one scan add to a voxel, all classes together; larger sums "
          "are scaled down to it. Set it so that scans count alike however dense their points are; 0 "
          "sets no limit."),
      realParameter(
          "free", &C::free, evidence, "", Changes::kWhileMapping,
          "Largest evidence for free that one scan adds to a voxel. Set it so that scans count alike "
          "however many beams cross the voxel; 0 sets no limit."),
      realParameter(
          "free_threshold", &C::free_threshold, evidence, "", Changes::kWhileMapping,
          "Evidence for free that one scan must exceed in a voxel; only the excess counts. It does not apply "
          "above a voxel whose evidence for free from the same scan reaches scan_limit/free; with "
          "scan_limit/free 0 it applies everywhere. Set it so that beams call no voxel free that is mostly "
          "in the ground: 0.17 kernel/scale kernel/length / height of the sensor above it, with bilinear "
          "weights. 0 lets all evidence count."),
      realParameter(
          "void", &C::void_space, evidence, "", Changes::kWhileMapping,
          "Further evidence for free that a scan adds to a voxel which it sees empty together with its 18 "
          "neighbours across faces and edges: each of them without a hit and with as much evidence for free "
          "as scan_limit/free, in it or in the voxels below and above it, or hit only by classes that cannot "
          "move. Set it several times as high as scan_limit/hits to clear what waited for seconds and left; "
          "0 adds none."),
      integerParameter(
          "blocks", &C::blocks, NumberRange::atLeast(0).upTo(1e9), Changes::kWhileMapping,
          "Largest number of blocks of 8 x 8 x 8 voxels that the hits of one scan, or its free space, may "
          "touch; a larger scan is refused. Lower it to protect memory; 0 allows the blocks "
          "within the sensor's reach, at most " +
              std::to_string(ScanLimitConfig::kMostBlocks) + "."),
  };
}

}  // namespace bki_mapping
