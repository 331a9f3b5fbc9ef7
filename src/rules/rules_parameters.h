/// @file The named parameters of RulesConfig.
#pragma once

#include <vector>

#include "bki_mapping/core/named_parameter.h"
#include "bki_mapping/rules/rules_config.h"

namespace bki_mapping {

inline std::vector<NamedParameter<RulesConfig>> rulesParameters() {
  using C = RulesConfig;
  const NumberRange scans = NumberRange::atLeast(1.0).upTo(1000.0);
  return {
      truthParameter(
          "enabled", &C::enabled, Changes::kAtStart,
          "Whether the mapper's own rules apply, which the paper does not have: a scan counts once "
          "in a voxel, what stands is kept although beams graze it, and what has left is cleared. "
          "The other settings of rules/ then say how."),
      realParameter(
          "void_outweighs", &C::void_outweighs, NumberRange::atLeast(0.0).upTo(1000.0), "scans",
          Changes::kWhileMapping,
          "How many scans that hit a voxel are outweighed by one that sees it void: crossed together "
          "with all voxels around it. What stands has an inside that no beam crosses. 0 lets only "
          "crossings count."),
      realParameter(
          "void_margin", &C::void_margin, NumberRange::atLeast(0.0).upTo(2.0), "m", Changes::kWhileMapping,
          "Distance from a hit of what can move within which no voxel counts as void, because errors in the "
          "poses displace hits. It is rounded down to whole voxels, at most seven; a single one hardly makes "
          "a "
          "difference. With voxels of 0.1 m, set it to 0.2 if parked cars vanish where poses are noisy. The "
          "price: trails of what creeps in queues and crowds."),
      realParameter(
          "stands_after", &C::stands_after, NumberRange::atLeast(0.0).upTo(1000.0), "scans",
          Changes::kWhileMapping,
          "How many scans must hit a voxel of 0.3 m until what can be parked stands there; before that, one "
          "scan that crosses the voxel clears it. Larger voxels take more scans, smaller ones fewer, in "
          "proportion to the edge to the power of 1.25. If no class is flagged dynamic, all things stand "
          "after two scans, or "
          "this many if fewer. Lower it to keep what stands sooner; raise it to clear slow traffic."),
      realParameter(
          "living_stands_after", &C::living_stands_after, NumberRange::atLeast(0.0).upTo(1000.0), "scans",
          Changes::kWhileMapping,
          "The same for classes with the flag living: people, riders, animals. They take a few scans "
          "to leave a voxel, and stop more often than they stay."),
      realParameter(
          "fixed_stands_after", &C::fixed_stands_after, NumberRange::atLeast(1.0).upTo(1000.0), "scans",
          Changes::kWhileMapping,
          "The same for classes that cannot move, but for ground; before that, four or five scans that cross "
          "the voxel clear it. Set it to 2 in snow and fog, of which some hits look like a thing; it costs "
          "thin things that only one scan hits."),
      realParameter(
          "together", &C::together, NumberRange::atLeast(0.0).upTo(10.0), "m", Changes::kWhileMapping,
          "How far away the voxels of what can be parked decide together whether it is still there. "
          "It is rounded to whole voxels, at least one and at most seven. Set it to a part of the "
          "things that come and go; 0 lets each voxel decide by itself."),
      realParameter(
          "particles_within", &C::particles_within, NumberRange::atLeast(0.0).upTo(30.0), "m",
          Changes::kWhileMapping,
          "Up to which distance from the sensor a hit near which few other beams end is a raindrop, a "
          "snowflake, fog or dust: it occupies nothing, and its beam clears up to it. Hits of ground are "
          "none. Set it to 15 in rain and snow, 30 in fog; a scan then takes up to half as long again. 0 "
          "lets "
          "all hits count."),
      truthParameter(
          "latest", &C::latest, Changes::kAtStart,
          "Whether the map knows time: a voxel whose latest look was a hit is occupied, one that has "
          "been seen void in two intervals of 0.27 s since is free, and one that was hit for long "
          "and has not been seen since stays; elsewhere all scans decide. Needs stamped scans; takes 0.2 to "
          "0.6 kB of memory a block. False lets all scans decide alike."),
  };
}

}  // namespace bki_mapping
