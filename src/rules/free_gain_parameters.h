/// @file The named parameters of FreeGainConfig.
#pragma once

#include <vector>

#include "bki_mapping/core/named_parameter.h"
#include "bki_mapping/rules/free_gain_config.h"

namespace bki_mapping {

inline std::vector<NamedParameter<FreeGainConfig>> freeGainParameters() {
  using C = FreeGainConfig;
  const NumberRange gain = NumberRange::above(0.0).upTo(kMostEvidence).slider(1e-6, 1e6);
  return {
      realParameter(
          "dynamic", &C::dynamic_classes, gain, "", Changes::kWhileMapping,
          "Factor on the evidence for free when deciding the state of a voxel whose likeliest class has the "
          "flag dynamic. Set it above 1 to clear the trails of moving objects sooner."),
      realParameter("living", &C::living_classes,
                    NumberRange::atLeast(0.0).upTo(kMostEvidence).slider(0.0, 1e6), "",
                    Changes::kWhileMapping,
                    "Factor on the evidence for free for classes with the flag living: people, riders, "
                    "animals. They may stand for a while, but are never parked, so set it far above "
                    "free_gain/dynamic; 0 uses free_gain/dynamic."),
      realParameter(
          "static", &C::static_classes, gain, "", Changes::kWhileMapping,
          "Factor on the evidence for free when deciding the state of a voxel whose likeliest class does not "
          "have the flag dynamic. Set it below 1 to keep floors and walls that beams "
          "graze."),
      realParameter(
          "persistence", &C::persistence, NumberRange::atLeast(0.0).upTo(kMostEvidence).slider(0.0, 1e6), "",
          Changes::kWhileMapping,
          "Evidence from hits over which a gain g above 1 falls, to 1 + (g - 1) exp(-evidence / "
          "persistence). Set it to the evidence of a few scans to keep what is hit again and again, "
          "such as parked cars; 0 keeps gains constant. Eight times it is the most that a voxel counts for "
          "in "
          "free_gain/neighbourhood."),
      realParameter(
          "remaining", &C::remaining, NumberRange::atLeast(0.0).upTo(kMostEvidence).slider(0.0, 1e6), "",
          Changes::kWhileMapping,
          "After something movable has left a voxel, a class that cannot move still occupies it if its "
          "evidence is at least this factor times that for free, and a quarter of that for what has left: "
          "the floor under the feet of a walker, for example. Smaller values keep more; 0 switches the rule "
          "off."),
      realParameter("neighbourhood", &C::neighbourhood,
                    NumberRange::atLeast(0.0).upTo(kMostEvidence).slider(0.0, 10.0), "",
                    Changes::kWhileMapping,
                    "Where the likeliest class has the flag dynamic and not the flag living, or no class "
                    "has the flag dynamic, the voxels up to two away decide together: a voxel is occupied "
                    "if the ratio of kept to cleared evidence among them is at least this factor. "
                    "Evidence is kept where a voxel by itself is occupied, and cleared elsewhere; a "
                    "cleared voxel also needs a quarter of the mean evidence of the kept ones, and a "
                    "twentieth of its evidence for free. Set it to about 2 to clear remains of what has "
                    "left and to keep roofs that beams graze; 0 lets each voxel decide by itself."),
      truthParameter(
          "latest", &C::latest, Changes::kAtStart,
          "Whether the map knows time: a voxel whose latest look was a hit is occupied, one that "
          "has been seen void in two intervals of 0.27 s since is free, and one that was hit for "
          "long and is crossed since stays; elsewhere the sum decides. Needs scan_limit/free and "
          "stamped scans; takes 0.5 to 1.1 kB of memory a block. False lets the sum decide alone."),
  };
}

}  // namespace bki_mapping
